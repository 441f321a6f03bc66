"""A club, racket, bat or stick in the hand, whose mass lies far from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.inertia import Inertia
from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.released_object import hands
from bsip_cli.effects.scene import Scene

# Second moment of a thin body along its axis about the hand, over mass times the square of its
# centre's distance: 1 if all of it is in the head, 4/3 of an even rod held at its end, 2 if it is
# held a quarter of its length from there.
LEAST_SHAPE, EVEN_ROD, MOST_SHAPE = 1.0, 4.0 / 3.0, 2.0
REACH_M = 1.0  # of the centre: a driver's is 0.8 m from the hands
ARMS_M = (0.5, 1.0)
ALIKE = 11  # shapes
# In every elevation as many directions as leave 30 degrees between them.
APART_RAD = np.pi / 6
ELEVATIONS_RAD = tuple(APART_RAD * k for k in (-2, -1, 0, 1, 2))


class Implement(Effect):
    """A thin body fixed in a hand, its axis through the hand's centre of mass.

    What it does to the plates goes with its first moment and with the second one over the first
    (``arm``); its mass, and so its centre, hardly show. Its direction in the hand's axes: azimuth
    in the plane of the palm, from the fingers' to the right, elevation out of it, at whose poles no
    grip holds anything. In both hands it moves with the mean of them, in the left one's axes.
    """

    name = "implement"
    of_the_lab = False
    of_the_person = True
    while_moving = True
    on_its_segment = True
    looks = "moments that go with the swing of the hands, far larger than their forces"
    remedy = "weigh what is held and find the point at which it balances; record once without it"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        one = hands(scene)
        return (*one, "+".join(one)) if _are_together(scene, one) else one

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        ahead = tuple(float(x) for x in np.arange(-np.pi, np.pi, APART_RAD))
        shortest = 0.5 * scene.length_of(_held_by(target)[0])
        shape = Parameter("shape", "1", LEAST_SHAPE, MOST_SHAPE, 0.2, (EVEN_ROD,), is_given=True)
        return (
            Parameter("moment", "kg m", 0.0, 10.0, 0.2),
            Parameter("arm", "m", shortest, REACH_M * MOST_SHAPE, 0.3, ARMS_M),
            Parameter("azimuth", "rad", -2 * np.pi, 2 * np.pi, 0.3, ahead),
            Parameter("elevation", "rad", -1.3, 1.3, 0.3, ELEVATIONS_RAD),
            shape,
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        for elevation in ELEVATIONS_RAD:
            count = int(np.ceil(2 * np.pi * np.cos(elevation) / APART_RAD - 1e-9))
            for k, arm in product(range(count), ARMS_M):
                yield arm, 2 * np.pi * k / count - np.pi, elevation, EVEN_ROD

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The shape is not sought: the plates do not tell it."""
        return super().spacing(scene, target, values) * [1.0, 1.0, 1.0, 0.0]

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return self.tangent(scene, target, values)[..., 0] * values[0]

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the moment."""
        centre, shape = centre_m(values), values[4]
        mass = 1 / float(np.linalg.norm(centre))
        about_centre = (shape - 1) * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        grips = scene.once((self.name, target), lambda: _grips(scene, _held_by(target)))
        each = [
            scene.wrenches(one.segment)
            @ Inertia(
                mass, one.place_m + one.turn @ centre, mass * one.turn @ about_centre @ one.turn.T
            ).phi()
            for one in grips
        ]
        return np.mean(each, axis=0)[..., None]

    def alike(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """Bodies of other shapes with the same moments, an even rod first if it is within reach: a
        tenth of a kilogram at the hand's centre is all they differ by."""
        least = max(LEAST_SHAPE, float(values[1]) / REACH_M)
        shapes = np.r_[max(EVEN_ROD, least), np.linspace(least, MOST_SHAPE, ALIKE)]
        return np.column_stack([np.tile(values[:4], (len(shapes), 1)), shapes])

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """Mass, its centre's distance from the hand's, inertia about an axis across it there, and
        the centre's place in the hand's axes."""
        moment, arm, distance = float(values[0]), float(values[1]), float(values[1] / values[4])
        places = zip("xyz", centre_m(values), strict=True)
        return (
            ("mass", "kg", moment / distance),
            ("centre", "m", distance),
            ("inertia", "kg m2", moment * arm),
            *((f"centre_{axis}", "m", float(x)) for axis, x in places),
        )

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        one, distance = _held_by(target), values[1] / values[4]
        holding = f"the {in_words(one[0])} holds" if len(one) == 1 else "both hands hold"
        return (
            f"{holding} {values[0] / distance:.2f} kg whose centre is {distance:.2f} m away, as of "
            "a club or racket"
        )


def centre_m(values: np.ndarray) -> np.ndarray:
    """(3,) from the hand's centre of mass, hand's axes: X is the palm's normal, Y to the arm."""
    _, arm, azimuth, elevation, shape = values
    flat = np.cos(elevation)
    return (
        arm / shape * np.array([np.sin(elevation), -flat * np.cos(azimuth), flat * np.sin(azimuth)])
    )


def _held_by(target: str) -> list[str]:
    """The hands of a target."""
    return target.split("+")


@dataclass(frozen=True, eq=False)
class _Grip:
    """Where a hand holds: from its joint's origin ``place_m`` (3,), its axes; ``turn`` (3, 3) to
    these from the axes in which the body's centre is given."""

    segment: int
    place_m: np.ndarray
    turn: np.ndarray


def _grips(scene: Scene, held_by: Sequence[str]) -> list[_Grip]:
    """Of one hand its centre of mass; of two the middle between these, and how the one is turned
    against the other, in the mean over what is measured."""
    numbers = [scene.person.skeleton.index(name) for name in held_by]
    paths = [scene.point(name, scene.centre_of(name)).position_m for name in held_by]
    middle = np.mean(paths, axis=0)
    first = scene.motion.rotation[:, numbers[0]]
    grips = []
    for i in numbers:
        own = scene.motion.rotation[:, i].swapaxes(1, 2)
        arm = middle - scene.motion.position_m[:, i]
        place = (own @ arm[..., None])[scene.valid, :, 0].mean(axis=0)
        turn = Rotation.from_matrix((own @ first)[scene.valid]).mean().as_matrix()
        grips.append(_Grip(i, place, turn))
    return grips


def _are_together(scene: Scene, held_by: Sequence[str]) -> bool:
    """Whether two hands could hold the same throughout: they are never further apart than long."""
    if len(held_by) != 2 or not scene.valid.any():
        return False
    one, other = (scene.point(name, scene.centre_of(name)).position_m for name in held_by)
    apart = np.linalg.norm(one - other, axis=1)[scene.valid]
    return bool(apart.max() < sum(scene.length_of(name) for name in held_by))
