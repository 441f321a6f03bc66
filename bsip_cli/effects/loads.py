"""What the person carries, and what holds or touches them off the plates."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.inertia import Inertia
from bsip_cli.dynamics.ground_wrench import skew
from bsip_cli.effects.body import moved_phi
from bsip_cli.effects.effect import (
    Effect,
    Parameter,
    Reported,
    along_xyz,
    parts_xyz,
    size_and_parts,
)
from bsip_cli.effects.scene import Scene

WINDOWS_S = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0)
MOST_WINDOWS = 30  # side by side; shorter ones are found in part of a window, and refined


# --- fixed to a segment ---------------------------------------------------------------------------

REACH_M = 0.6


class AddedMass(Effect):
    """A mass that the person wears or carries and the model does not know.

    A point mass fixed to a segment.

    Its position enters as first moment about the segment's centre of mass, segment axes, in which
    the wrench is linear but for the small inertia of the mass about that centre, left out here. A
    first moment without a mass within reach of the segment is no explanation.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        def wrenches() -> np.ndarray:
            """(N, 6, 4) for 1 kg at the segment's centre of mass, and for a unit of each moment."""
            mass, *moment = scene.phi_of(target)[:4]
            moments = scene.wrenches(target) @ moved_phi(np.array(moment) / mass)
            return np.concatenate([carried(scene, target)[..., None], moments], axis=2)

        return scene.once((self.name, target), wrenches) @ values

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """Mass and its position in the segment's axes, from the segment's origin.

        No mass counts as one at the segment's centre.
        """
        offset = values[1:] / values[0] if values[0] else np.zeros(3)
        place = scene.centre_of(target) + offset
        return (("mass", "kg", float(values[0])), *parts_xyz("position", "m", place))

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        within = super().possible(scene, target, values)
        return bool(within and np.linalg.norm(values[1:]) <= REACH_M * values[0])


def carried(scene: Scene, target: str) -> np.ndarray:
    """(N, 6) ground wrench of 1 kg at the segment's centre of mass."""
    return scene.once(("carried", target), lambda: scene.centre(target).carrying_wrench())


# --- held for a while -----------------------------------------------------------------------------

STEP_S = 0.5
# On either side of the release it is seen for a second, or for a part of what is measured, if less.
SEEN_S, SEEN_PART = 1.0, 0.25
KNOWN_TO_KG = 0.03  # the arm that is relieved springs back, faster than smoothed markers follow
HELD = Parameter("mass", "kg", 0.0, 20.0, 0.5, known_to=KNOWN_TO_KG)


class Held(Effect):
    """A point mass at the hand's centre for some of the time."""

    segments = ("hand",)
    on_its_segment = True
    remedy = "stand still with the object and again without"

    @abstractmethod
    def held(self, scene: Scene, times: np.ndarray) -> np.ndarray:
        """(N,) 1 while it is held, for the moments among the values; a ramp over one frame keeps
        the derivative with respect to a moment alive."""

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the mass."""
        return (self.held(scene, values[1:])[:, None] * carried(scene, target))[..., None]


class ReleasedObject(Held):
    """An object that the person holds at first and lets go."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = scene.span_s
        first, last = seen_between(scene)
        moments = np.linspace(first, last, int(np.ceil((last - first) / STEP_S)) + 1)
        return HELD, Parameter("release_time", "s", start, end, STEP_S, tuple(moments.tolist()))

    def held(self, scene: Scene, times: np.ndarray) -> np.ndarray:
        return np.clip((times[0] - scene.times_s) * scene.rate_hz + 0.5, 0.0, 1.0)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Seen with the object and without it."""
        first, last = seen_between(scene)
        return super().possible(scene, target, values) and first <= values[1] <= last


class ObjectHandled(Held):
    """An object that the person picks up and puts down again."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = scene.span_s
        between = tuple(np.linspace(start, end, 5)[1:4].tolist())
        return (
            HELD,
            Parameter("start", "s", start, end, STEP_S, between[:2]),
            Parameter("end", "s", start, end, STEP_S, between[1:]),
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        """Windows that overlap by half, in the part that is seen."""
        first, last = seen_between(scene)
        for length in WINDOWS_S:
            if length <= last - first and (last - first) / length <= MOST_WINDOWS:
                for at in np.arange(first, last - length + 1e-9, length / 2):
                    yield float(at), float(at) + length

    def held(self, scene: Scene, times: np.ndarray) -> np.ndarray:
        since, until = ((scene.times_s - t) * scene.rate_hz + 0.5 for t in times)
        return np.clip(since, 0.0, 1.0) - np.clip(until, 0.0, 1.0)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Seen before, with the object, and after it."""
        first, last = seen_between(scene)
        _, start, end = values
        seen = first <= start and start + WINDOWS_S[0] <= end <= last
        return seen and super().possible(scene, target, values)


def seen_between(scene: Scene) -> tuple[float, float]:
    """First and last moment of a release that is seen from both sides [s]."""
    times = scene.times_s[scene.valid]
    if not len(times):
        return scene.span_s
    seen = max(1, round(min(SEEN_S * scene.rate_hz, SEEN_PART * len(times))))
    return float(times[seen - 1]), float(times[-seen])


# --- a club, racket, bat or stick, whose mass lies far from the hand ------------------------------

# Second moment of a thin body along its axis about the hand, over mass times the square of its
# centre's distance: 1 if all of it is in the head, 4/3 of an even rod held at its end, 2 if it is
# held a quarter of its length from there.
LEAST_SHAPE, EVEN_ROD, MOST_SHAPE = 1.0, 4.0 / 3.0, 2.0
CENTRE_M = 1.0  # furthest: a driver's is 0.8 m from the hands
ARMS_M = (0.5, 1.0)
SHAPES = 11  # that look alike
# In every elevation as many directions as leave 30 degrees between them.
APART_RAD = np.pi / 6
ELEVATIONS_RAD = tuple(APART_RAD * k for k in (-2, -1, 0, 1, 2))


class Implement(Effect):
    """A club, racket, bat or stick in the hand, whose mass lies far from it.

    A thin body fixed in a hand, its axis through the hand's centre of mass.

    What it does to the plates goes with its first moment and with the second one over the first
    (``arm``); its mass, and so its centre, hardly show. Its direction in the hand's axes: azimuth
    in the plane of the palm, from the fingers' to the right, elevation out of it, at whose poles no
    grip holds anything. In both hands it moves with the mean of them, in the left one's axes.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Each hand; and two that could hold the same, never further apart than long."""
        one = super().targets(scene)
        if len(one) != 2 or not scene.valid.any():
            return one
        left, right = (scene.centre(name).position_m for name in one)
        apart = np.linalg.norm(left - right, axis=1)[scene.valid]
        together = apart.max() < sum(scene.length_of(name) for name in one)
        return (*one, "+".join(one)) if together else one

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        ahead = tuple(float(x) for x in np.arange(-np.pi, np.pi, APART_RAD))
        shortest = 0.5 * scene.length_of(target.split("+")[0])
        return (
            Parameter("moment", "kg m", 0.0, 10.0, 0.2),
            Parameter("arm", "m", shortest, CENTRE_M * MOST_SHAPE, 0.3, ARMS_M),
            Parameter("azimuth", "rad", -2 * np.pi, 2 * np.pi, 0.3, ahead),
            Parameter("elevation", "rad", -1.3, 1.3, 0.3, ELEVATIONS_RAD),
            Parameter("shape", "1", LEAST_SHAPE, MOST_SHAPE, 0.2, (EVEN_ROD,), is_given=True),
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        for elevation in ELEVATIONS_RAD:
            count = int(np.ceil(2 * np.pi * np.cos(elevation) / APART_RAD - 1e-9))
            for k, arm in product(range(count), ARMS_M):
                yield arm, 2 * np.pi * k / count - np.pi, elevation, EVEN_ROD

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The shape is not sought: the plates do not show it."""
        return super().spacing(scene, target, values) * [1.0, 1.0, 1.0, 0.0]

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the moment."""
        centre, shape = centre_m(values), values[4]
        mass = 1 / float(np.linalg.norm(centre))
        about_centre = (shape - 1) * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        grips = scene.once((self.name, target), lambda: _grips(scene, target.split("+")))
        each = []
        for segment, place_m, turn in grips:
            held = Inertia(mass, place_m + turn @ centre, mass * turn @ about_centre @ turn.T)
            each.append(scene.wrenches(segment) @ held.phi())
        return np.mean(each, axis=0)[..., None]

    def alike(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """Bodies of other shapes with the same moments, an even rod first if it is within reach: a
        tenth of a kilogram at the hand's centre is all they differ by."""
        least = max(LEAST_SHAPE, float(values[1]) / CENTRE_M)
        shapes = np.r_[max(EVEN_ROD, least), np.linspace(least, MOST_SHAPE, SHAPES)]
        return np.column_stack([np.tile(values[:4], (len(shapes), 1)), shapes])

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """Mass, its centre's distance from the hand's, inertia about an axis across it there, and
        the centre's place in the hand's axes."""
        moment, arm, distance = float(values[0]), float(values[1]), float(values[1] / values[4])
        sizes = (("mass", "kg", moment / distance), ("centre", "m", distance))
        parts = parts_xyz("centre", "m", centre_m(values))
        return *sizes, ("inertia", "kg m2", moment * arm), *parts

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        known = super().spoken(scene, target, values) | {"distance": values[1] / values[4]}
        if "+" in target:
            return known | {"holding": "both hands hold", "hands": "hands"}
        return known | {"holding": f"the {known['segment']} holds", "hands": "hand"}


def centre_m(values: np.ndarray) -> np.ndarray:
    """(3,) from the hand's centre of mass, hand's axes: X is the palm's normal, Y to the arm."""
    _, arm, azimuth, elevation, shape = values
    flat = np.cos(elevation)
    axis = np.array([np.sin(elevation), -flat * np.cos(azimuth), flat * np.sin(azimuth)])
    return arm / shape * axis


def _grips(scene: Scene, held_by: Sequence[str]) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Where hands hold: segment; place (3,) from its joint's origin, its axes; and the turn (3, 3)
    to these from the axes in which the body's centre is given.

    Of one hand its centre of mass; of two the middle between these, and how the one is turned
    against the other, in the mean over what is measured.
    """
    numbers = [scene.person.skeleton.index(name) for name in held_by]
    middle = np.mean([scene.centre(name).position_m for name in held_by], axis=0)
    first = scene.motion.rotation[:, numbers[0]]
    grips = []
    for name, i in zip(held_by, numbers, strict=True):
        own = scene.motion.rotation[:, i].swapaxes(1, 2)
        arm = middle - scene.motion.position_m[:, i]
        place = (own @ arm[..., None])[scene.valid, :, 0].mean(axis=0)
        turn = Rotation.from_matrix((own @ first)[scene.valid]).mean().as_matrix()
        grips.append((name, place, turn))
    return grips


# --- forces that no plate measures ----------------------------------------------------------------


def missing_wrenches(scene: Scene, target: str) -> np.ndarray:
    """(N, 6, 3) what the plates lack for a unit force on a segment's centre of mass."""

    def missing() -> np.ndarray:
        point = scene.centre(target).position_m
        forces = np.broadcast_to(np.eye(3), (len(point), 3, 3))
        return -np.concatenate([forces, skew(point)], axis=1)

    return scene.once(("missing wrenches", target), missing)


class ExternalForce(Effect):
    """A force on the body that no plate measures, the same throughout: a harness, a rail, a
    support.

    On a segment's centre of mass, world axes; the plates carry as much less.
    """

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the force."""
        return missing_wrenches(scene, target)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The force, and its parts along the lab's axes."""
        return size_and_parts("force", "N", values)


SHORTEST_S = 0.7
RAMP_S = 0.3  # in which a person leans on something, or lets go
EDGE_S = 0.07  # to which it is known when that begins and ends: nobody does it along a ramp
WINDOWS_ALIKE = 21  # that differ only where nothing is measured
STEADY_N = 1.0  # to which a mean force is known: nobody leans steadily


class UnmeasuredContact(Effect):
    """A contact that no plate measures: a hand on a rail, a chair, a foot beside the plate.

    A force on the segment's centre of mass during a window, in which it grows and fades; the plates
    carry as much less. The point where it truly acts is not estimated.
    """

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = scene.span_s
        whole = end - start
        fitting = [w for w in WINDOWS_S if w <= 0.8 * whole]
        longest = fitting[-1] if fitting else whole  # a short trial is one window
        lengths = tuple(w for w in fitting if whole / w <= MOST_WINDOWS) or (longest,)
        middles = tuple(float(t) for t in np.arange(start, end, min(lengths) / 2))
        at, of = EDGE_S / np.sqrt(2), EDGE_S * np.sqrt(2)
        return (
            *along_xyz("force", "N", 800.0, 40.0, STEADY_N),
            Parameter("middle", "s", start, end, 0.25, middles, known_to=at),
            Parameter("length", "s", min(0.2, whole), whole, 0.5, lengths, known_to=of),
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        """Windows that overlap by half."""
        *_, middle, length = self.parameters(scene, target)
        for seconds in length.scan:
            for at in np.arange(middle.least + seconds / 2, middle.most, seconds / 2):
                yield float(at), seconds

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The true window may be half as long again on either side."""
        return np.array([values[4] / 2, values[4]])

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the force."""
        middle, length = values[3], values[4]
        ramp = min(RAMP_S, length / 2)
        inside = length / 2 - np.abs(scene.times_s - middle)
        touching = np.clip(inside / ramp, 0.0, 1.0) / (1 - ramp / length)  # 1 on average
        return touching[:, None, None] * missing_wrenches(scene, target)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The window, and the mean force in it: its size and its parts along the lab's axes."""
        start, end = (float(x) for x in np.clip(_window(values), *scene.times_s[[0, -1]]))
        return ("start", "s", start), ("end", "s", end), *size_and_parts("force", "N", values)

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        """The whole window, also before and after the trial."""
        window = dict(zip(("start", "end"), _window(values), strict=True))
        return super().spoken(scene, target, values) | window

    def alike(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """A touch that is whole when the plates begin to measure may have begun long before; the
        plainest is that it began just then. So with its end."""
        start, end = _window(values)
        ramp = min(RAMP_S, values[4] / 2)
        plateau = values[:3] / (1 - ramp / values[4])
        starts = np.linspace(*_unseen(scene, start, ramp), WINDOWS_ALIKE)
        ends = -np.linspace(*_unseen(scene, -end, ramp, backwards=True), WINDOWS_ALIKE)
        lengths = ends - starts
        forces = plateau * (1 - np.minimum(RAMP_S / lengths, 0.5))[:, None]
        return np.column_stack([forces, (starts + ends) / 2, lengths])

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A touch that stays: at the edge of what is measured a step onto the plate looks alike."""
        touching = np.abs(scene.times_s - values[3]) <= values[4] / 2
        seconds = float((touching & scene.valid).sum()) / scene.rate_hz
        return super().possible(scene, target, values) and seconds >= SHORTEST_S


def _window(values: np.ndarray) -> tuple[float, float]:
    """Start and end."""
    return values[3] - values[4] / 2, values[3] + values[4] / 2


def _unseen(scene: Scene, edge: float, ramp: float, backwards: bool = False) -> tuple[float, float]:
    """Latest and earliest time at which a touch may have begun that is whole when it is seen.

    Both are the edge itself where the plates measure how it grows. Backwards in time for its end.
    """
    sign = -1 if backwards else 1
    times, valid = sign * scene.times_s[::sign], scene.valid[::sign]
    after, before = valid & (times >= edge), valid & (times < edge)
    first = float(times[after][0]) if after.any() else edge
    last = float(times[before][-1]) if before.any() else float(times[0])
    hidden = edge + ramp <= first
    return (first - ramp, min(last, first - ramp)) if hidden else (edge, edge)
