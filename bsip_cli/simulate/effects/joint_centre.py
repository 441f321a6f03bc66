"""A joint that is not where landmarks say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.simulate.effects.base import Effect, Target, direction
from bsip_cli.simulate.people import Person

JOINTS = tuple(
    f"{joint}_{side}" for joint in ("hip", "shoulder", "knee", "ankle", "elbow") for side in "lr"
)
# Joints that a model finds between (or beside) markers of the segment above them.
LANDMARKS = {
    "knee": ("KNEL", "KNEM"),
    "ankle": ("MALL", "MALM"),
    "elbow": ("ELB", "ELBM"),
}


@dataclass(frozen=True, eq=False)
class JointCentre(Effect):
    """The true centre lies at shift_m from where its landmarks put it (parent segment's axes).

    Hips and shoulders move against the markers; knees, ankles, elbows stay and their
    landmarks are palpated wrongly by the opposite shift.
    """

    joint: str
    shift_m: np.ndarray

    name = "joint_centre"
    unit = "m"
    least, most = 0.0, 0.08
    targets = "a joint: " + ", ".join(JOINTS) + " (else drawn)"
    hint = "markers do not tell what a joint would have been elsewhere"

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
