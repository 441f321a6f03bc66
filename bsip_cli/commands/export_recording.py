"""``bsip export --what recording``: a copy of the study in which the named faults are corrected."""

from __future__ import annotations

import os
import shutil
from collections.abc import Generator, Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation

from bsip_cli import __version__
from bsip_cli.artifacts import is_made_from
from bsip_cli.commands import named_causes as named
from bsip_cli.diagnosis.cause import Cause, corrected_plates, delay_by
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.markers import MarkerSwap
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.plates import ALL, Delay, GravityTilt, Turned, loaded_plates
from bsip_cli.effects.scene import Scene
from bsip_cli.errors import BadDataError, BsipError, UsageError, not_writable
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.folders import is_folder, lies_in
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.readings import Instruments
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot
from bsip_cli.pipeline import Stage
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.plate_wrench import is_noticed, is_silent
from bsip_cli.recordings.session_findings import delay_words
from bsip_cli.recordings.session_reading import Verdict
from bsip_cli.running.runner import Outcome, lacking
from bsip_cli.running.session import OpenedStudy, follow
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import markers_from, person_of, plate_wrenches
from bsip_cli.stages.survey import opened, reading_of
from bsip_cli.stages.trial_scene import plates_of

_OF_TRIALS = ("readings", "markers", "wrench", "plates", "marker-events")
_READER = Stage(
    "export",
    "trial",
    "The recording without its named faults.",
    reads=(*_OF_TRIALS, "skeleton", "marker-positions", "overall-diagnosis"),
    writes=(),
    options=("skeleton", "ingest"),
    reads_if_there=("laboratory",),
)
_SAME_M = 1e-5  # a trajectory of the file and of the artifact
_AT_ONCE_S = 1e-9
_EXACT = 1e-3  # of the largest change of a plate's wrench, that its channels must reproduce


def export_recordings(asked: OpenedStudy, out: Path, folder: Path) -> int:
    """Copy the study into a new folder, its recordings corrected; the exit code."""
    study = asked.study
    _copy_study(study.root, out, folder)

    def running() -> Generator[Outcome, None, None]:
        for participant in study.participants:
            for trial in participant.trials:
                unit = Unit(_READER, study, out, asked.config, participant, trial)
                yield _corrected(unit, folder)

    total = sum(len(one.trials) for one in study.participants)
    return follow("export", asked.refusals, running(), total, folder)


def _copy_study(root: Path, out: Path, folder: Path) -> None:
    """All but results and hidden files; the folder is new or empty and lies outside."""
    if lies_in(folder, root) or lies_in(folder, out) or lies_in(root, folder):
        raise UsageError(
            "lies in the study or its results, or holds it",
            file=folder,
            remedy="name a new folder with --to",
        )
    if os.path.lexists(folder) and not (is_folder(folder) and not any(folder.iterdir())):
        raise UsageError("is not empty", file=folder, remedy="name a new folder with --to")

    def without(where: str, names: list[str]) -> set[str]:
        here = Path(where)
        return {n for n in names if n.startswith(".") or lies_in(here / n, out)}

    try:
        shutil.copytree(root, folder, ignore=without, dirs_exist_ok=True)
    except (OSError, shutil.Error) as error:
        cause = error if isinstance(error, OSError) and error.errno else OSError(0, str(error))
        raise not_writable(folder, cause) from None


def _corrected(unit: Unit, folder: Path) -> Outcome:
    """One recording; as it was where nothing in it can be corrected."""
    if (waiting := lacking(unit, BadDataError.exit_code)) is not None:
        return waiting
    path = folder / unit.own_trial.path.relative_to(unit.study.root)
    try:
        wrench = unit.path("wrench")
        current = all(is_made_from(wrench, one) for one in unit.own_trial.files)
        if not (current and is_made_from(unit.path("overall-diagnosis"), wrench)):
            raise UsageError(
                "has changed since it was read or diagnosed",
                file=unit.own_trial.path,
                remedy="run `bsip run` again",
            )
        correction = _Correction(unit)
        said = [*correction.said]
        if said:
            rewrite = rewrite_c3d if path.suffix.lower() == ".c3d" else rewrite_trc_mot
            head = f"bsip {__version__}: corrected by the diagnosis of {unit.study.root.name}, "
            head += f"{unit.name}; before: sha256 {file_hash(unit.own_trial.path)}"
            rewrite(unit.own_trial.path, path, correction.of, [head, *said])
        left = [f"not corrected: {one}" for one in correction.left]
        lines = [*(f"corrected: {one}" for one in said), *left] or ["nothing to correct"]
    except BsipError as error:
        return Outcome("export", unit.name, "refused", (f"{error}",), error.exit_code)
    return Outcome("export", unit.name, "done", tuple(f"{unit.name}: {one}" for one in lines))


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
        for cause in named.causes_here(unit, [*self._plates], [*self._zeros]):
            words = named.called(cause.effect.name, cause.target)
            alike = named.alike(cause, diagnosis)
            known |= {(cause.effect.name, cause.target), *alike}
            others = " or ".join(named.called(*one) for one in alike)
            if isinstance(cause.effect, MarkerSwap):
                first, second = cause.target.split("+")
                self._swaps.append((first, second, *cause.values[1:3].tolist()))
            elif not named.is_corrected(cause.effect):
                self.left.append(f"{words}: {named.why_left(cause.effect.name, '')}")
            elif isinstance(cause.effect, Turned) and not (self._plates and self._scene.plates):
                self.left.append(f"{words}: no plate shows where the axes are")
            elif alike and not all(
                effect in EFFECTS and EFFECTS[effect].of_the_forces
                for effect, _ in (*alike, (cause.effect.name, ""))
            ):
                self.left.append(f"{words}: it cannot be distinguished from {others} here")
            else:
                self.causes[self._as_diagnosed(cause)] = others
        here = named.said_of(unit.name, diagnosis, [*EFFECTS])
        self.left += dict.fromkeys(
            f"{named.called(*one)}: {named.why_left(one[0], 'its size is not known', group)}"
            for *one, group in here[["effect", "target", "class_id"]].to_numpy()
            if tuple(one) not in known
        )
        # what is there and has no name, or acts like a fault but not evenly
        self.left += dict.fromkeys(
            f"{sentence}: its signal is not known exactly"
            for sentence in named.said_of(unit.name, diagnosis, [UNEXPLAINED])["sentence"]
        )
        verdicts = ("named", "ambiguous")
        about = named.of_the_laboratory(unit, *verdicts) if self._plates else diagnosis[:0]
        self.left += dict.fromkeys(
            f"{sentence}: {named.why_left(effect, 'no size of it is known for this recording')}"
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
        found = named.rows_of(cause, self._diagnosis).set_index("parameter")["estimate"]
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
        said += [named.words_of(*x, self._scene, self._diagnosis) for x in self.causes.items()]
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
