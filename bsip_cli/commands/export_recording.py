"""``bsip export --what recording``: a copy of the study in which the named faults are corrected."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation

from bsip_cli import __version__
from bsip_cli.artifacts import is_made_from
from bsip_cli.diagnosis.cause import Cause, corrected_plates, delay_by
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import digits_of, readable_unit, with_unit
from bsip_cli.effects.markers import MarkerSwap
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.plates import ALL, Delay, FrameRate, GravityTilt, Turned, loaded_plates
from bsip_cli.effects.scene import Scene
from bsip_cli.errors import BadDataError, UsageError, not_writable
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.regular import is_folder, lies_in
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.readings import Instruments
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot
from bsip_cli.pipeline import READERS
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.plate_wrench import is_noticed, is_silent
from bsip_cli.recordings.session_findings import delay_words
from bsip_cli.recordings.session_reading import Verdict
from bsip_cli.running.runner import attempt
from bsip_cli.running.session import OpenedStudy, follow
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import markers_from, person_of, plate_wrenches
from bsip_cli.stages.survey import opened, reading_of
from bsip_cli.stages.trial_scene import (
    causes_here,
    is_corrected,
    of_the_laboratory,
    plates_of,
)

_SAME_M = 1e-5  # a trajectory of the file and of the artifact
_AT_ONCE_S = 1e-9
_EXACT = 1e-3  # of the largest change of a plate's wrench, that its channels must reproduce

NO_FAULT_OF_IT = "no fault of the plates, the clocks, the axes or the labels"
_NO_INTERVAL = np.full((1, 2), np.nan)


def export_recordings(asked: OpenedStudy, out: Path, folder: Path) -> int:
    """Copy the study into a new folder, its recordings corrected; the exit code."""
    _copy_study(asked.study.root, out, folder)
    whole = READERS["export", "recording"], asked.study, out, asked.config
    people = asked.study.participants
    units = [Unit(*whole, person, trial) for person in people for trial in person.trials]
    running = (attempt(unit, partial(_corrected, unit, folder)) for unit in units)
    return follow("export", asked.refusals, running, len(units), folder)


def _copy_study(root: Path, out: Path, folder: Path) -> None:
    """All but results and hidden files; the folder is new or empty and lies outside."""
    found = ""
    if lies_in(folder, root) or lies_in(folder, out) or lies_in(root, folder):
        found = "lies in the study or its results, or holds it"
    elif os.path.lexists(folder) and not (is_folder(folder) and not any(folder.iterdir())):
        found = "is not empty"
    if found:
        raise UsageError(found, file=folder, remedy="name a new folder with --to")

    def without(where: str, names: list[str]) -> set[str]:
        here = Path(where)
        return {n for n in names if n.startswith(".") or lies_in(here / n, out)}

    try:
        shutil.copytree(root, folder, ignore=without, dirs_exist_ok=True)
    except (OSError, shutil.Error) as error:
        cause = error if isinstance(error, OSError) and error.errno else OSError(0, str(error))
        raise not_writable(folder, cause) from None


def _corrected(unit: Unit, folder: Path) -> list[str]:
    """One recording; as it was where nothing in it can be corrected. What is said of it."""
    before, wrench = unit.own_trial.path, unit.path("wrench")
    after = folder / before.relative_to(unit.study.root)
    current = all(is_made_from(wrench, one) for one in unit.own_trial.files)
    if not (current and is_made_from(unit.path("overall-diagnosis"), wrench)):
        raise UsageError(
            "has changed since it was read or diagnosed",
            file=before,
            remedy="run `bsip run` again",
        )
    correction = _Correction(unit)
    if said := correction.said:
        rewrite = rewrite_c3d if after.suffix.lower() == ".c3d" else rewrite_trc_mot
        head = f"bsip {__version__}: corrected by the diagnosis of {unit.study.root.name}, "
        head += f"{unit.name}; before: sha256 {file_hash(before)}"
        rewrite(before, after, correction.of, [head, *said])
    left = [f"not corrected: {one}" for one in correction.left]
    return [*(f"corrected: {one}" for one in said), *left] or ["nothing to correct"]


class _Correction:
    """What is done to a recording. ``said``: what is corrected; ``left``: what is not, and why."""

    def __init__(self, unit: Unit) -> None:
        self.unit, self.left = unit, list[str]()
        trial, table = unit.own_trial, unit.read("readings")
        self._session = reading_of(table, unit.facts("readings"), trial)
        self._gains = self._session.gains()  # as ingest does, taken off
        as_read = opened(unit, trial, self._session.written, self._gains)
        self._opened = as_read.in_frame(self._session.frame)
        events = unit.read("marker-events")
        exchanged = events[events["put_right"].astype(bool)]  # by the inverse kinematics
        pairs = exchanged[["marker", "partner", "start_s", "end_s"]]
        self._swaps = list(pairs.itertuples(index=False, name=None))
        # what the plates read without load, which ingest takes off
        zeros = unit.facts("wrench").get("zeros", {})
        self._zeros = {name: np.array(x) for name, x in zeros.items() if name in self._plates}
        self.causes: dict[Cause, str] = {}  # and what else it may be
        self._diagnosis = diagnosis = unit.read("overall-diagnosis")
        known = set[tuple[str, str]]()
        for cause in causes_here(unit, [*self._plates], [*self._zeros]):
            words = _called(cause.effect.name, cause.target)
            alike = _look_alikes(cause, diagnosis)
            known |= {(cause.effect.name, cause.target), *alike}
            others = " or ".join(_called(*one) for one in alike)
            if isinstance(cause.effect, MarkerSwap):
                first, second = cause.target.split("+")
                self._swaps.append((first, second, *cause.values[1:3].tolist()))
            elif not is_corrected(cause.effect):
                self.left.append(f"{words}: {why_left(cause.effect.name, '')}")
            elif isinstance(cause.effect, Turned) and not (self._plates and self._scene.plates):
                self.left.append(f"{words}: no plate shows where the axes are")
            elif alike and not all(
                effect in EFFECTS and EFFECTS[effect].of_the_forces
                for effect, _ in (*alike, (cause.effect.name, ""))
            ):
                self.left.append(f"{words}: it cannot be distinguished from {others} here")
            else:
                self.causes[self._as_diagnosed(cause)] = others
        here = _said_of(unit.name, diagnosis, [*EFFECTS])
        self.left += dict.fromkeys(
            f"{_called(*one)}: {why_left(one[0], 'its size is not known', group)}"
            for *one, group in here[["effect", "target", "class_id"]].to_numpy()
            if tuple(one) not in known
        )
        # what is there and has no name, or acts like a fault but not evenly
        self.left += dict.fromkeys(
            f"{sentence}: its signal is not known exactly"
            for sentence in _said_of(unit.name, diagnosis, [UNEXPLAINED])["sentence"]
        )
        verdicts = ("named", "ambiguous")
        about = of_the_laboratory(unit, *verdicts) if self._plates else diagnosis[:0]
        self.left += dict.fromkeys(
            f"{sentence}: {why_left(effect, 'no size of it is known for this recording')}"
            for effect, target, sentence in about[["effect", "target", "sentence"]].to_numpy()
            if (effect, target) not in known
            and target.split(" ")[0] in ("", ALL, *loaded_plates(self._scene))
        )
        kept = [
            self._session.frame.words(),
            delay_words(self._session.delays_s.get(self._opened.recording.path.stem, 0.0)),
            *(f"plate {n}: {w}" for n, r in self._plates.items() if (w := _stated(r).words())),
        ]
        self.left += [f"{words}: bsip reads the file so" for words in kept if words]

    def _as_diagnosed(self, cause: Cause) -> Cause:
        """With the sizes that the diagnosis reports; of the laboratory those by all persons: for
        ``extend`` a person's own recordings are left out of them."""
        found = _rows_of(cause, self._diagnosis).set_index("parameter")["estimate"]
        names = [one.name for one in cause.effect.parameters(self._scene, cause.target)]
        if not found.index.is_unique or not {*names} <= {*found.index}:
            return cause
        return replace(cause, values=found[names].to_numpy())

    @property
    def said(self) -> list[str]:
        """Repairs of plates, faults of plates and clocks with their sizes, and exchanged labels."""
        last, cut, said = self._opened.recording.n_frames, self._kept, []
        for name, reading in self._plates.items():
            if _stated(reading) != reading:
                repaired = replace(reading, turn=0, mirrored=False, place_of="")
                said.append(f"plate {name}: {repaired.words()}")
        for name, gain in self._gains.items():
            if name in self._plates:
                said.append(f"plate {name}: forces and moments divided by {gain:.4g}")
        for name, zero in self._zeros.items():
            if is_noticed(zero):
                force = ", ".join(f"{x:.1f}" for x in zero[:3])
                said.append(f"plate {name}: its reading without load, ({force}) N, subtracted")
        said += [_size_words(*x, self._scene, self._diagnosis) for x in self.causes.items()]
        for a, b, start, stop in self._swaps:
            said.append(f"labels {a} and {b} exchanged from {start:.3f} to {stop:.3f} s")
        for n, end in ((cut.start, "beginning"), (last - cut.stop, "end")):
            if n:
                said.append(f"frames left out at the {end}, whose forces were not recorded: {n}")
        return said

    def of(self, before: Instruments) -> Instruments:
        """The instruments corrected."""
        after = replace(before, points_m=self._points(before))
        if before.plates and self._plates:
            after = replace(after, readings=self._readings(before))
        kept, stamps = self._kept, self._stamps(before)
        if stamps is not None:
            times = self._opened.recording.time_s()
            first = np.searchsorted(stamps, times[kept.start] - _AT_ONCE_S) if kept.start else 0
            cut = kept.stop < len(times)
            last = np.searchsorted(stamps, times[kept.stop - 1]) if cut else len(stamps)
            kept = slice(int(first), int(last))
        return after.frames(kept.start, kept.stop)

    def _stamps(self, before: Instruments) -> np.ndarray | None:
        """(n,) times of the file's frames where they are uneven: bsip reads them evenly."""
        if before.stamps_s is None:
            return None
        times = self._opened.recording.time_s()
        stamps = times[0] + before.stamps_s
        if stamps[-1] - times[-1] > 2 / self._opened.recording.marker_rate_hz:
            raise BadDataError(
                f"{stamps[-1] - times[0]:.4g} s, of which bsip uses {np.ptp(times):.4g} s",
                expected="times without a gap",
                file=self.unit.name,
                remedy="export the part that is used",
            )
        return stamps

    @cached_property
    def _kept(self) -> slice:
        """Frames whose forces, which a clock may have recorded late, are in the file."""
        recording = self._opened.recording
        if not any(isinstance(cause.effect, Delay) for cause in self.causes):
            return slice(0, recording.n_frames)
        scene = self._scene
        begin = recording.time_s() + np.interp(
            recording.time_s(), scene.times_s, delay_by([*self.causes], scene)
        )
        end = begin + 1 / recording.marker_rate_hz - 1 / recording.analog_rate_hz
        there = (begin > scene.times_s[0] - 1e-9) & (end < scene.times_s[-1] + 1e-9)
        if there.sum() < 2:
            raise BadDataError("nothing is left of it without its delay", file=self.unit.name)
        first, *_, last = np.flatnonzero(there)
        return slice(int(first), int(last) + 1)

    # --- forces -------------------------------------------------------------------------------

    @cached_property
    def _plates(self) -> dict[str, PlateReading]:
        names = [source.name for source in self._opened.sources]
        plates = self._session.plates_of(self._opened.recording.path.stem)
        found = {name: plates.get(name, Verdict()) for name in names}
        return {n: one.reading for n, one in found.items() if not (one.refusal or one.repeats)}

    def _wrench(self, name: str, reading: PlateReading) -> np.ndarray:
        by_name = {one.name: one for one in self._opened.sources}
        source = by_name[name]
        if reading.place_of in by_name:
            source = source.in_place_of(by_name[reading.place_of])
        wrench = source.parts() @ source.matrix(reading).T
        return np.where(source.usable[:, None], wrench, np.nan)

    def _understood(self, name: str) -> np.ndarray:
        """(N, 6) of a plate as the diagnosis saw it."""
        return self._wrench(name, self._plates[name]) - self._zeros.get(name, np.zeros(6))

    @cached_property
    def _scene(self) -> Scene:
        """Plates at the rate of their samples; their faults ask nothing of the motion."""
        unit, recording = self.unit, self._opened.recording
        table = unit.read("wrench")
        plates = tuple(
            replace(plate, wrench=reading, silent=is_silent(reading))
            for plate in plates_of(unit.read("plates"), plate_wrenches(table))
            if plate.name in self._plates
            for reading in [self._understood(plate.name)]
        )
        samples = np.arange(len(self._opened.sources[0].usable))
        times = recording.time0_s + samples / recording.analog_rate_hz
        frames = np.searchsorted(table["time_s"], times - 0.5 / recording.marker_rate_hz)
        valid = table["valid"].to_numpy()[np.clip(frames, 0, len(table) - 1)]
        valid = valid if valid.any() else ~valid  # none in which the diagnosis saw all contacts
        none = np.empty((len(times), 0))
        return Scene(times, person_of(unit), none, none, none, np.empty(0), plates, valid)

    def _readings(self, before: Instruments) -> np.ndarray:
        corrected = corrected_plates(self._scene, [*self.causes])
        readings, times = before.readings.copy(), self._scene.times_s
        stamps = self._stamps(before)
        for name, reading in self._plates.items():
            now = self._gains.get(name, 1.0) * self._wrench(name, _stated(reading))
            k = int(name) - 1
            wanted = corrected.get(name, self._understood(name))
            zero = self._zeros.get(name, np.zeros(6))
            wanted = wanted if is_noticed(zero) else wanted + zero
            for about, back in self._turns(markers=False):
                force = wanted[:, :3] @ back.T
                moment = (wanted[:, 3:] - np.cross(about, wanted[:, :3])) @ back.T
                wanted = np.hstack([force, moment + np.cross(about, force)])
            change = np.nan_to_num(wanted - now)
            if change.any():
                seen = readings[k] if stamps is None else _at(times, stamps, readings[k])
                found = _in_reading(seen, now, change, self.unit)
                readings[k] += found if stamps is None else _at(stamps, times, found)
        return readings

    # --- axes and labels ------------------------------------------------------------------------

    def _turns(self, *, markers: bool) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Point (3,) and matrix (3, 3) of the turns that bring markers, or plates, into true axes:
        where the vertical is tilted both, about the middle of the plates, lest the surfaces, whose
        places in the file stay, come to lie under or over what stands on them."""
        for cause in self.causes:
            tilted = isinstance(cause.effect, GravityTilt)
            if tilted or (markers and isinstance(cause.effect, Turned)):
                middle = np.mean([plate.centre_m() for plate in self._scene.plates], axis=0)
                back = Rotation.from_rotvec([*-cause.values, 0.0]).as_matrix()
                yield middle if tilted else np.zeros(3), back

    def _points(self, before: Instruments) -> np.ndarray:
        to_world = self._opened.recording.rotation_world_lab
        if self._session.frame.moves_markers:
            to_world = self._session.frame.matrix() @ to_world
        points = before.points_m.copy()
        if self._swaps:
            times, labels, places = markers_from(self.unit.read("markers"))
            seen, stamps = before.points_m @ to_world.T, self._stamps(before)
            if stamps is not None:
                seen, times = _at(times, stamps, seen), stamps
            for *pair, start, end in self._swaps:
                columns = [_column(seen, places[:, labels.index(name)], name) for name in pair]
                frames = np.flatnonzero((times >= start) & (times <= end))[:, None]
                points[frames, columns] = points[frames, columns[::-1]]
        for about, back in self._turns(markers=True):
            world = points @ to_world.T - about
            points = (world @ back.T + about) @ to_world
        return points


def _stated(reading: PlateReading) -> PlateReading:
    """Without the repairs that other numbers in the channels make needless."""
    plain = replace(reading, moment_scale=1.0, point_scale=1.0)
    return replace(plain, about="stated", channels="", centre_m=None)


def _in_reading(
    reading: np.ndarray, wrench: np.ndarray, change: np.ndarray, unit: Unit
) -> np.ndarray:
    """(N, 6) what a reading (N, 6) has to change by for a change (N, 6) of the wrench that bsip
    makes of it, (N, 6): that is linear."""
    count, rest = len(wrench), len(reading) - len(wrench)
    if not 0 <= rest < 0.02 * count + 1:  # a reader may end with the last frame's first sample
        raise BadDataError(
            f"{len(reading)} samples of forces, of which bsip uses {count}",
            expected="forces over the markers' whole time",
            file=unit.name,
            remedy="export the trial with them",
        )
    known = np.isfinite(reading[:count]).all(axis=1) & np.isfinite(wrench).all(axis=1)
    rows = np.hstack([reading[:count], np.ones((count, 1))])
    matrix = np.linalg.lstsq(rows[known], wrench[known], rcond=None)[0][:6].T
    found = change @ np.linalg.pinv(matrix, rcond=1e-9).T
    if np.abs(found @ matrix.T - change).max() > _EXACT * np.abs(change).max():
        raise BadDataError(
            "what bsip reads of a plate does not follow from its channels in one way",
            file=unit.name,
            expected="a plate of TYPE 2 to 4, or force, point and moment",
        )
    return np.pad(found, ((0, rest), (0, 0)), mode="edge")


def _at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(N, ...) values (n, ...) of times (n,) at others (N,), on lines between them."""
    ends = (values[0], values[-1])
    between = interp1d(known_s, values, axis=0, bounds_error=False, fill_value=ends)
    return np.asarray(between(times_s))


def _column(seen: np.ndarray, place: np.ndarray, name: str) -> int:
    """Which of the file's points (N, m, 3) a marker (N, 3) is."""
    if len(seen) == len(place):
        apart = np.linalg.norm(seen - place[:, None], axis=2)
        apart = np.nanmedian(np.where(np.isnan(apart).all(axis=0), np.inf, apart), axis=0)
        if apart.min() < _SAME_M:
            return int(np.argmin(apart))
    raise BadDataError("its trajectory is not that of a point of the file", file=name)


# --- what the diagnosis names in a recording, and what is said of it -----------------------------


def _called(effect: str, target: str) -> str:
    """A cause by the names of its effect and place, in the same ASCII as its numbers."""
    if effect == UNEXPLAINED:
        return "what acts like it and has no name"
    return f"{effect} {target}".strip()


def why_left(effect: str, unknown: str, group: str = "") -> str:
    """Why what has no cause in the facts is not corrected. group : in which it is one of several;
    unknown : what is said of a fault that could be corrected."""
    if group:
        return "one of several causes that look alike"
    known = EFFECTS.get(effect)
    if isinstance(known, FrameRate):
        return "write the rate of the recording into the file, and run again"
    can_be = known is not None and (is_corrected(known) or isinstance(known, MarkerSwap))
    return unknown if can_be else NO_FAULT_OF_IT


def _rows_of(cause: Cause, diagnosis: pd.DataFrame) -> pd.DataFrame:
    """What the diagnosis says of a cause, a row for each number; what is known from the laboratory
    may be rejected as this person's own."""
    key = {"effect": cause.effect.name, "target": cause.target, "trials": ", ".join(cause.trials)}
    is_it = (diagnosis[[*key]] == pd.Series(key)).all(axis=1)
    return diagnosis[is_it & (diagnosis["verdict"] != "rejected")]


def _look_alikes(cause: Cause, diagnosis: pd.DataFrame) -> list[tuple[str, str]]:
    """Effects and targets that look like a cause in these recordings."""
    groups = set(_rows_of(cause, diagnosis)["class_id"]) - {""}
    is_it = (diagnosis["effect"] == cause.effect.name) & (diagnosis["target"] == cause.target)
    others = diagnosis[diagnosis["class_id"].isin(groups) & ~is_it]
    return list(dict.fromkeys(zip(others["effect"], others["target"], strict=True)))


def _said_of(trial: str, diagnosis: pd.DataFrame, effects: Sequence[str]) -> pd.DataFrame:
    """Rows of these effects that the diagnosis names, alone or in a group, in a trial."""
    here = np.array([trial in names.split(", ") for names in diagnosis["trials"]], dtype=bool)
    is_named = diagnosis["verdict"] != "rejected"
    return diagnosis[here & diagnosis["effect"].isin(effects) & is_named]


def _size_words(cause: Cause, others: str, scene: Scene, diagnosis: pd.DataFrame) -> str:
    """``sync_offset: delay 11.9 ms (95 % interval 11.0 to 12.7) taken off``: in ASCII, which all
    readers of C3D know."""
    values, rows = [], _rows_of(cause, diagnosis)
    for name, unit, value in cause.effect.reported(scene, cause.target, cause.values):
        factor, readable = readable_unit(name, unit)
        mine = rows[rows["parameter"] == name]  # two: the laboratory's, and the person's own
        nearest = mine.iloc[(mine["estimate"] - value).abs().argsort()[:1]]
        known = nearest[["ci_low", "ci_high"]].to_numpy() if len(mine) else _NO_INTERVAL
        low, high = factor * known[0]
        size, interval = f"{factor * value:.3g}", ""
        if high > low:
            size, *ends = (f"{x:.{digits_of(high - low)}f}" for x in (factor * value, low, high))
            interval = f" (95 % interval {' to '.join(ends)})"
        values.append(f"{name} {with_unit(size, readable)}{interval}")
    alike = f" (as likely {others}, with the same sum of forces)" if others else ""
    words = _called(cause.effect.name, cause.target)
    return f"{words}: {', '.join(values)} taken off{alike}".replace("°", " deg")
