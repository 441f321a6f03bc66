"""Something heavy fixed to a segment: a bag, a vest, a cast, an instrument."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.carried import with_mass_at
from bsip_cli.simulate.effects.places import SEGMENT_NAMES, body_of
from bsip_cli.simulate.inertia import Inertia, combined
from bsip_cli.simulate.people import Person

RADIUS_M = 0.03  # a ball of this size
OFF_AXIS_M = 0.05
ALONG_M = 0.05


@dataclass(frozen=True, eq=False)
class AddedMass(Effect):
    """A small ball of `size` kg on a segment; the scale did not see it.

    offset_m : (3,) from the segment's centre of mass, segment axes.
    """

    segment: str
    offset_m: np.ndarray

    name = "added_mass"
    unit = "kg"
    least, most = 0.0, 60.0
    targets = SEGMENT_NAMES + " (else drawn); in measured data also markers LABEL+LABEL"
    injectable = True
    needs_plates = True

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(SEGMENTS))
        angle, along = rng.uniform(-np.pi, np.pi), rng.uniform(-ALONG_M, ALONG_M)
        aside = OFF_AXIS_M * np.array([np.cos(angle), 0.0, np.sin(angle)])
        return cls(size, segment, aside + np.array([0.0, along, 0.0]))

    def check_simulated(self) -> None:
        if self.segment not in SEGMENTS:
            raise self.wrong_target(self.segment)

    def position_m(self, person: Person) -> np.ndarray:
        """(3,) in the segment's frame."""
        return person.segment_inertias()[self.segment].com_m + self.offset_m

    def body(self, person: Person) -> Person:
        body = body_of(self.segment)
        ball = Inertia(
            self.size, self.position_m(person), 0.4 * self.size * RADIUS_M**2 * np.eye(3)
        )
        origin = np.zeros(3)
        heavier = combined([(person.inertias[body], origin), (ball, origin)])
        return replace(person, inertias={**person.inertias, body: heavier})

    def injected(self, instruments: Instruments) -> Instruments:
        return with_mass_at(instruments, self.segment, self.size)

    def place(self) -> str:
        return self.segment

    def facts(self, person: Person) -> dict[str, Any]:
        return {"position_m": self.position_m(person).tolist()}
