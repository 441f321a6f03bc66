"""A segment of this person that is far from any table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import SEGMENT_NAMES
from bsip_cli.simulate.inertia import Inertia
from bsip_cli.simulate.people import Person


@dataclass(frozen=True)
class SegmentInertia(Effect):
    """A segment is heavier by the part `size` of its mass, and so are its second moments.

    The other segments are lighter in proportion: the person's mass stays. The centre of mass
    moves away from the segment's origin by half of `size`, the origin's distance being 1.
    """

    segment: str

    name = "segment_inertia"
    unit = "1"
    least, most = -0.6, 1.5
    targets = SEGMENT_NAMES + " (else drawn)"
    hint = "measured people have the segments they have"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(SEGMENTS))
        if segment not in SEGMENTS:
            raise cls.wrong_target(segment)
        return cls(size, segment)

    def person(self, person: Person) -> Person:
        own = ("abdomen", "thorax") if self.segment == "upper_torso" else (self.segment,)
        mass = sum(person.inertias[body].mass_kg for body in own)
        others = (person.mass_kg - (1.0 + self.size) * mass) / (person.mass_kg - mass)
        inertias = {
            body: _scaled(part, 1.0 + self.size, 1.0 + 0.5 * self.size)
            if body in own
            else _scaled(part, others, 1.0)
            for body, part in person.inertias.items()
        }
        return replace(person, inertias=inertias)

    def place(self) -> str:
        return self.segment


def _scaled(part: Inertia, mass: float, along: float) -> Inertia:
    """A body with its mass and tensor, and its centre of mass' place along Y, multiplied."""
    com = part.com_m * np.array([1.0, along, 1.0])
    return Inertia(mass * part.mass_kg, com, mass * part.tensor_kgm2)
