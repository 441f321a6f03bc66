"""Soft tissue that swings on its bone when the foot strikes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.errors import UsageError
from bsip_cli.simulate.calculus import derivative, response
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import SEGMENT_NAMES, body_of
from bsip_cli.simulate.inertia import Inertia
from bsip_cli.simulate.loads import GRAVITY
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.poses import Poses

HEAVY = ("thigh_l", "thigh_r", "upper_torso", "lower_torso")
MOST_OF_SEGMENT = 0.8


@dataclass(frozen=True)
class WobblingMass(Effect):
    """`size` kg of a segment hang on a spring and a damper, equal in all directions.

    They rest at the segment's centre of mass in quiet stance, so that mass and centre of
    mass stay the person's.
    """

    segment: str
    frequency_hz: float
    damping_ratio: float

    name = "wobbling_mass"
    unit = "kg"
    least, most = 0.0, 30.0
    targets = SEGMENT_NAMES + " (else a thigh or a part of the torso), frequency=HZ, damping=RATIO"
    settings = ("frequency", "damping")

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(HEAVY))
        frequency, damping = float(rng.uniform(3.5, 7.0)), float(rng.uniform(0.1, 0.3))
        frequency = target.get("frequency", frequency)
        damping = target.get("damping", damping)
        if segment not in SEGMENTS:
            raise cls.wrong_target(segment)
        if not 0.5 <= frequency <= 20.0 or not 0.01 <= damping <= 1.0:
            raise UsageError(
                f"a wobbling mass of {frequency:g} Hz with damping {damping:g}",
                expected="0.5 to 20 Hz and 0.01 to 1",
            )
        return cls(size, segment, frequency, damping)

    def body(self, person: Person) -> Person:
        """The bone keeps what does not wobble."""
        body = body_of(self.segment)
        part = person.inertias[body]
        if self.size > MOST_OF_SEGMENT * part.mass_kg:
            raise UsageError(
                f"{self.size:g} kg of {self.segment} cannot wobble",
                expected=f"at most {MOST_OF_SEGMENT * part.mass_kg:.1f} kg, 80 % of the segment",
            )
        rest = Inertia(part.mass_kg - self.size, part.com_m, part.tensor_kgm2)
        return replace(person, inertias={**person.inertias, body: rest})

    def plan(self, person: Person, plan: Plan) -> Plan:
        body = body_of(self.segment)
        com = person.inertias[body].com_m
        load = Swinging(body, self.size, com, self.frequency_hz, self.damping_ratio)
        return replace(plan, loads=(*plan.loads, load))

    def place(self) -> str:
        return self.segment

    def facts(self, person: Person) -> dict[str, Any]:
        position = person.inertias[body_of(self.segment)].com_m
        return {"position_m": position.tolist()}


@dataclass(frozen=True, eq=False)
class Swinging:
    """A point mass on a spring and a damper at a point of a body.

    Its displacement u against that point r obeys u'' + 2 z w u' + w^2 u = -r''.
    """

    body: str
    mass_kg: float
    position_m: np.ndarray
    frequency_hz: float
    damping_ratio: float

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """The force of spring and damper, which bears the mass' weight too."""
        r = poses.point(self.body, self.position_m)
        acceleration = derivative(derivative(r, step_s), step_s)
        w, z = 2.0 * np.pi * self.frequency_hz, self.damping_ratio
        denominator = [1.0, 2.0 * z * w, w * w]
        travel = response([-1.0], denominator, acceleration, step_s)
        own = response([2.0 * z * w, w * w], denominator, acceleration, step_s)
        force = self.mass_kg * (own - GRAVITY)
        return force, np.cross(r + travel, force)

    def thinned(self, samples: slice) -> Swinging:
        """Follows the poses it is given."""
        return self
