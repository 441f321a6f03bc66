"""Simulate a trial, measure it as a motion-capture lab would, and write it as a C3D file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.instruments.readings import Instruments, SensingPlate
from bsip_cli.segments import without_side
from bsip_cli.simulate.balance import balanced, ground_wrench
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.moving import MOVEMENTS
from bsip_cli.simulate.numerics import rotate, runs, swung, transpose, unskew
from bsip_cli.simulate.options import Laboratory, Rates, Richness
from bsip_cli.simulate.people import SIDES, Marker, Person, Swing, tissue_of
from bsip_cli.simulate.plan import STEP_S, Plan, Poses

THIN = 4  # trials without flight are balanced at 250 Hz and interpolated
PUSH = 0.06  # of standing feet against each other, of the less loaded foot's vertical force
LOADED_N = 1.0


@dataclass(frozen=True)
class Contact:
    """One contact of one foot with the ground. Times on the recording's clock."""

    side: str
    start_s: float
    end_s: float
    on_plate: bool
    cop_m: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Trial:
    """A simulated trial at 1000 Hz, walkway frame (X ahead, Y up, Z right, origin on the ground).

    time_s : (T,) on the recording's clock.
    poses : of all bodies.
    force_n, moment_nm : (T, 3) total ground wrench on the body, moment about the origin.
    feet : the same by side; both feet sum to the total.
    on_plate : (T,) by side: whether the foot's contact (if any) is on the first plate.
    """

    time_s: np.ndarray
    poses: Poses
    force_n: np.ndarray
    moment_nm: np.ndarray
    feet: dict[str, tuple[np.ndarray, np.ndarray]]
    on_plate: dict[str, np.ndarray]
    contacts: tuple[Contact, ...]
    plan: Plan

    def all_contacts_measured(self) -> np.ndarray:
        """(T,) no foot on the ground beside the plate."""
        on_ground = {side: force.any(axis=1) for side, (force, _) in self.feet.items()}
        return ~np.any([on_ground[side] & ~self.on_plate[side] for side in SIDES], axis=0)

    def feet_apart(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """The feet's wrenches with what they push against each other, along the line between their
        centres of pressure, so that nobody but the plates feels it."""
        feet, centres = dict(self.feet), {}
        for side, (force, moment) in feet.items():  # on the floor; Y is up
            load = np.where(force[:, 1] > LOADED_N, force[:, 1], np.inf)
            ahead, aside = moment[:, 2] / load, -moment[:, 0] / load
            centres[side] = np.stack([ahead, np.zeros(len(load)), aside], axis=1)
        one, other = SIDES
        line = centres[other] - centres[one]
        line /= np.maximum(np.linalg.norm(line, axis=1), 1e-9)[:, None]
        load = np.minimum(feet[one][0][:, 1], feet[other][0][:, 1])
        push = PUSH * np.where(load > LOADED_N, load, 0.0)[:, None] * line
        for side, own in ((one, push), (other, -push)):
            force, moment = feet[side]
            feet[side] = (force + own, moment + np.cross(centres[side], own))
        return feet


def simulate_trial(
    person: Person,
    task: str,
    rng: np.random.Generator,
    duration_s: float | None = None,
    ball_mass_kg: float = 0.3,
    effects: Sequence[Effect] = (),
) -> Trial:
    """Draw a movement, hide effects in it, and make it physically possible."""
    movement, usual_s = MOVEMENTS[task]
    for effect in effects:
        person = effect.body(person)
    plan = movement(person, rng, usual_s if duration_s is None else duration_s, ball_mass_kg)
    for effect in effects:
        plan = effect.plan(person, plan)
    poses = balanced(person, plan, 1 if plan.flights else THIN)
    return trial_of(person, plan, poses)


def trial_of(person: Person, plan: Plan, poses: Poses) -> Trial:
    """Wrenches of a balanced movement, cut to what is recorded.

    Each foot has its share of the force, acting under that foot: its COP differs from its plan as
    the whole body's COP differs from its own plan, and the free moment is shared like the force.
    """
    keep = plan.keep
    wrench = ground_wrench(person.inertias, poses, plan.step_s, plan.all_loads())
    force, moment = (part[keep] for part in wrench)
    planned, feet, contacts = plan.cop_m()[keep], {}, []
    for side, foot in plan.feet.items():
        share, aside = foot.share[keep, None], foot.cop_m[keep] - planned
        lever = np.stack([aside[:, 0], np.zeros(len(aside)), aside[:, 1]], axis=1)
        feet[side] = share * force, share * moment + np.cross(lever, share * force)
        for part in runs(foot.share[keep] > 1e-9):  # the loaded intervals
            start, end = round(part.start * STEP_S, 3), round((part.stop - 1) * STEP_S, 3)
            ahead, across = foot.cop_m[keep][part].mean(axis=0).tolist()
            is_on = bool(foot.on_plate[keep][part].any())
            contacts.append(Contact(side, start, end, is_on, (ahead, across)))
    return Trial(
        time_s=np.arange(keep.stop - keep.start) * STEP_S,
        poses=poses.part(keep),
        force_n=force,
        moment_nm=moment,
        feet=feet,
        on_plate={side: foot.on_plate[keep] for side, foot in plan.feet.items()},
        contacts=tuple(sorted(contacts, key=lambda contact: (contact.start_s, contact.side))),
        plan=plan,
    )


# --- markers --------------------------------------------------------------------------------------


LAG_SMOOTHING_S = 0.02
DRIFT_SMOOTHING_S = 0.3
GAP_FRAMES = (5, 40)
GAPS_PER_TRIAL = 1.5  # beyond the first one
GAPS_PER_SECOND = 0.12
LONGEST_GAP_SHARE = 0.15  # of a trial
MOVED_BY_THE_ARM = {"RAC": "upper_arm_r", "LAC": "upper_arm_l", "RSCAP": "upper_arm_r"}


def rigid_paths(person: Person, poses: Poses) -> dict[str, np.ndarray]:
    """(T, 3) path of every marker if it were fixed to its bone."""
    markers = person.markers.items()
    return {label: poses.point(marker.body, marker.position_m) for label, marker in markers}


def marker_paths(
    person: Person, poses: Poses, rate_hz: float, richness: Richness, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """(T, 3) measured path of every marker; NaN where it is lost. Poses at the marker rate."""
    paths = rigid_paths(person, poses)
    for label, path in paths.items():
        marker = person.markers[label]
        if richness.soft_tissue:
            segment = "upper_torso" if marker.body == "thorax" else marker.body
            late = _late(marker, person.tissue.get(segment), path, rate_hz)
            # over its bone a marker travels as a smooth function of the nearby joints
            own, side = poses.rotation[marker.body], marker.body[-2:]
            tissue = tissue_of(without_side(marker.body))
            first, second = (tissue[end].replace("*", side) for end in ("proximal", "distal"))
            bodies = (first, MOVED_BY_THE_ARM.get(label, second))
            turns = [unskew(transpose(own) @ poses.rotation[body]) for body in bodies]
            sines = np.concatenate(turns, axis=1)
            travel = rotate(own, np.hstack([sines, sines**2]) @ marker.skin_gain_m.T)
            path = path + travel + late
        white = richness.marker_noise_m * rng.standard_normal(path.shape)
        width = DRIFT_SMOOTHING_S * rate_hz
        slow = gaussian_filter1d(rng.standard_normal(path.shape), width, axis=0, mode="reflect")
        # a Gaussian filter of width s leaves 1 / sqrt(2 s sqrt(pi)) of white noise's deviation
        gain = np.sqrt(2.0 * DRIFT_SMOOTHING_S * rate_hz * np.sqrt(np.pi))
        paths[label] = path + (white + richness.marker_drift_m * gain * slow)
    return _with_gaps(paths, rate_hz, rng) if richness.gaps else paths


def _late(marker: Marker, swing: Swing | None, path: np.ndarray, rate_hz: float) -> np.ndarray:
    """(T, 3) soft tissue stays behind when the bone accelerates, or shares a swing driven by it."""
    if swing is None and len(path) < 5:
        return np.zeros_like(path)
    acceleration = np.gradient(np.gradient(path, 1.0 / rate_hz, axis=0), 1.0 / rate_hz, axis=0)
    if swing is None:
        width = LAG_SMOOTHING_S * rate_hz
        return -marker.lag_s2 * gaussian_filter1d(acceleration, width, axis=0, mode="nearest")
    travel, _ = swung(swing.frequency_hz, swing.damping_ratio, acceleration, 1.0 / rate_hz)
    return marker.swing_share * travel


def _with_gaps(
    paths: dict[str, np.ndarray], rate_hz: float, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Lose a few markers for a short while each."""
    labels = sorted(paths)
    frames = len(paths[labels[0]])
    longest = min(GAP_FRAMES[1], int(LONGEST_GAP_SHARE * frames))
    if longest <= GAP_FRAMES[0]:
        return paths
    count = 1 + rng.poisson(GAPS_PER_TRIAL + GAPS_PER_SECOND * frames / rate_hz)
    for label in rng.choice(labels, size=min(count, len(labels)), replace=False):
        length = int(rng.integers(GAP_FRAMES[0], longest + 1))
        start = int(rng.integers(0, frames - length))
        paths[label][start : start + length] = np.nan
    return paths


SIMULATION_HZ = round(1.0 / STEP_S)
MM = 1000.0
PLATE_GAP_M = 0.005
CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
FULL_SCALE = np.array([2500.0, 2500.0, 5000.0, 1.5e6, 1.5e6, 0.8e6])  # N and N mm
ADC_STEPS = 2**15


@dataclass(frozen=True, eq=False)
class Pose:
    """From the walkway frame to the lab (Z up): lab = rotation @ walkway + offset_m."""

    rotation: np.ndarray
    offset_m: np.ndarray

    def points(self, points_m: np.ndarray) -> np.ndarray:
        """(..., 3) points in the lab."""
        return points_m @ self.rotation.T + self.offset_m

    def wrench(self, force: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment (T, 3) in the lab, the moment about the lab's origin."""
        turned = force @ self.rotation.T
        return turned, moment @ self.rotation.T + np.cross(self.offset_m, turned)


@dataclass(frozen=True, eq=False)
class Plate(SensingPlate):
    """A force plate in the lab: x ahead, y to the right, z down.

    origin_m : (3,) as in FORCE_PLATFORM:ORIGIN: from the transducers to the surface, z negative.
    """

    size_m: tuple[float, float]
    origin_m: np.ndarray

    def corners_m(self) -> np.ndarray:
        """(4, 3) in the order of the C3D format: +x+y, -x+y, -x-y, +x-y."""
        signs = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
        half = 0.5 * np.array([*self.size_m, 0.0])
        return self.centre_m + (signs * half) @ self.axes.T

    def distance_m(self, point_m: np.ndarray) -> float:
        """From a lab point to the surface's nearest edge, 0 on the plate."""
        local = self.axes.T @ (point_m - self.centre_m)
        beyond = np.abs(local[:2]) - 0.5 * np.array(self.size_m)
        return float(np.linalg.norm(np.maximum(beyond, 0.0)))


def walkway_pose(trial: Trial, laboratory: Laboratory, heading_error_rad: float) -> Pose:
    """Where the walkway lies so that the plan's plate centre meets the lab's first plate."""
    rotation = _walkway_axes(np.deg2rad(laboratory.facing_deg) + heading_error_rad)
    ahead, aside = trial.plan.plate_centre_m
    centre = np.array([*laboratory.plate_centre_m, 0.0])
    return Pose(rotation, centre - rotation @ np.array([ahead, 0.0, aside]))


def _walkway_axes(heading_rad: float) -> np.ndarray:
    """(3, 3) lab directions of the walkway's ahead, up and right."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([[c, 0.0, s], [s, 0.0, -c], [0.0, 1.0, 0.0]])


def plates_of(laboratory: Laboratory) -> list[Plate]:
    """The lab's plates: one after the other in the walking direction, or one for each foot."""
    ahead, up, right = _walkway_axes(np.deg2rad(laboratory.facing_deg)).T
    axes = np.stack([ahead, right, -up], axis=1)
    origin = np.array([0, 0, -laboratory.plate_depth_m])
    first = np.array([*laboratory.plate_centre_m, 0.0])
    length, width = laboratory.plate_size_m

    def plate(place: np.ndarray, size_m: tuple[float, float]) -> Plate:
        return Plate(axes, place, place - axes @ origin, size_m, origin)

    if laboratory.plate_per_foot:
        half = 0.5 * (width - PLATE_GAP_M)
        aside = 0.5 * (half + PLATE_GAP_M) * right
        return [plate(first + side * aside, (length, half)) for side in (-1, 1)]
    pitch = (length + PLATE_GAP_M) * ahead
    return [plate(first + k * pitch, (length, width)) for k in range(laboratory.plates)]


def plate_wrenches(
    trial: Trial, plates: list[Plate], pose: Pose, apart: bool = False
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Lab wrench (T, 3), (T, 3) on each plate; contacts on the floor are on none.

    apart : whether a plate feels one foot only, and so what the feet push against each other.
    """
    wrenches = [(np.zeros_like(trial.force_n), np.zeros_like(trial.force_n)) for _ in plates]
    feet = trial.feet_apart() if apart else trial.feet
    for contact in trial.contacts:
        ahead, aside = contact.cop_m
        place = pose.points(np.array([ahead, 0.0, aside]))
        distances = [plate.distance_m(place) for plate in plates]
        if contact.on_plate:
            index = int(np.argmin(distances))
        elif 0.0 in distances[1:]:  # a later step meets one by chance
            index = distances.index(0.0, 1)
        else:
            continue
        start, end = (round(s * SIMULATION_HZ) for s in (contact.start_s, contact.end_s))
        window = slice(start, end + 1)
        force, moment = pose.wrench(*(part[window] for part in feet[contact.side]))
        wrenches[index][0][window] += force
        wrenches[index][1][window] += moment
    return wrenches


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement(Instruments):
    """What the lab's instruments deliver for one trial, before it is written.

    channels : (samples, 6 per plate) N and N mm in each plate's frame, with noise, not yet
        quantised. pose : where the walkway lies in the lab (truth).
    """

    plates: tuple[Plate, ...]
    channels: np.ndarray
    pose: Pose


def measure_trial(
    trial: Trial,
    person: Person,
    rates: Rates,
    laboratory: Laboratory,
    richness: Richness,
    rng: np.random.Generator,
    heading_error_rad: float = 0.0,
    effects: Sequence[Effect] = (),
) -> Measurement:
    """Sample markers and plates of a trial, with soft tissue, noise, gaps and hidden effects."""
    pose = walkway_pose(trial, laboratory, heading_error_rad)
    plates = plates_of(laboratory)
    frames = len(trial.time_s) * rates.marker_hz // SIMULATION_HZ
    sampled = trial.poses.part(slice(0, None, SIMULATION_HZ // rates.marker_hz))
    paths = marker_paths(person, sampled, rates.marker_hz, richness, rng)
    samples = frames * rates.analog_hz // rates.marker_hz
    every = SIMULATION_HZ // rates.analog_hz
    wrenches = plate_wrenches(trial, plates, pose, laboratory.plate_per_foot)
    readings = [
        plate.reading(*wrench, np.zeros(3))[::every][:samples]
        for wrench, plate in zip(wrenches, plates, strict=True)
    ]
    delivered = Instruments(
        labels=tuple(paths),
        points_m=np.stack([pose.points(path[:frames]) for path in paths.values()], axis=1),
        marker_hz=rates.marker_hz,
        plates=tuple(plates),
        readings=np.stack(readings),
        analog_hz=rates.analog_hz,
        up=np.array([0.0, 0.0, 1.0]),
    )
    for effect in effects:
        delivered = effect.measured(delivered)
    noise = np.repeat([richness.force_noise_n, richness.moment_noise_nm], 3)
    unit = np.repeat([1.0, MM], 3)
    noisy = [unit * (r + noise * rng.standard_normal(r.shape)) for r in delivered.readings]
    return Measurement(**vars(delivered), channels=np.hstack(noisy), pose=pose)


def write_trial(
    path: Path, measurement: Measurement, quantised: bool = True, subject: str = "sub-01"
) -> None:
    """A measured trial as C3D: points in mm, plates of type 2 in N and N mm.

    quantised : whether channels are rounded to the steps of a 16-bit converter, and clipped.
    """
    c3d, plates, labels = ezc3d.c3d(), measurement.plates, [*measurement.labels]
    count, rates = len(plates), (float(measurement.marker_hz), float(measurement.analog_hz))
    names = [f"{name}{k + 1}" for k in range(count) for name in CHANNELS]
    parameters: dict[str, dict[str, Any]] = {
        "POINT": {"RATE": [rates[0]], "LABELS": labels, "DESCRIPTIONS": labels, "UNITS": ["mm"]},
        "ANALOG": {
            "RATE": [rates[1]],
            "LABELS": names,
            "DESCRIPTIONS": [f"Force plate {name[-1]}" for name in names],
            "UNITS": (["N"] * 3 + ["Nmm"] * 3) * count,
        },
        "FORCE_PLATFORM": {  # arrays of integers: of lists ezc3d makes floats
            "UNITS": ["N"],
            "USED": np.array([count]),
            "TYPE": np.full(count, 2),
            "ZERO": np.array([1, 0]),
            "CHANNEL": np.arange(1, 6 * count + 1).reshape(count, 6).T,
            "CORNERS": np.stack([MM * plate.corners_m().T for plate in plates], axis=-1),
            "ORIGIN": np.stack([MM * plate.origin_m for plate in plates], axis=-1),
        },
        "SUBJECTS": {"NAMES": [subject], "USES_PREFIXES": np.array([0])},
        "MANUFACTURER": {"COMPANY": ["simulation"], "SOFTWARE": ["bsip simulate"]},
    }
    for group, values in parameters.items():
        for name, value in values.items():
            if name not in c3d["parameters"].get(group, {}):
                c3d.add_parameter(group, name, value if isinstance(value, list) else [0.0])
            c3d["parameters"][group][name]["value"] = value
    frames, markers, _ = measurement.points_m.shape
    lost = np.isnan(measurement.points_m).any(axis=2).T
    homogeneous = np.ones((4, markers, frames))
    homogeneous[:3] = MM * measurement.points_m.transpose(2, 1, 0)
    data, channels = c3d["data"], measurement.channels
    data["points"] = homogeneous
    data["meta_points"]["residuals"] = np.where(lost, -1.0, 0.0)[None]
    data["meta_points"]["camera_masks"] = np.zeros((7, markers, frames), dtype=bool)
    if quantised:
        steps = np.tile(FULL_SCALE / ADC_STEPS, len(plates))
        channels = np.clip(np.round(channels / steps), -ADC_STEPS, ADC_STEPS - 1) * steps
    data["analogs"] = channels.T[None]
    c3d.write(str(path))
