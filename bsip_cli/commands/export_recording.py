"""``bsip export --what recording``: a copy of the study in which the named faults are corrected."""

from __future__ import annotations

import os
import shutil
from collections.abc import Generator
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from bsip_cli import __version__
from bsip_cli.artifacts import is_made_from
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.cause import Cause, delay_by
from bsip_cli.diagnosis.corrected_wrench import (
    corrected_plates,
    is_fault_of_forces,
    is_of_the_forces,
)
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.markers import MarkerSwap
from bsip_cli.effects.scene import Scene
from bsip_cli.errors import BadDataError, BsipError, UsageError, not_writable
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.folders import is_folder, lies_in
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.readings import Instruments
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot
from bsip_cli.pipeline import Stage
from bsip_cli.recordings.opened import Opened
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.settle import SessionReading, Verdict
from bsip_cli.running.runner import Outcome, lacking
from bsip_cli.running.session import OpenedStudy, follow
from bsip_cli.running.unit import Unit
from bsip_cli.stages.found_causes import causes_of
from bsip_cli.stages.frames import markers_from, person_from
from bsip_cli.stages.session_reading import opened, reading_of
from bsip_cli.stages.trial_scene import plates_of

_READER = Stage(
    "export",
    "trial",
    "The recording without its named faults.",
    reads=(
        "readings",
        "markers",
        "wrench",
        "plates",
        "marker-events",
        "skeleton",
        "marker-positions",
        "overall-diagnosis",
    ),
    writes=(),
    options=("skeleton", "ingest"),
)
_SAME_M = 1e-5  # a trajectory of the file and of the artifact
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
    assert unit.trial is not None
    waiting = lacking(unit)
    if waiting is not None:
        return replace(waiting, exit_code=waiting.exit_code or BadDataError.exit_code)
    path = folder / unit.trial.path.relative_to(unit.study.root)
    try:
        _check_fresh(unit)
        correction = _Correction(unit)
        said = [*correction.said]
        if said:
            rewrite = rewrite_c3d if path.suffix.lower() == ".c3d" else rewrite_trc_mot
            head = f"bsip {__version__}: corrected by the diagnosis of {unit.study.root.name}, "
            head += f"{unit.name}; before: sha256 {file_hash(unit.trial.path)}"
            rewrite(unit.trial.path, path, correction.of, [head, *said])
        left = [f"not corrected: {one}" for one in correction.left]
        lines = [*(f"corrected: {one}" for one in said), *left] or ["nothing to correct"]
    except BsipError as error:
        return Outcome("export", unit.name, "refused", (f"{error}",), error.exit_code)
    return Outcome("export", unit.name, "done", tuple(f"{unit.name}: {one}" for one in lines))


def _check_fresh(unit: Unit) -> None:
    """The diagnosis is of the recording as it is now."""
    assert unit.trial is not None
    wrench = unit.path("wrench")
    current = all(is_made_from(wrench, path) for path in unit.trial.files)
    if not (current and is_made_from(unit.path("overall-diagnosis"), wrench)):
        raise UsageError(
            "has changed since it was read or diagnosed",
            file=unit.trial.path,
            remedy="run `bsip run` again",
        )


class _Correction:
    """What is done to one recording.

    ``said`` : what is corrected, a sentence each. ``left`` : what is not, and why.
    """

    def __init__(self, unit: Unit) -> None:
        self.unit, self.left = unit, list[str]()
        self._opened, self._session = _opened(unit)
        self._swaps = _exchanged(unit.read("marker-events"))
        self.causes: dict[Cause, str] = {}  # and what else it may be
        told = unit.read("overall-diagnosis")
        known = set[tuple[str, str]]()
        for cause in (one for one in causes_of(unit) if unit.name in one.trials):
            words, alike = f"{cause.effect.name} {cause.target}".strip(), _alike(cause, told)
            known |= {(cause.effect.name, cause.target), *alike}
            others = " or ".join(f"{effect} {target}".strip() for effect, target in alike)
            if isinstance(cause.effect, MarkerSwap):
                first, second = cause.target.split("+")
                self._swaps.append((first, second, *cause.values[1:3].tolist()))
            elif not is_of_the_forces(cause):
                self.left.append(f"{words}: no fault of the plates, the clocks or the labels")
            elif not all(
                effect in EFFECTS and is_fault_of_forces(EFFECTS[effect]) for effect, _ in alike
            ):
                self.left.append(f"{words}: it cannot be distinguished from {others} here")
            else:
                self.causes[cause] = others
        self.left += [
            f"{effect} {target}: of unknown size in this recording, or one of several causes"
            for effect, target in _told_of(unit.name, told)
            if (effect, target) not in known
        ]
        kept = [
            self._session.frame.words(),
            *(f"plate {n}: {w}" for n, r in self._plates.items() if (w := _stated(r).words())),
        ]
        self.left += [f"{words}: bsip reads the file so" for words in kept if words]

    @property
    def said(self) -> list[str]:
        """Repairs of plates, faults of plates and clocks with their sizes, and exchanged labels."""
        scene = self._scene if self.causes else None
        last, cut = self._opened.recording.n_frames, self._kept
        return [
            *(
                f"plate {name}: {replace(reading, turn=0, mirrored=False, place_of='').words()}"
                for name, reading in self._plates.items()
                if _stated(reading) != reading
            ),
            *(_words(*one, scene) for one in self.causes.items() if scene is not None),
            *(
                f"labels {a} and {b} exchanged from {start:.3f} to {end:.3f} s"
                for a, b, start, end in self._swaps
            ),
            *(
                f"{n} frames at the {end} left out: their forces were not recorded"
                for n, end in ((cut.start, "beginning"), (last - cut.stop, "end"))
                if n
            ),
        ]

    def of(self, before: Instruments) -> Instruments:
        """The instruments corrected."""
        after = replace(before, points_m=self._points(before))
        if before.plates and self._plates:
            after = replace(after, readings=self._readings(before))
        return after.frames(self._kept.start, self._kept.stop)

    @cached_property
    def _kept(self) -> slice:
        """Frames whose forces, which a clock may have recorded late, are in the file."""
        recording = self._opened.recording
        if all(cause.effect.of_the_plates for cause in self.causes):
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
        """How the plates that count are understood."""
        found = {s.name: self._session.plates.get(s.name, Verdict()) for s in self._opened.sources}
        return {
            name: one.reading for name, one in found.items() if not (one.refusal or one.repeats)
        }

    def _wrench(self, name: str, reading: PlateReading) -> np.ndarray:
        by_name = {one.name: one for one in self._opened.sources}
        source = by_name[name]
        if reading.place_of in by_name:
            source = source.in_place_of(by_name[reading.place_of])
        wrench = source.parts() @ source.matrix(reading).T
        return np.where(source.usable[:, None], wrench, np.nan)

    @cached_property
    def _scene(self) -> Scene:
        """Plates at the rate of their samples; their faults ask nothing of the motion."""
        unit, recording = self.unit, self._opened.recording
        table = unit.read("wrench")
        plates = tuple(
            replace(plate, wrench=self._wrench(plate.name, self._plates[plate.name]))
            for plate in plates_of(unit.read("plates"), table)
            if plate.name in self._plates
        )
        samples = np.arange(len(self._opened.sources[0].usable))
        times = recording.time0_s + samples / recording.analog_rate_hz
        frames = np.searchsorted(table["time_s"], times - 0.5 / recording.marker_rate_hz)
        valid = table["valid"].to_numpy()[np.clip(frames, 0, len(table) - 1)]
        skeleton = load_skeleton(unit.config.skeleton)
        person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
        none = np.empty((len(times), 0))
        return Scene(times, person, none, none, none, np.empty(0), plates, valid)

    def _readings(self, before: Instruments) -> np.ndarray:
        corrected = corrected_plates(self._scene, [*self.causes])
        readings = before.readings.copy()
        for name, reading in self._plates.items():
            now, k = self._wrench(name, _stated(reading)), int(name) - 1
            wanted = corrected.get(name, self._wrench(name, reading))
            change = np.nan_to_num(wanted - now)
            if change.any():
                readings[k] += _in_reading(readings[k], now, change, self.unit)
        return readings

    # --- labels -------------------------------------------------------------------------------

    def _points(self, before: Instruments) -> np.ndarray:
        if not self._swaps:
            return before.points_m
        times, labels, places = markers_from(self.unit.read("markers"))
        recording = self._opened.recording
        seen = before.points_m @ recording.rotation_world_lab.T
        if self._session.frame.moves_markers:
            seen = seen @ self._session.frame.matrix().T
        points = before.points_m.copy()
        for *pair, start, end in self._swaps:
            columns = [_column(seen, places[:, labels.index(name)], name) for name in pair]
            frames = np.flatnonzero((times >= start) & (times <= end))[:, None]
            points[frames, columns] = points[frames, columns[::-1]]
        return points


def _opened(unit: Unit) -> tuple[Opened, SessionReading]:
    assert unit.trial is not None
    session = reading_of(unit, unit.trial)
    return session.frame.of(opened(unit, unit.trial)), session


def _alike(cause: Cause, told: pd.DataFrame) -> list[tuple[str, str]]:
    """Effects and targets that look like a cause in these recordings."""
    trials = ", ".join(cause.trials)
    is_it = (told["effect"] == cause.effect.name) & (told["target"] == cause.target)
    groups = set(told.loc[is_it & (told["trials"] == trials), "class_id"]) - {""}
    others = told[told["class_id"].isin(groups) & ~is_it]
    return list(dict.fromkeys(zip(others["effect"], others["target"], strict=True)))


def _told_of(trial: str, told: pd.DataFrame) -> list[tuple[str, str]]:
    """Effects and targets that the diagnosis names, alone or in a group, in a trial."""
    here = np.array([trial in names.split(", ") for names in told["trials"]], dtype=bool)
    rows = told[here & told["effect"].isin(list(EFFECTS)) & (told["verdict"] != "rejected")]
    return list(dict.fromkeys(zip(rows["effect"], rows["target"], strict=True)))


def _exchanged(events: pd.DataFrame) -> list[tuple[str, str, float, float]]:
    """Pairs of labels that the inverse kinematics exchanged, and from when to when."""
    done = events[events["put_right"].astype(bool)]
    return list(done[["marker", "partner", "start_s", "end_s"]].itertuples(index=False, name=None))


def _stated(reading: PlateReading) -> PlateReading:
    """Without the repairs that other numbers in the channels make needless."""
    return replace(
        reading,
        moment_scale=1.0,
        point_scale=1.0,
        about="stated",
        reversed_channel="",
        centre_m=None,
    )


def _words(cause: Cause, others: str, scene: Scene) -> str:
    sizes = cause.effect.reported(scene, cause.target, cause.values)
    values = ", ".join(f"{name} {value:.4g} {unit}" for name, unit, value in sizes)
    alike = f" (as likely {others}, with the same sum of forces)" if others else ""
    words = " ".join(filter(None, (cause.effect.name, cause.target)))
    return f"{words}: {values} taken off{alike}"


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


def _column(seen: np.ndarray, place: np.ndarray, name: str) -> int:
    """Which of the file's points (N, m, 3) a marker (N, 3) is."""
    if len(seen) == len(place):
        apart = np.linalg.norm(seen - place[:, None], axis=2)
        apart = np.nanmedian(np.where(np.isnan(apart).all(axis=0), np.inf, apart), axis=0)
        if apart.min() < _SAME_M:
            return int(np.argmin(apart))
    raise BadDataError("its course is not that of a point of the file", file=name)
