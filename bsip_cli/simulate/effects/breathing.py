"""Breath moves a part of the chest forward and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.simulate.calculus import derivative
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.places import recorded_times_s
from bsip_cli.simulate.loads import GRAVITY
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.poses import Poses
from bsip_cli.simulate.rotations import rotate

OUTWARD = np.array([0.8, 0.6, 0.0])  # of the chest: ahead and up, thorax axes


@dataclass(frozen=True)
class Breathing(Effect):
    """Moved mass times amplitude is `size`; it moves as a sine at the chest."""

    frequency_hz: float
    phase_rad: float

    name = "breathing"
    unit = "kg m"
    least, most = 0.0, 1.0
    targets = "frequency=HZ (else drawn near 0.25 Hz)"
    settings = ("frequency",)

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        frequency = target.get("frequency", float(rng.uniform(0.2, 0.32)))
        if not 0.05 <= frequency <= 2.0:
            raise UsageError(f"breathing at {frequency:g} Hz", expected="0.05 to 2 Hz")
        return cls(size, frequency, float(rng.uniform(-np.pi, np.pi)))

    def plan(self, person: Person, plan: Plan) -> Plan:
        wave = np.sin(2.0 * np.pi * self.frequency_hz * recorded_times_s(plan) + self.phase_rad)
        dipole = self.size * wave[:, None] * OUTWARD
        chest = ChestMotion("thorax", person.inertias["thorax"].com_m, dipole)
        return replace(plan, loads=(*plan.loads, chest))

    def place(self) -> str:
        return "upper_torso"


@dataclass(frozen=True, eq=False)
class ChestMotion:
    """Mass that leaves its place in a body: mass times displacement (T, 3), body axes."""

    body: str
    position_m: np.ndarray
    dipole_kgm: np.ndarray

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """What it takes more than the same mass at rest in the body, to first order."""
        r = poses.point(self.body, self.position_m)
        acceleration = derivative(derivative(r, step_s), step_s)
        dipole = rotate(poses.rotation[self.body], self.dipole_kgm)
        force = derivative(derivative(dipole, step_s), step_s)
        return force, np.cross(r, force) + np.cross(dipole, acceleration - GRAVITY)

    def thinned(self, samples: slice) -> ChestMotion:
        """The same motion at some of the samples."""
        return replace(self, dipole_kgm=self.dipole_kgm[samples])
