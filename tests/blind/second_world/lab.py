"""A lab: plates and cameras with their usual errors, and what they record of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from tests.blind.second_world.balance import GRAVITY, Balanced, by_foot
from tests.blind.second_world.effects import Changes, Signals
from tests.blind.second_world.landmarks import MARKER_SETS
from tests.blind.second_world.skin import Skin
from tests.blind.second_world.smooth import about_z

# Plate axes in the lab as columns, in AMTI's manner: x to the left, y ahead, z down.
PLATE_AXES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_CORNERS = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
_SLOW_HZ, _SLOW_FORCE_N, _SLOW_MOMENT_NM = 0.8, 0.25, 0.04
_MAINS_HZ, _MAINS = 50.0, np.array([0.2, 0.15, 0.35, 0.03, 0.04, 0.02])
_GAPS_PER_15S, _LONG_GAPS = 0.35, 0.15


@dataclass(frozen=True)
class Plate:
    """centre_m (2,) on the ground; half_m (2,) of its size along its own x and y.

    origin_m (3,) : its sensors in its axes. zero_n, zero_nm, white_n (3,) : offsets and noise.
    misplaced_m (2,), misturned_rad : how far off the file's corners are. gain : of the vertical
    force. calibration (6, 6) : wrench per volt.
    """

    centre_m: np.ndarray
    half_m: np.ndarray
    origin_m: np.ndarray
    zero_n: np.ndarray
    zero_nm: np.ndarray
    white_n: np.ndarray
    misplaced_m: np.ndarray
    misturned_rad: float
    gain: float
    calibration: np.ndarray

    def in_words(self) -> str:
        """What it errs by with nothing hidden, as the causes' numbers are given."""
        x, y = self.misplaced_m
        place = f"x {x:.4f} m; y {y:.4f} m; yaw {np.degrees(self.misturned_rad):.2f} degrees"
        return f"{place}; gain {self.gain - 1:.4f}"

    @classmethod
    def drawn(
        cls, centre_m: tuple[float, float], half_m: tuple[float, float], rng: np.random.Generator
    ) -> Plate:
        draw = rng.uniform
        full_scale = np.diag([150.0, 150.0, 590.0, 60.0, 60.0, 30.0])
        return cls(
            centre_m=np.array(centre_m),
            half_m=np.array(half_m),
            origin_m=np.array([draw(-1e-3, 1e-3), draw(-1e-3, 1e-3), -draw(0.035, 0.055)]),
            zero_n=draw(-0.8, 0.8, 3),
            zero_nm=draw(-0.15, 0.15, 3),
            white_n=draw(0.5, 1.5, 3) * [0.6, 0.6, 1.0],
            misplaced_m=rng.normal(0.0, 0.001, 2),
            misturned_rad=np.radians(rng.normal(0.0, 0.1)),
            gain=1.0 + rng.normal(0.0, 0.002),
            calibration=full_scale @ (np.eye(6) + rng.normal(0.0, 0.01, (6, 6))),
        )


@dataclass(frozen=True)
class Recorded:
    """What a file holds, in SI units and the lab's frame, whose origin is no longer at the feet.

    markers_m : (n, 3) by label, NaN in gaps. wrenches : (N, 6) per plate, in its axes about its
    sensors, as they measure it: the ground's push on the person. corners_m : (4, 3) per plate, as
    the file states them.
    """

    rate_hz: int
    analog_hz: int
    markers_m: dict[str, np.ndarray]
    plates: tuple[Plate, ...]
    wrenches: tuple[np.ndarray, ...]
    corners_m: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Equipment:
    """plate_type : 2, 3 or 4, as C3D numbers them; two_plates : one for each foot."""

    marker_set: str
    rate_hz: int
    plate_type: int
    two_plates: bool


class Lab:
    """Equipment with its errors. delay_s : of the plates behind the cameras."""

    def __init__(self, equipment: Equipment, rng: np.random.Generator) -> None:
        self.labels, self.equipment = MARKER_SETS[equipment.marker_set], equipment
        self.rate_hz, self.analog_hz = equipment.rate_hz, 10 * equipment.rate_hz
        self.feet_m = np.array([rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0), 0.0])
        places = [((0.10, -0.262), (0.250, 0.300)), ((0.10, 0.262), (0.250, 0.300))]
        one = [((0.05, 0.0), (0.45, 0.45))]
        self.plates = tuple(Plate.drawn(*p, rng) for p in (places if equipment.two_plates else one))
        self.delay_s, self.noise_m = rng.uniform(0.0, 0.0008), rng.uniform(0.0002, 0.0006)

    def in_words(self) -> str:
        """What it errs by with nothing hidden."""
        plates = (f"plate {k}: {one.in_words()}" for k, one in enumerate(self.plates, start=1))
        return "; ".join([f"delay {self.delay_s:.4f} s", *plates])

    @property
    def fine_hz(self) -> float:
        """Rate that motions are simulated at."""
        return float(self.rate_hz * (5 if self.rate_hz <= 120 else 3))

    def record(
        self, found: Balanced, skin: Skin, changes: Changes, rng: np.random.Generator
    ) -> Recorded:
        """A motion as cameras and plates have it, with what is hidden in it."""
        stride = round(self.fine_hz / self.rate_hz)
        t = found.motion.t
        markers = skin.markers_m(found.poses, t, stride, rng, changes.moved)
        seen = {
            label: self._seen(course + self.feet_m, t[-1], rng) for label, course in markers.items()
        }
        count = len(t[::stride]) * round(self.analog_hz / self.rate_hz)
        times = np.arange(count) / self.analog_hz
        full_n = found.motion.body.mass_kg * GRAVITY[2] / len(self.plates)
        wrenches = []
        for number, (force, moment) in enumerate(self._on_plates(found)):
            plate = self.plates[number]
            late = times * (1.0 - changes.fast) - self.delay_s - changes.delay_s
            late = np.clip(late, 0.0, t[-1])
            wrench = at_sensors(plate, CubicSpline(t, np.hstack([force, moment]))(late))
            wrench[:, 2] *= plate.gain
            for channels in changes.channels:
                wrench = channels(Signals(wrench, times, number, full_n))
            mains = np.outer(np.sin(2.0 * np.pi * _MAINS_HZ * times + number), _MAINS)
            wrenches.append(wrench + self._noise(plate, len(times), rng) + mains)
        corners = tuple(self._stated_corners(plate, changes) for plate in self.plates)
        return Recorded(self.rate_hz, self.analog_hz, seen, self.plates, tuple(wrenches), corners)

    def _on_plates(self, found: Balanced) -> list[tuple[np.ndarray, np.ndarray]]:
        """Force and moment about the feet's middle, per plate."""
        if not self.equipment.two_plates:
            return [(found.force_n, found.moment_nm)]
        feet = by_foot(found)
        return [feet["r"], feet["l"]]

    def _seen(self, course: np.ndarray, length_s: float, rng: np.random.Generator) -> np.ndarray:
        """A marker's course with noise and gaps."""
        seen = course + rng.normal(0.0, self.noise_m, course.shape)
        for _ in range(rng.poisson(_GAPS_PER_15S * length_s / 15.0)):
            first = rng.integers(0, len(seen) - 5)
            longest_s = 0.35 if rng.random() < _LONG_GAPS else 0.12
            frames = max(int(rng.uniform(0.02, longest_s) * self.rate_hz), 1)
            seen[first : first + frames] = np.nan
        return seen

    def _noise(self, plate: Plate, count: int, rng: np.random.Generator) -> np.ndarray:
        """(N, 6): offset, white noise and slow noise."""
        sigma = self.analog_hz / (2.0 * np.pi * _SLOW_HZ)
        white = np.hstack([plate.white_n, 0.12 * plate.white_n]) * rng.normal(size=(count, 6))
        slow = gaussian_filter1d(rng.normal(size=(count, 6)), sigma, axis=0)
        slow *= np.sqrt(2.0 * np.sqrt(np.pi) * sigma)  # to an SD of 1
        slow *= np.repeat([_SLOW_FORCE_N, _SLOW_MOMENT_NM], 3)
        return np.hstack([plate.zero_n, plate.zero_nm]) + white + slow

    def _stated_corners(self, plate: Plate, changes: Changes) -> np.ndarray:
        axes = about_z(plate.misturned_rad + changes.yaw_rad)[0] @ PLATE_AXES
        centre = plate.centre_m + plate.misplaced_m + changes.shift_m
        corners = (_CORNERS * [*plate.half_m, 0.0]) @ axes.T
        return corners + np.append(centre, 0.0) + self.feet_m


def at_sensors(plate: Plate, wrench: np.ndarray) -> np.ndarray:
    """(N, 6) about the feet's middle in the lab's axes, to the sensors' origin in the plate's."""
    force, moment = wrench[:, :3], wrench[:, 3:]
    centre = np.append(plate.centre_m, 0.0)
    about_centre = (moment - np.cross(centre, force)) @ PLATE_AXES
    force = force @ PLATE_AXES
    # The file's origin runs from the sensors to the surface's centre: hence the sign.
    return np.hstack([force, about_centre + np.cross(plate.origin_m, force)])
