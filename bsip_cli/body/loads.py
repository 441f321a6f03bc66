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
    """(10 n,) parameters of all loads together on the n segments with mass, about their joint
    centres (Pinocchio's order).

    The moment of inertia of a load about its own centre is neglected (1 kg of 10 cm has
    0.002 kg m2). Added to a person's parameters they are those of person and loads.
    """
    skeleton = person.skeleton
    phi = np.zeros((len(skeleton.bodies), 10))
    for load in loads:
        origin_m = person.origin_in_joint_m[skeleton.index(load.segment)]
        point = Inertia(load.mass_kg, load.position_m, np.zeros((3, 3)))
        phi[skeleton.body_names.index(load.segment)] += point.moved(-origin_m).phi()
    return phi.ravel()
