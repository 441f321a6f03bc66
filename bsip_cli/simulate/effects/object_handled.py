"""Something that a hand picks up and puts down again, beside the plates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.curves import window
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import (
    SEGMENT_NAMES,
    body_of,
    recorded_length_s,
    recorded_times_s,
)
from bsip_cli.simulate.effects.released_object import IN_FRONT_M, OPENING_S
from bsip_cli.simulate.loads import Ball
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan


@dataclass(frozen=True)
class ObjectHandled(Effect):
    """A point mass of `size` kg that a segment carries for a part of each trial.

    window_share : start and end as parts of the trial.
    """

    segment: str
    window_share: tuple[float, float]

    name = "object_handled"
    unit = "kg"
    least, most = 0.0, 20.0
    targets = SEGMENT_NAMES + " (else a hand)"
    spares_static = True
    hint = "a person who carries something moves otherwise"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(["hand_l", "hand_r"]))
        if segment not in SEGMENTS:
            raise cls.wrong_target(segment)
        start = float(rng.uniform(0.2, 0.35))
        return cls(size, segment, (start, start + float(rng.uniform(0.25, 0.4))))

    def window_s(self, length_s: float) -> tuple[float, float]:
        """Start and end in a trial of this length."""
        start, end = (share * length_s for share in self.window_share)
        return start, end

    def plan(self, person: Person, plan: Plan) -> Plan:
        start, end = self.window_s(recorded_length_s(plan))
        hold = window(
            recorded_times_s(plan), start - 0.5 * OPENING_S, end + 0.5 * OPENING_S, OPENING_S
        )
        com = person.segment_inertias()[self.segment].com_m
        position = com + np.array([IN_FRONT_M, 0.0, 0.0])
        load = Ball(body_of(self.segment), self.size, position, hold, end)
        return replace(plan, loads=(*plan.loads, load))

    def place(self) -> str:
        return self.segment
