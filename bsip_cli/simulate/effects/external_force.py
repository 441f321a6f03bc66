"""A harness, an unloading system, a rail: a force on the body through a whole trial."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import SEGMENT_NAMES, body_of
from bsip_cli.simulate.effects.unmeasured_contact import Support
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

MOST_ASIDE = 0.3  # horizontal part of the force


@dataclass(frozen=True, eq=False)
class ExternalForce(Effect):
    """`size` N on a segment's centre of mass, mostly upwards and always the same; not in trials
    with a flight, which would be another one.

    direction : (3,) unit vector, walkway axes (Y up).
    """

    segment: str
    direction: np.ndarray

    name = "external_force"
    unit = "N"
    least, most = 0.0, 500.0
    targets = SEGMENT_NAMES + " (else drawn)"
    spares_static = True
    hint = "a person who is held moves otherwise"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(SEGMENTS))
        if segment not in SEGMENTS:
            raise cls.wrong_target(segment)
        aside, heading = rng.uniform(0.0, MOST_ASIDE), rng.uniform(-np.pi, np.pi)
        up = np.sqrt(1 - aside**2)
        return cls(size, segment, np.array([aside * np.cos(heading), up, aside * np.sin(heading)]))

    def plan(self, person: Person, plan: Plan) -> Plan:
        if plan.flights:
            return plan
        force = np.tile(self.size * self.direction, (len(plan), 1))
        position = person.segment_inertias()[self.segment].com_m
        support = Support(body_of(self.segment), position, force)
        return replace(plan, loads=(*plan.loads, support))

    def place(self) -> str:
        return self.segment

    def facts(self, person: Person) -> dict[str, Any]:
        return {"upwards_n": float(self.size * self.direction[1])}
