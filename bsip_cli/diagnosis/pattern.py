"""Regularities of no known cause: if one of them explains more than the catalogue does, then
something is wrong that has no name here.

Each is an effect like any other, so that they compete; what they go along with is said.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from bsip_cli.dynamics.regressor import move_moments
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.plates import CHANNELS
from bsip_cli.effects.scene import Scene, standing_place_m

UNEXPLAINED = "unexplained"


class Pattern(Effect):
    """A course that the residual may follow, linear in its size."""

    name = UNEXPLAINED
    of_the_lab = True
    remedy = "look at plates, cables and everything that touches the person, and record again"

    @abstractmethod
    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        """With what, and how large it is, for a sentence."""

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"something without a name goes along with {self.goes_along_with(target, values)}"


def in_channel(scene: Scene, channel: str, course: np.ndarray) -> np.ndarray:
    """(N, 6) a course (N,) in one component of the whole wrench, about where the person stands."""
    wrench = np.zeros((len(course), 6))
    wrench[:, CHANNELS.index(channel)] = course
    return move_moments(wrench, -standing_place_m(scene))


def course_of(scene: Scene, wrench: np.ndarray, channel: str) -> np.ndarray:
    """(N,) one component of a world wrench (N, 6) about the origin, moments about where the person
    stands."""
    return move_moments(wrench, standing_place_m(scene))[:, CHANNELS.index(channel)]
