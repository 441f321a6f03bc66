"""The stages on arrays and tables, without a study on disk: for notebooks and other programs.

    import bsip_cli as bsip

    trials = {name: bsip.read(f"{name}.c3d") for name in ("static", "sequence", "walking")}
    person = bsip.Person(trials, sex="F", mass_kg=62.0)
    person.identify()          # inertial parameters, RM and OM
    person.diagnose()          # what the simulation gets wrong
    person.joints()["walking"] # moments at the joints

Tables are those of the artifacts: docs/artifacts.md lists their columns, units and frames.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd

from bsip_cli import __version__
from bsip_cli.artifacts import Rows, as_read
from bsip_cli.body.exports import FORMATS
from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.inertia import from_readable
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import Config, config_of
from bsip_cli.errors import BadDataError, BsipError, UsageError
from bsip_cli.pipeline import STAGES, Stage, producer, upstream
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plate_reading import Opened
from bsip_cli.recordings.plates import PlateDescription
from bsip_cli.recordings.plates_of_files import C3dPlate
from bsip_cli.recordings.read import open_recording
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.frames import person_from
from bsip_cli.study.participants import Participant
from bsip_cli.study.study import Study
from bsip_cli.study.trials import Trial, trial_named

_NOWHERE = Path("memory")
_ID = "sub-01"
_Kept = tuple[pd.DataFrame, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Plate:
    """What a force plate measured, on the body that stands on it.

    force_N, moment_Nm : (n, 3) in the world's axes (Z up), moments about the world's origin; a
        person who stands gives a positive Z. NaN where a sample cannot be used.
    corners_m : (4, 3) of the surface, in order round it, world.
    """

    force_N: np.ndarray
    moment_Nm: np.ndarray
    corners_m: np.ndarray


def read(path: str | Path) -> Opened:
    """A recording's file: a ``.c3d``, or a ``.trc`` with the file of ground forces next to it.

    BadDataError: The file is none of these, or is damaged; the sentence says what was found.
    """
    return open_recording(Path(path))


def recording(
    labels: Sequence[str],
    markers_m: np.ndarray,
    rate_hz: float,
    plates: Sequence[Plate] = (),
    analog_rate_hz: float | None = None,
) -> Opened:
    """A recording from arrays.

    labels : of m markers.
    markers_m : (n, m, 3), world (Z up); NaN where a marker is not seen.
    rate_hz : of the markers. analog_rate_hz : of the plates, a multiple of it; by default the same.

    UsageError: Shapes or rates do not fit together.
    """
    analog_rate_hz = analog_rate_hz or rate_hz
    markers_m = np.asarray(markers_m, dtype=float)
    if markers_m.ndim != 3 or markers_m.shape[1:] != (len(labels), 3):
        raise UsageError(
            f"markers of shape {markers_m.shape} for {len(labels)} labels",
            expected=f"(frames, {len(labels)}, 3)",
            remedy="put one position per frame and label",
        )
    ratio, count = analog_rate_hz / rate_hz, len(markers_m)
    if ratio < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise UsageError(
            f"plates at {analog_rate_hz:g} Hz, markers at {rate_hz:g} Hz",
            expected="a whole multiple of the markers' rate",
            remedy="resample the forces",
        )
    sources = [_source(str(k + 1), one, round(ratio) * count) for k, one in enumerate(plates)]
    found = Recording(
        path=_NOWHERE,
        marker_rate_hz=float(rate_hz),
        labels=tuple(labels),
        markers_m=markers_m,
        analog_rate_hz=float(analog_rate_hz),
        plates=(),
        findings=(),
        rotation_world_lab=np.eye(3),
        forces_note="" if plates else "there is no force plate",
        time0_s=0.0,
    )
    return Opened(found, tuple(sources))


def _source(name: str, plate: Plate, count: int) -> C3dPlate:
    """As a C3D file has it: about the middle of the surface, in the plate's axes."""
    force, moment, corners = (
        np.asarray(x, dtype=float) for x in (plate.force_N, plate.moment_Nm, plate.corners_m)
    )
    shapes = force.shape, moment.shape, corners.shape
    if shapes != ((count, 3), (count, 3), (4, 3)):
        raise UsageError(
            f"plate {name}: forces, moments and corners of shapes {shapes}",
            expected=f"({count}, 3), ({count}, 3) and (4, 3)",
            remedy="give all samples of the recording",
        )
    described = PlateDescription(name, 2, corners, np.zeros(3))
    axes = described.rotation_lab_plate()
    at_centre = moment - np.cross(described.centre_m(), force)
    usable = np.isfinite(force).all(axis=1) & np.isfinite(moment).all(axis=1)
    channels = np.hstack([np.nan_to_num(force) @ axes, np.nan_to_num(at_centre) @ axes])
    return C3dPlate(described, channels, usable, np.eye(3))


class Person:
    """A person, the recordings, and what the stages make of them.

    trials : recordings by name: a task, with ``_run-2`` where it was done again ("walking_run-2").
        ``static`` calibrates, ``sequence`` identifies, as ``options["roles"]`` says.
    sex : "M", "F" or "other" (the mean of both tables).
    mass_kg, height_m : None where not known: then from the recordings, where they decide it.
    options : as in study.toml, for example ``{"marker_set": "hansen2017"}``.

    messages : what the stages had to say, in order.
    refused : by stage and trial (empty: the person), why it could not be done.

    UsageError: Unknown options, or a name that is none of a trial.
    """

    def __init__(
        self,
        trials: Mapping[str, Opened],
        *,
        sex: str = "other",
        mass_kg: float | None = None,
        height_m: float | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        if sex not in ("M", "F", "other"):
            raise UsageError(f"sex '{sex}'", expected="M, F or other", remedy="give one of them")
        self.config: Config = config_of(options or {})
        self.messages: list[str] = []
        self.refused: dict[tuple[str, str], BsipError] = {}
        self._done: set[str] = set()
        self._kept: dict[Path, _Kept] = {}
        roles = self.config.roles.model_dump()
        self._trials = {name: trial_named(_ID, name, _NOWHERE, roles) for name in trials}
        self._recordings = {self._trials[name].stem: opened for name, opened in trials.items()}
        its_own = tuple(self._trials.values())
        self._participant = Participant(_ID, cast(Any, sex), mass_kg, height_m, its_own)
        self._study = Study(_NOWHERE, (self._participant,))

    # --- the stages ---------------------------------------------------------------------------

    def scale(self) -> pd.DataFrame:
        """The person's ``skeleton``: joints and lengths."""
        return self._whole("scale", "skeleton")

    def solve(self) -> dict[str, pd.DataFrame]:
        """By trial, ``kinematics``: joint coordinates, velocities and accelerations."""
        return self._by_trial("ik", "kinematics")

    def identify(self) -> pd.DataFrame:
        """``bsip``: mass, centre and inertia of each segment by method (RM, RM+mass, OM)."""
        return self._whole("identify", "bsip")

    def reconstruct(self) -> dict[str, pd.DataFrame]:
        """By trial, ``reconstruction``: the ground wrench measured, and as each method has it."""
        return self._by_trial("reconstruct", "reconstruction")

    def diagnose(self) -> pd.DataFrame:
        """``overall-diagnosis``: what the simulation gets wrong, candidate by candidate."""
        return self._whole("diagnose", "overall-diagnosis")

    def extend(self) -> dict[str, pd.DataFrame]:
        """By trial, ``gain`` of the model with the named causes, on data held out."""
        return self._by_trial("extend", "gain")

    def joints(self) -> dict[str, pd.DataFrame]:
        """By trial, ``joint-moments``: net forces, moments and powers with their errors."""
        return self._by_trial("joints", "joint-moments")

    def export(self, form: str, method: str = "OM") -> str:
        """The identified person as a model, the text of a file.

        form : urdf, mjcf, osim, biomod or csv.
        """
        self._run("identify")
        if form not in FORMATS:
            raise UsageError(f"format '{form}'", expected=", ".join(FORMATS), remedy="ask for one")
        skeleton = load_skeleton(self.config.skeleton)
        person = person_from(self.table("skeleton"), self.table("marker-positions"), skeleton)
        rows = self.table("bsip").query("method == @method").set_index("segment")
        if rows.empty:
            known = ", ".join(self.table("bsip")["method"].unique())
            raise UsageError(f"method '{method}'", expected=known, remedy="name one of them")
        values = rows.loc[list(skeleton.body_names), list(bsip_names())].to_numpy()
        inertias = tuple(from_readable(row) for row in values)
        made_of = (f"bsip {__version__} in memory: method {method}",)
        return FORMATS[form][1](IdentifiedPerson(person, inertias, _ID, method, made_of))

    def table(self, kind: str, trial: str = "") -> pd.DataFrame:
        """Any table that has been made, by its kind and trial, as docs/artifacts.md names it.

        KeyError: It has not been made.
        """
        own = self._trials[trial] if trial else None
        return self._kept[self._unit(producer(kind)).path(kind, own)][0].copy()

    # --- running them -------------------------------------------------------------------------

    def _whole(self, stage: str, kind: str) -> pd.DataFrame:
        self._run(stage)
        return self.table(kind)

    def _by_trial(self, stage: str, kind: str) -> dict[str, pd.DataFrame]:
        self._run(stage)
        made = self._unit(producer(kind)).trials(kind)
        names = (name for name, trial in self._trials.items() if trial in made)
        return {name: self.table(kind, name) for name in names}

    def _run(self, last: str) -> None:
        """What a stage needs, and itself, once; a trial that is refused does not stop the others.

        BsipError: The person cannot be done.
        """
        asked = (one for one in STAGES if one.name == last and one.level != "cohort")
        for stage in upstream(asked, lambda one: (*one.reads, *one.amends)):
            if stage.label in self._done:
                continue
            of_trials = stage.level == "trial"
            trials: Mapping[str, Trial | None] = self._trials if of_trials else {"": None}
            for name, trial in trials.items():
                self._do(self._unit(stage, trial), name)
            self._done.add(stage.label)

    def _do(self, unit: Unit, trial: str) -> None:
        if gone := unit.missing():
            if not trial:
                raise next(iter(self.refused.values()), None) or BadDataError(
                    f"{unit.stage.name} has no {', '.join(gone)} to read",
                    file=unit.name,
                    remedy="give the recordings that it needs",
                )
            return
        try:
            unit.stage.run(unit)
        except BsipError as error:
            self.refused[unit.stage.name, trial] = error
            if not trial:
                raise
        finally:
            self.messages += unit.messages

    def _unit(self, stage: Stage, trial: Trial | None = None) -> Unit:
        whole = self._study, _NOWHERE, self.config, self._participant
        return _InMemory(stage, *whole, trial, recordings=self._recordings, kept=self._kept)


@dataclass(eq=False)
class _InMemory(Unit):
    """A unit whose tables, with what is said of them, stay in memory, by the paths that they would
    have."""

    kept: dict[Path, _Kept] = field(default_factory=dict)

    @cached_property
    def made_by(self) -> dict[str, Any]:
        """Of no files."""
        return {}

    def _names(self, participant: Participant | None) -> frozenset[str]:
        return frozenset(path.name for path in self.kept)

    def _table(self, path: Path, kind: str, **wanted: Collection[str]) -> pd.DataFrame:
        frame = self.kept[path][0]
        for column, values in wanted.items():
            frame = frame[frame[column].isin(list(values))]
        return frame.reset_index(drop=True)

    def _provenance(self, path: Path, kind: str) -> dict[str, Any]:
        return self.kept[path][1]

    def _keep(self, path: Path, kind: str, frame: Rows, notes: dict[str, Any]) -> None:
        # as they would come back from a file
        self.kept[path] = as_read(kind, frame), json.loads(json.dumps(notes))
