"""Regularities of a force on the body that no plate and no effect of the catalogue explains."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.diagnosis.pattern import Pattern
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.scene import Scene

_ALONG = {"x": "along the lab's X axis", "y": "along the lab's Y axis", "z": "up and down"}
_HANDS = ("hand_l", "hand_r")
_BEARINGS_APART = np.pi / 6


class Spring(Pattern):
    """A force on the pelvis that depends on where the pelvis is: a rope, a rail, an elastic."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{force} by {place}" for force in "xyz" for place in "xyz")

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("stiffness", "N/m", -1e4, 1e4, 50.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        force, place = ("xyz".index(letter) for letter in target.split(" by "))
        pelvis = scene.q[:, :3]
        push = np.zeros_like(pelvis)
        push[:, force] = values[0] * (pelvis[:, place] - pelvis[:, place].mean())
        return np.hstack([push, np.cross(pelvis, push)])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        force, place = target.split(" by ")
        size = f"{abs(values[0]):.0f} N per metre that the pelvis moves {_ALONG[place]}"
        if force == place:
            order = "back to its mean place" if values[0] > 0 else "away from its mean place"
            return f"a pull on the pelvis {order}, as of an elastic or a rope: {size}"
        return f"a force on the pelvis {_ALONG[force]}: {size}"


class Tether(Pattern):
    """A rope or an elastic from a fixed place far off to the pelvis, never slack.

    The force has one direction, and grows with the pelvis' way along it.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        bearings = tuple(float(angle) for angle in np.arange(0.0, np.pi, _BEARINGS_APART))
        return (
            Parameter("pull_at_origin", "N", -1e5, 1e5, 20.0),
            Parameter("stiffness", "N/m", 0.0, 1e4, 50.0),
            Parameter("bearing", "rad", -np.pi, 2.0 * np.pi, _BEARINGS_APART, bearings),
            Parameter("rise", "rad", -1.2, 1.2, 0.3, (0.0,)),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        pull, stiffness, bearing, rise = values
        flat = np.cos(rise)
        away = np.array([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(rise)])
        pelvis = scene.q[:, :3]
        push = np.outer(pull + stiffness * (pelvis @ away), away)
        return np.hstack([push, np.cross(pelvis, push)])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        _, stiffness, bearing, rise = values
        return (
            f"a pull on the pelvis, as of an elastic or a rope, {np.degrees(bearing):.0f} degrees "
            f"from the lab's X axis and {np.degrees(rise):.0f} degrees from level: "
            f"{stiffness:.0f} N more per metre"
        )


class Drag(Pattern):
    """A force on the pelvis against its velocity."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("x", "y", "z")

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("damping", "N s/m", -1e4, 1e4, 30.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        axis, pelvis = "xyz".index(target), scene.q[:, :3]
        push = np.zeros_like(pelvis)
        push[:, axis] = values[0] * np.gradient(pelvis[:, axis]) * scene.rate_hz
        return np.hstack([push, np.cross(pelvis, push)])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "against" if values[0] > 0 else "with"
        size = f"{abs(values[0]):.0f} N per m/s"
        return f"a force on the pelvis {order} its velocity {_ALONG[target]}: {size}"


class Band(Pattern):
    """A pull on a hand back to its mean place."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(s for s in scene.person.skeleton.segments if s in _HANDS)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("stiffness", "N/m", -1e4, 1e4, 20.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        place = scene.point(target, scene.centre_of(target)).position_m
        push = values[0] * (place - place.mean(axis=0))
        return np.hstack([push, np.cross(place, push)])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "back to" if values[0] > 0 else "away from"
        size = f"{abs(values[0]):.0f} N per metre"
        return f"a pull on the {in_words(target)} {order} its mean place, as of an elastic: {size}"
