"""What acts on the body besides gravity and the ground: things it carries or leans on.

Walkway frame (Y up); moments about the walkway's origin.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bsip_cli.simulate.calculus import derivative
from bsip_cli.simulate.poses import Poses

GRAVITY = np.array([0.0, -9.81, 0.0])


class Load(Protocol):
    """Something that the body has to move, to hold, or may lean on."""

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Force (T, 3) that the body exerts on it, and that force's moment (T, 3)."""
        ...

    def thinned(self, samples: slice) -> Load:
        """The same load at some of the samples."""
        ...


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball, or any small object, in a hand; a point mass.

    position_m : (3,) in the body's frame.
    hold : (T,) 1 while held, falling smoothly to 0 at the release.
    release_s : when half the load has left the hand, on the recording's clock.
    """

    body: str
    mass_kg: float
    position_m: np.ndarray
    hold: np.ndarray
    release_s: float

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """The force that moves and holds it."""
        r = poses.point(self.body, self.position_m)
        acceleration = derivative(derivative(r, step_s), step_s)
        force = self.hold[:, None] * self.mass_kg * (acceleration - GRAVITY)
        return force, np.cross(r, force)

    def thinned(self, samples: slice) -> Ball:
        """The same ball at some of the samples."""
        return replace(self, hold=self.hold[samples])


def total_load(loads: Iterable[Load], poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Force (T, 3) and moment (T, 3) of the body on all its loads."""
    force = np.zeros_like(next(iter(poses.origin_m.values())))
    moment = np.zeros_like(force)
    for load in loads:
        one_force, one_moment = load.wrench(poses, step_s)
        force += one_force
        moment += one_moment
    return force, moment
