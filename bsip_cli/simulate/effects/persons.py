"""A person who is not what landmarks, tables or the skeleton's joints say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.effects.base import JOINTS, Effect, Target, direction
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import Plan

# Joints that a model finds between (or beside) markers of the segment above them.
LANDMARKS = {"knee": ("KNEL", "KNEM"), "ankle": ("MALL", "MALM"), "elbow": ("ELB", "ELBM")}
LEAST_RANGE_RAD = 0.25  # a trial that bends the waist less bends the spine less too


@dataclass(frozen=True, eq=False)
class JointCentre(Effect, name="joint_centre"):
    """The true centre lies at shift_m from where its landmarks put it (parent segment's axes).

    Hips and shoulders move against the markers; knees, ankles, elbows stay and their
    landmarks are palpated wrongly by the opposite shift.
    """

    joint: str
    shift_m: np.ndarray

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        joint = target.name or str(rng.choice(JOINTS))
        if joint not in JOINTS:
            raise cls.wrong_target(joint)
        return cls(size, joint, size * direction(rng))

    def person(self, person: Person) -> Person:
        kind, side = self.joint[:-2], self.joint[-1]
        if kind not in LANDMARKS:
            joints = {**person.joints_m, self.joint: person.joints_m[self.joint] + self.shift_m}
            return replace(person, joints_m=joints)
        markers = dict(person.markers)
        for label in {side.upper() + name for name in LANDMARKS[kind]} & set(markers):
            marker = markers[label]
            markers[label] = replace(marker, position_m=marker.position_m - self.shift_m)
        return replace(person, markers=markers)

    def place(self) -> str:
        return self.joint


class MissingJoint(Effect, name="missing_joint"):
    """The spine bends at T12/L1 through `size` rad, and the waist by as much less.

    In all three axes the same part of the trunk's motion; in a trial that bends the trunk by
    less than LEAST_RANGE_RAD, in proportion.
    """

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        if target.name not in ("", "spine"):
            raise cls.wrong_target(target.name)
        return cls(size)

    def plan(self, person: Person, plan: Plan) -> Plan:
        waist = plan.angles_rad["waist"]
        flexion_range = float(np.ptp(waist[plan.keep, 0]))
        part = min(1.0, self.size / max(flexion_range, LEAST_RANGE_RAD))
        angles = {**plan.angles_rad, "waist": (1.0 - part) * waist, "spine": part * waist}
        notes = {**plan.notes, "missing_joint_range_rad": part * flexion_range}
        return replace(plan, angles_rad=angles, notes=notes)

    def place(self) -> str:
        return "spine"


@dataclass(frozen=True, eq=False)
class SegmentInertia(Effect, name="segment_inertia"):
    """A segment is heavier by the part `size` of its mass, and so are its second moments.

    The other segments are lighter in proportion: the person's mass stays. The centre of mass
    moves away from the segment's origin by half of `size`, the origin's distance being 1.
    """

    segment: str

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
        inertias = {}
        for body, part in person.inertias.items():
            scale = 1.0 + self.size if body in own else others
            along = 1.0 + 0.5 * self.size if body in own else 1.0
            com = part.com_m * np.array([1.0, along, 1.0])
            inertias[body] = Inertia(scale * part.mass_kg, com, scale * part.tensor_kgm2)
        return replace(person, inertias=inertias)

    def place(self) -> str:
        return self.segment
