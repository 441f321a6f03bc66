"""A support that no plate measures: a hand on a rail, a back against a wall."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

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
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.poses import Poses

RAMP_S = 0.4
ASIDE = 0.15  # horizontal part of the support
UNSTEADINESS = 0.15
PACE_HZ = 0.6
CLEAR_OF_FLIGHT_S = 0.3


@dataclass(frozen=True, eq=False)
class Support:
    """An outside force on a point of the body.

    position_m : (3,) in the body's frame. force_n : (T, 3) on the body.
    """

    body: str
    position_m: np.ndarray
    force_n: np.ndarray

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """What the body exerts on the support."""
        r = poses.point(self.body, self.position_m)
        return -self.force_n, -np.cross(r, self.force_n)

    def thinned(self, samples: slice) -> Support:
        """The same support at some of the samples."""
        return replace(self, force_n=self.force_n[samples])


@dataclass(frozen=True)
class UnmeasuredContact(Effect):
    """A mostly upward force on a segment, of `size` N on average, during a window.

    window_share : start and end as parts of each trial, unless start_s and end_s are given.
    heading_rad : of the small horizontal part, from ahead. phase_rad : of its unsteadiness.
    Near a flight the person lets go.
    """

    segment: str
    window_share: tuple[float, float]
    start_s: float | None
    end_s: float | None
    heading_rad: float
    phase_rad: float

    name = "unmeasured_contact"
    unit = "N"
    least, most = 0.0, 500.0
    targets = SEGMENT_NAMES + " (else a hand), start_s=TIME, end_s=TIME"
    settings = ("start_s", "end_s")
    spares_static = True
    hint = "a person who leans on something moves otherwise"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        segment = target.name or str(rng.choice(["hand_l", "hand_r"]))
        if segment not in SEGMENTS:
            raise cls.wrong_target(segment)
        start = float(rng.uniform(0.15, 0.35))
        share = (start, start + float(rng.uniform(0.3, 0.45)))
        start_s, end_s = target.settings.get("start_s"), target.settings.get("end_s")
        heading, phase = rng.uniform(-np.pi, np.pi, 2).tolist()
        return cls(size, segment, share, start_s, end_s, heading, phase)

    def window_s(self, length_s: float) -> tuple[float, float]:
        """Start and end of the contact in a trial of this length."""
        start, end = (share * length_s for share in self.window_share)
        start = start if self.start_s is None else self.start_s
        return start, (end if self.end_s is None else self.end_s)

    def plan(self, person: Person, plan: Plan) -> Plan:
        times = recorded_times_s(plan)
        start, end = self.window_s(recorded_length_s(plan))
        strength = window(times, start, end, RAMP_S)
        strength *= 1.0 + UNSTEADINESS * np.sin(2 * np.pi * PACE_HZ * times + self.phase_rad)
        inside = (times >= start) & (times <= end)
        strength = strength / strength[inside].mean() if inside.any() else strength
        for first, last in plan.flights:
            a, b = times[first] - CLEAR_OF_FLIGHT_S, times[last] + CLEAR_OF_FLIGHT_S
            strength *= 1.0 - window(times, a, b, CLEAR_OF_FLIGHT_S)
        aside = ASIDE * np.array([np.cos(self.heading_rad), 0.0, np.sin(self.heading_rad)])
        force = self.size * strength[:, None] * (np.array([0.0, 1.0, 0.0]) + aside)
        support = Support(body_of(self.segment), self.position_m(person), force)
        return replace(plan, loads=(*plan.loads, support))

    def position_m(self, person: Person) -> np.ndarray:
        """(3,) in the segment's frame."""
        return person.segment_inertias()[self.segment].com_m

    def place(self) -> str:
        return self.segment

    def facts(self, person: Person) -> dict[str, Any]:
        return {"position_m": self.position_m(person).tolist()}
