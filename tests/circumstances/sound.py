"""Sound sessions with a known truth: people of `bsip simulate`, read back without bsip."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import ezc3d
import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.simulate.options import Laboratory, Rates, Richness, StudyOptions
from bsip_cli.simulate.study import simulate_participant

RATES = {"default": Rates(marker_hz=200, analog_hz=1000)}
DURATIONS_S = {"static": 2.0, "squat": 3.0, "steps": 3.6, "walking": 2.0}
# Two plates side by side; three and two in the walking direction.
LABORATORIES = {
    "side-by-side": (Laboratory(plate_per_foot=True), ("squat", "steps")),
    "walkway": (Laboratory(plates=3), ("walking", "squat")),
    "small-plates": (Laboratory(plates=2, plate_size_m=(0.5, 0.5)), ("walking", "steps")),
}
PEOPLE = 4
SEED = 3611


@dataclass(frozen=True, eq=False)
class Plate:
    """A force plate in the lab (Z up).

    corners_m : (4, 3) in C3D's order: +x+y, -x+y, -x-y, +x-y of the plate, whose z points down.
    depth_m : of the sensor's origin under the surface.
    """

    corners_m: np.ndarray
    depth_m: float


@dataclass(frozen=True, eq=False)
class Trial:
    """What happened, in the lab (Z up), SI.

    time_s, markers_m : (n,), (n, markers, 3).
    analog_s, force_N, moment_Nm : (m,), (m, plates, 3) on the body, about the lab's origin.
    measured_share : of the time, in which every contact with the ground is on a plate.
    """

    name: str
    time_s: np.ndarray
    markers_m: np.ndarray
    analog_s: np.ndarray
    force_N: np.ndarray
    moment_Nm: np.ndarray
    measured_share: float

    @property
    def rate_hz(self) -> float:
        return float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))

    def sampled(self, marker_hz: float, analog_per_marker: int) -> Trial:
        """The same at other rates."""
        frames = int(np.floor(self.time_s[-1] * marker_hz + 1e-9)) + 1
        time = np.arange(frames) / marker_hz
        analog = np.arange(frames * analog_per_marker) / (marker_hz * analog_per_marker)
        return replace(
            self,
            time_s=time,
            markers_m=CubicSpline(self.time_s, self.markers_m)(time),
            analog_s=analog,
            force_N=_linear(self.analog_s, self.force_N, analog),
            moment_Nm=_linear(self.analog_s, self.moment_Nm, analog),
        )

    def with_forces(self, other: Trial, late_s: float, tared: bool) -> Trial:
        """Plates read what they read in another trial, or later, or from zero on as it begins."""
        analog = other.analog_s
        force = _linear(analog + late_s, other.force_N, analog)
        moment = _linear(analog + late_s, other.moment_Nm, analog)
        if tared:
            first = analog < 0.1
            force, moment = force - force[first].mean(axis=0), moment - moment[first].mean(axis=0)
        return replace(self, analog_s=analog, force_N=force, moment_Nm=moment)

    def seen_from(self, rotation: np.ndarray, shift_m: np.ndarray) -> Trial:
        """In another frame: new = rotation @ old + shift; mirrored where det is -1."""
        force = self.force_N @ rotation.T
        moment = np.linalg.det(rotation) * self.moment_Nm @ rotation.T
        return replace(
            self,
            markers_m=self.markers_m @ rotation.T + shift_m,
            force_N=force,
            moment_Nm=moment + np.cross(shift_m, force),
        )


@dataclass(frozen=True, eq=False)
class Session:
    """A person in a lab: the truth of one study."""

    laboratory: str
    sex: str
    mass_kg: float
    height_m: float
    labels: tuple[str, ...]
    plates: tuple[Plate, ...]
    trials: tuple[Trial, ...]

    def with_movement(self, movement: str) -> Session:
        """The static trial and one movement."""
        kept = tuple(t for t in self.trials if "static" in t.name or movement in t.name)
        return replace(self, trials=kept)

    def moved(self, yaw_rad: float, shift_m: np.ndarray) -> Session:
        """The same lab with its axes drawn elsewhere on the floor."""
        c, s = np.cos(yaw_rad), np.sin(yaw_rad)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        plates = tuple(
            replace(p, corners_m=p.corners_m @ rotation.T + shift_m) for p in self.plates
        )
        trials = tuple(t.seen_from(rotation, shift_m) for t in self.trials)
        return replace(self, plates=plates, trials=trials)

    def with_turned_plates(self, quarter_turns: tuple[int, ...]) -> Session:
        """Plates built in with another of their sides ahead: their own axes turn, rightly."""
        plates = tuple(
            replace(p, corners_m=np.roll(p.corners_m, k, axis=0))
            for p, k in zip(self.plates, quarter_turns, strict=True)
        )
        return replace(self, plates=plates)


def _linear(old_s: np.ndarray, values: np.ndarray, new_s: np.ndarray) -> np.ndarray:
    flat = values.reshape(len(values), -1)
    columns = [np.interp(new_s, old_s, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(len(new_s), *values.shape[1:])


@cache
def sound_session(laboratory: str, number: int) -> Session:
    """Person `number` in one laboratory; simulated once per process."""
    lab, movements = LABORATORIES[laboratory]
    options = StudyOptions(
        participants=PEOPLE,
        seed=SEED,
        tasks=("static", *movements),
        durations_s=DURATIONS_S,
        rates=RATES,
        richness=Richness(gaps=False),
        laboratory=lab,
        sexes="MFFM",
    )
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "truth").mkdir()
        person, records = simulate_participant(folder, options, number + 1)
        plates, trials, labels = [], [], ()
        for stem, record in records.items():
            content = ezc3d.c3d(str(folder / f"sub-{number + 1:02d}" / f"{stem}.c3d"))
            labels = tuple(content["parameters"]["POINT"]["LABELS"]["value"])
            corners = content["parameters"]["FORCE_PLATFORM"]["CORNERS"]["value"] / 1000.0
            plates = [Plate(corners[:, :, k].T, lab.plate_depth_m) for k in range(corners.shape[2])]
            measured = float(str(record["all_contacts_measured_share"]))
            trials.append(_trial(stem.split("_", 1)[1], content, plates, measured))
    return Session(
        laboratory,
        person.sex,
        float(person.mass_kg),
        float(person.stature_m),
        labels,
        tuple(plates),
        tuple(trials),
    )


def _trial(name: str, content: ezc3d.c3d, plates: list[Plate], measured_share: float) -> Trial:
    points = content["data"]["points"][:3].transpose(2, 1, 0) / 1000.0
    channels = content["data"]["analogs"][0].T
    parameters = content["parameters"]
    wrenches = [
        lab_wrench(plate, channels[:, 6 * k : 6 * k + 3], channels[:, 6 * k + 3 : 6 * k + 6] / 1000)
        for k, plate in enumerate(plates)
    ]
    return Trial(
        name=name,
        time_s=np.arange(len(points)) / parameters["POINT"]["RATE"]["value"][0],
        markers_m=points,
        analog_s=np.arange(len(channels)) / parameters["ANALOG"]["RATE"]["value"][0],
        force_N=np.stack([w[0] for w in wrenches], axis=1),
        moment_Nm=np.stack([w[1] for w in wrenches], axis=1),
        measured_share=measured_share,
    )


def plate_axes(corners_m: np.ndarray) -> np.ndarray:
    """(3, 3) columns: the plate's x, y, z in the lab, from corners in C3D's order."""
    x = corners_m[0] - corners_m[1]
    y = corners_m[0] - corners_m[3]
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    return axes / np.linalg.norm(axes, axis=0)


def lab_wrench(
    plate: Plate, force_N: np.ndarray, moment_Nm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Channels (n, 3) in the plate's axes about its sensor's origin, in the lab."""
    axes, centre = plate_axes(plate.corners_m), plate.corners_m.mean(axis=0)
    force = force_N @ axes.T
    top = moment_Nm - np.cross([0.0, 0.0, -plate.depth_m], force_N)
    return force, top @ axes.T + np.cross(centre, force)
