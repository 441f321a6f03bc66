"""One trial as the effects see it: motion, parameters, plates, and the wrench they predict."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pinocchio as pin
from scipy.ndimage import gaussian_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import (
    WrenchResponse,
    pinocchio_model,
    predicted_wrench,
    wrench_response,
)
from bsip_cli.dynamics.segment_motion import UP, Point, SegmentMotion, segment_motion
from bsip_cli.motion.inverse_kinematics import (
    PoseResponse,
    marker_trust,
    posed,
)

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

FINER = 4  # samples per frame of the wrench between frames
Made = TypeVar("Made")
SLOW_ENOUGH = 0.8  # of half the lower rate, when frames are left out
TRUST_S = 0.05  # standard deviation of what smooths the markers' trust


@dataclass(frozen=True, eq=False)
class Plate:
    """A force plate and what it measured.

    corners_m : (4, 3) in the world, in the file's order: x runs from the second to the first.
    wrench : (N, 6) on the body, about the world's origin; NaN where there is none.
    sensor_m : (3,) the point that its moments are about; the middle of its surface if unknown.
    zeroed : whether what it read without load in this trial has been taken off.
    silent : (N,) where the file has 0 in all six, as software writes it for a plate without load.
    is_placed : whether the file says where it lies; else its middle is where it bears on average.
    """

    name: str
    corners_m: np.ndarray
    wrench: np.ndarray
    sensor_m: np.ndarray | None = None
    zeroed: bool = False
    silent: np.ndarray | None = None
    is_placed: bool = True

    def centre_m(self) -> np.ndarray:
        """(3,) middle of the surface."""
        return self.corners_m.mean(axis=0)

    def moments_about_m(self) -> np.ndarray:
        """(3,) the point that its moments are about."""
        return self.centre_m() if self.sensor_m is None else self.sensor_m

    def axes(self) -> np.ndarray:
        """(3, 3) rows: the plate's own x, along the plate across it, and its normal upwards.

        The plate's own axes turned about x until z points up: in a file whose z points into the
        floor, y and z have the other sign.
        """
        first = self.corners_m[0] - self.corners_m[1]
        first = first / np.linalg.norm(first)
        normal = np.cross(first, self.corners_m[2] - self.corners_m[1])
        normal *= np.sign(normal[2]) / np.linalg.norm(normal)
        return np.stack([first, np.cross(normal, first), normal])


_OF_THE_MOTION = {
    *("rate_hz", "model", "predicted", "motion", "response", "trust", "pose_response"),
    *("markers_m", "model_markers_m", "centre_of_mass_m", "at_rest", "_kept"),
}


@dataclass(frozen=True, eq=False)
class Scene:
    """One trial: what was measured of the motion and the ground, and a body to simulate.

    times_s : (N,).
    q, v, a : (N, nq), (N, nv), (N, nv) in Pinocchio's conventions.
    phi : (10 n,) inertial parameters of the segments with mass, about their joint centres.
    valid : (N,) frames whose ground contacts are all measured.
    residual_m : (N, m, 3) markers less the model's, in the axes of their segments [m], NaN where
        missing; None if they are not known.
    robust_limit_m : residual beyond which a marker's pull on the pose fades.
    wrench : (N, 6) measured, all contacts together, about the world's origin; the plates' sum if
        not given.
    """

    times_s: np.ndarray
    person: Person
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    phi: np.ndarray
    plates: tuple[Plate, ...]
    valid: np.ndarray
    residual_m: np.ndarray | None = None
    robust_limit_m: float = np.inf
    wrench: np.ndarray | None = None

    @cached_property
    def rate_hz(self) -> float:
        return 1.0 / float(np.median(np.diff(self.times_s)))

    @property
    def span_s(self) -> tuple[float, float]:
        """Time of the first and the last frame."""
        return float(self.times_s[0]), float(self.times_s[-1])

    @property
    def mass_kg(self) -> float:
        return float(self.phi[::10].sum())

    def every(self, stride: int) -> Scene:
        """The same trial at a lower rate: every ``stride``-th frame."""
        if stride == 1:
            return self
        part = slice(None, None, stride)
        plates = tuple(
            replace(
                p,
                wrench=without_fast(p.wrench, stride)[part],
                silent=None if p.silent is None else p.silent[part],
            )
            for p in self.plates
        )
        wrench = None if self.wrench is None else without_fast(self.wrench, stride)[part]
        of_frames = ("times_s", "q", "v", "a", "valid", "residual_m")
        known = {name: getattr(self, name) for name in of_frames}
        fewer = {name: x[part] for name, x in known.items() if x is not None}
        return replace(self, plates=plates, wrench=wrench, **fewer)

    def reading(self, plates: tuple[Plate, ...], wrench: np.ndarray) -> Scene:
        """The same motion over other readings: nothing of the motion is computed again."""
        other, _ = replace(self, plates=plates, wrench=wrench), self._kept
        known = {name: x for name, x in vars(self).items() if name in _OF_THE_MOTION}
        vars(other).update(known)
        return other

    @cached_property
    def model(self) -> pin.Model:
        return pinocchio_model(self.person)

    @cached_property
    def predicted(self) -> np.ndarray:
        """(N, 6) simulated wrench about the world's origin [N, N m]."""
        return self.wrench_of(self.phi)

    def wrench_of(self, phi: np.ndarray) -> np.ndarray:
        """(N, 6) wrench of other parameters and the same motion."""
        motion = (self.model, self.q, self.v, self.a)
        return predicted_wrench(*motion, phi[:, None], np.zeros(3))[..., 0]

    @cached_property
    def measured(self) -> np.ndarray:
        """(N, 6) of all contacts together; 0 where there is no reading."""
        if self.wrench is not None:
            return np.nan_to_num(self.wrench)
        return np.nan_to_num(sum((plate.wrench for plate in self.plates), np.zeros((1, 6))))

    @cached_property
    def measured_signal(self) -> CubicSpline:
        """The measured wrench between the frames too.

        Fourier's interpolation first: a spline through few samples is quieter between them than on
        them, which would draw every delay away from whole frames. It takes the signal for a period:
        without the line from one end to the other, it would ring where they meet.
        """
        count = len(self.times_s)
        pad = min(count - 1, round(self.rate_hz))
        padded = np.pad(self.measured, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
        slope = (padded[-1] - padded[0]) / (len(padded) - 1)
        level = padded - np.arange(len(padded))[:, None] * slope
        from scipy.interpolate import CubicSpline  # heavy
        from scipy.signal import resample

        fine = resample(level, FINER * len(level), axis=0)
        fine += np.arange(len(fine))[:, None] * slope / FINER
        step = 1 / (FINER * self.rate_hz)
        times = self.times_s[0] + step * (np.arange(len(fine)) - FINER * pad)
        return CubicSpline(times, fine)

    @cached_property
    def motion(self) -> SegmentMotion:
        """Of every segment's joint centre."""
        return segment_motion(self.model, self.q, self.v, self.a)

    @cached_property
    def response(self) -> WrenchResponse:
        """To small errors of the motion."""
        return wrench_response(self.person, self.phi, self.q, self.v, self.a, self.rate_hz)

    @cached_property
    def trust(self) -> np.ndarray:
        """(N, m) part of its weight that the robust fit leaves each marker."""
        if self.residual_m is None:
            return np.ones((len(self.q), len(self.person.markers)))
        return marker_trust(self.residual_m, self.robust_limit_m)

    @cached_property
    def pose_response(self) -> PoseResponse:
        """Of the inverse kinematics to small errors of the markers.

        The trust is smoothed, lest a marker that comes and goes shake the answer.
        """
        trust = gaussian_filter1d(self.trust, TRUST_S * self.rate_hz, axis=0, mode="nearest")
        return PoseResponse(self.person, self.q, trust * self.person.marker_weights)

    @cached_property
    def markers_m(self) -> np.ndarray:
        """(N, m, 3) world positions: as measured where that is known, else the model's."""
        if self.residual_m is None:
            return self.model_markers_m
        turn = self.motion.rotation[:, self.person.marker_segments]
        apart = np.einsum("fmij,fmj->fmi", turn, self.residual_m)
        return self.model_markers_m + np.nan_to_num(apart)

    @cached_property
    def model_markers_m(self) -> np.ndarray:
        """(N, m, 3) where the pose puts the markers, world."""
        return posed(self.person, self.q).markers_m

    @cached_property
    def _kept(self) -> dict[Hashable, Any]:
        return {}

    @cached_property
    def _kept_of_readings(self) -> dict[Hashable, Any]:
        return {}

    def once(self, key: Hashable, make: Callable[[], Made], of_readings: bool = False) -> Made:
        """What ``make`` returns, computed when it is first asked for under this key: of the motion,
        the same over all readings, or ``of_readings``."""
        kept = self._kept_of_readings if of_readings else self._kept
        if key not in kept:
            kept[key] = make()
        return kept[key]

    @cached_property
    def centre_of_mass_m(self) -> np.ndarray:
        """(N, 3) of the whole body, world."""
        bodies = list(self.person.skeleton.bodies)
        R, p = self.motion.rotation[:, bodies], self.motion.position_m[:, bodies]
        masses, moments = self.phi[::10], self.phi.reshape(-1, 10)[:, 1:4]
        total = np.einsum("i,fix->fx", masses, p) + np.einsum("fixy,iy->fx", R, moments)
        return total / masses.sum()

    @cached_property
    def at_rest(self) -> np.ndarray:
        """(N, 6) wrench about the world's origin that each pose would need at rest [N, N m]."""
        weight = self.mass_kg * GRAVITY_M_S2 * UP
        centre = self.centre_of_mass_m
        return np.hstack([np.broadcast_to(weight, centre.shape), np.cross(centre, weight)])

    def centre(self, segment: str) -> Point:
        """The centre of mass of a segment."""
        mass, *moment = self.phi_of(segment)[:4]
        return self.motion.point(self.person.skeleton.index(segment), np.array(moment) / mass)

    def centre_of(self, segment: str) -> np.ndarray:
        """(3,) centre of mass of a segment from its origin [m]."""
        mass, *moment = self.phi_of(segment)[:4]
        origin = self.person.origin_in_joint_m[self.person.skeleton.index(segment)]
        return np.array(moment) / mass - origin

    def wrenches(self, segment: str) -> np.ndarray:
        """(N, 6, 10) ground wrench about the world's origin for each inertial parameter of a body
        fixed in a segment, about its joint centre."""
        i = self.person.skeleton.index(segment)
        return self.once(("wrenches", segment), lambda: self.motion.wrenches(i))

    def phi_of(self, segment: str) -> np.ndarray:
        """(10,) parameters of a segment about its joint centre; zeros without mass."""
        names = self.person.skeleton.body_names
        parameters = self.phi.reshape(-1, 10)
        return parameters[names.index(segment)] if segment in names else np.zeros(10)

    def length_of(self, segment: str) -> float:
        """Length that scales a segment's inertia [m]."""
        return float(self.person.lengths_m[self.person.skeleton.index(segment)])

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Segments that have a mass."""
        names = self.person.skeleton.body_names
        return tuple(s for s, m in zip(names, self.phi[::10], strict=True) if m > 0)

    def markers_beyond(self, segment: int) -> list[int]:
        """Numbers of the markers on a segment and on all that hang on it."""
        beyond = self.person.skeleton.beyond(segment)
        return [m for m, s in enumerate(self.person.marker_segments) if s in beyond]

    def mass_beyond(self, segment: int) -> tuple[float, Point]:
        """Mass [kg] of a segment and all that hang on it, and their common centre of mass."""
        names = [self.person.skeleton.segments[i] for i in self.person.skeleton.beyond(segment)]
        mass, total = 0.0, np.zeros((2, len(self.times_s), 3))
        for name in names:
            if (own := self.phi_of(name)[0]) > 0:
                point = self.centre(name)
                total += own * np.stack([point.position_m, point.acceleration_m_s2])
                mass += own
        return mass, Point(*(total / mass))


def without_fast(wrench: np.ndarray, stride: int) -> np.ndarray:
    """(N, 6) without what every ``stride``-th frame would show as something slower; NaN stays.

    Noise that turned up among the slow changes would make every shift in time seem smaller.
    """
    from scipy.signal import butter, sosfiltfilt  # heavy

    sections = butter(4, SLOW_ENOUGH / stride, output="sos")
    slow = sosfiltfilt(sections, np.nan_to_num(wrench), axis=0)
    return np.where(np.isnan(wrench), np.nan, slow)


def place_of_stance_m(scene: Scene) -> np.ndarray:
    """(3,) where the person stands on the ground: moments about it are small."""
    return scene.once("stance", lambda: np.append(scene.q[scene.valid, :2].mean(axis=0), 0.0))
