"""A trunk that bends where the model has no joint."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

LEAST_RANGE_RAD = 0.25  # a trial that bends the waist less bends the spine less too


@dataclass(frozen=True)
class MissingJoint(Effect):
    """The spine bends at T12/L1 through `size` rad, and the waist by as much less.

    In all three axes the same part of the trunk's motion; in a trial that bends the trunk by
    less than LEAST_RANGE_RAD, in proportion.
    """

    name = "missing_joint"
    unit = "rad"
    least, most = 0.0, 1.2
    targets = "spine (if none)"

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        if target.name not in ("", "spine"):
            raise cls.wrong_target(target.name)
        return cls(size)

    def plan(self, person: Person, plan: Plan) -> Plan:
        waist = plan.angles_rad["waist"]
        flexion = waist[plan.keep, 0]
        part = min(1.0, self.size / max(float(np.ptp(flexion)), LEAST_RANGE_RAD))
        angles = {**plan.angles_rad, "waist": (1.0 - part) * waist, "spine": part * waist}
        range_rad = part * float(np.ptp(flexion))
        notes = {**plan.notes, "missing_joint_range_rad": range_rad}
        return replace(plan, angles_rad=angles, notes=notes)

    def place(self) -> str:
        return "spine"
