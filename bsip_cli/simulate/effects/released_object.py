"""Something in the hand that is let go and lands beside the plate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.curves import step
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.carried import with_mass_at
from bsip_cli.simulate.effects.places import (
    SEGMENT_NAMES,
    body_of,
    recorded_length_s,
    recorded_times_s,
)
from bsip_cli.simulate.loads import Ball
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

IN_FRONT_M = 0.04
OPENING_S = 0.04


@dataclass(frozen=True)
class ReleasedObject(Effect):
    """A point mass of `size` kg that a segment carries until it is let go.

    release_share : when, as a part of each trial, unless release_s is given.
    """

    segment: str
    release_share: float
    release_s: float | None

    name = "released_object"
    unit = "kg"
    least, most = 0.0, 20.0
    targets = (
        SEGMENT_NAMES
        + " (else a hand); in measured data also markers LABEL+LABEL; "
        + ("release_s=TIME")
    )
    settings = ("release_s",)
    spares_static = True
    injectable = True
    needs_plates = True

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(["hand_l", "hand_r"]))
        share = float(rng.uniform(0.35, 0.65))
        return cls(size, segment, share, target.settings.get("release_s"))

    def check_simulated(self) -> None:
        if self.segment not in SEGMENTS:
            raise self.wrong_target(self.segment)

    def release_at_s(self, length_s: float) -> float:
        """When it is let go in a trial of this length."""
        return self.release_share * length_s if self.release_s is None else self.release_s

    def hold(self, times_s: np.ndarray, length_s: float) -> np.ndarray:
        """1 while held, 0 when gone, with an opening hand of OPENING_S between."""
        release = self.release_at_s(length_s)
        return 1.0 - step(times_s, release - 0.5 * OPENING_S, release + 0.5 * OPENING_S)

    def plan(self, person: Person, plan: Plan) -> Plan:
        length = recorded_length_s(plan)
        hold = self.hold(recorded_times_s(plan), length)
        load = Ball(
            body_of(self.segment),
            self.size,
            self.position_m(person),
            hold,
            self.release_at_s(length),
        )
        return replace(plan, loads=(*plan.loads, load))

    def position_m(self, person: Person) -> np.ndarray:
        """(3,) in the segment's frame."""
        com = person.segment_inertias()[self.segment].com_m
        return com + np.array([IN_FRONT_M, 0.0, 0.0])

    def injected(self, instruments: Instruments) -> Instruments:
        length = len(instruments.points_m) / instruments.marker_hz
        hold = self.hold(instruments.sample_times_s(), length)
        return with_mass_at(instruments, self.segment, self.size, hold)

    def place(self) -> str:
        return self.segment

    def facts(self, person: Person) -> dict[str, Any]:
        return {"position_m": self.position_m(person).tolist()}
