"""A club, racket or stick that a hand holds through a whole trial."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import body_of
from bsip_cli.simulate.inertia import Inertia, combined
from bsip_cli.simulate.people import Person

HANDS = ("hand_l", "hand_r")
CENTRES_M = (0.3, 0.9)  # of a racket, of a driver
SPREADS = (0.3, 0.7)  # of the mass about its centre, over the centre's distance
LEAST_RADIUS_M = 0.01
MOST_TILT_RAD = 0.8


@dataclass(frozen=True, eq=False)
class Implement(Effect):
    """Two balls of `size` kg together on a line through the hand's centre of mass.

    centre_m : (3,) of both from there, hand's axes. spread_m : of each from their common centre.
    """

    hand: str
    centre_m: np.ndarray
    spread_m: float

    name = "implement"
    unit = "kg"
    least, most = 0.0, 10.0
    targets = "hand_l or hand_r (else drawn); distance=METRES of its centre from the hand's"
    settings = ("distance",)
    spares_static = True
    hint = "a person who swings something moves otherwise"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        hand = target.name or str(rng.choice(HANDS))
        if hand not in HANDS:
            raise cls.wrong_target(hand)
        distance = target.get("distance", float(rng.uniform(*CENTRES_M)))
        azimuth, out = rng.uniform(-np.pi, np.pi), rng.uniform(-MOST_TILT_RAD, MOST_TILT_RAD)
        flat = np.cos(out)
        axis = np.array([np.sin(out), flat * np.cos(azimuth), flat * np.sin(azimuth)])
        return cls(size, hand, distance * axis, distance * float(rng.uniform(*SPREADS)))

    def body(self, person: Person) -> Person:
        body = body_of(self.hand)
        distance = float(np.linalg.norm(self.centre_m))
        axis = self.centre_m / max(distance, LEAST_RADIUS_M)
        across = self.spread_m**2 * (np.eye(3) - np.outer(axis, axis))
        tensor = self.size * (across + LEAST_RADIUS_M**2 * np.eye(3))
        place = person.segment_inertias()[self.hand].com_m + self.centre_m
        held, origin = Inertia(self.size, place, tensor), np.zeros(3)
        heavier = combined([(person.inertias[body], origin), (held, origin)])
        return replace(person, inertias={**person.inertias, body: heavier})

    def place(self) -> str:
        return self.hand

    def facts(self, person: Person) -> dict[str, Any]:
        return {"distance_m": float(np.linalg.norm(self.centre_m))}
