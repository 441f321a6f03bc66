"""Known masses that a person wears or carries, as inertial parameters of the segments."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import Inertia
from bsip_cli.body.person import Person


@dataclass(frozen=True, eq=False)
class PointMass:
    """A mass [kg] at ``position_m`` (3,) in the frame of a segment, from the segment's origin."""

    segment: str
    mass_kg: float
    position_m: np.ndarray


def load_parameters(loads: Iterable[PointMass], person: Person) -> np.ndarray:
    """(10 n,) parameters of all loads together about the joint centres (Pinocchio's order).

    The moment of inertia of a load about its own centre is neglected (1 kg of 10 cm has
    0.002 kg m2). Added to a person's parameters they are those of person and loads.
    """
    phi = np.zeros(10 * len(person.skeleton.segments))
    for load in loads:
        i = person.skeleton.index(load.segment)
        point = Inertia(load.mass_kg, load.position_m, np.zeros((3, 3)))
        phi[10 * i : 10 * i + 10] += point.moved(-person.origin_in_joint_m[i]).phi()
    return phi
