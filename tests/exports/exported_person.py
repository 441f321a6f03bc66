"""A person with leaning hinges and uneven inertias, and the same person as our own model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.inertia import Inertia
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from tests.body.standing_person import random_poses, tilted_person

MADE_OF = ("bsip 0 export: participant sub-01, method OM", "made -- of <nothing> & more")


@cache
def identified_person(girdle: bool = False) -> IdentifiedPerson:
    """RM of the person with every centre of mass and tensor moved away from symmetry.

    girdle : with clavicles, which have no mass.
    """
    person, rng = tilted_person(girdle), np.random.default_rng(5)
    inertias = tuple(_uneven(each, rng) for each in regress(person, "M", 71.3).inertias)
    return IdentifiedPerson(person, inertias, "sub-01", "OM", MADE_OF)


def _uneven(inertia: Inertia, rng: np.random.Generator) -> Inertia:
    turn = pin.exp3(rng.normal(0, 0.3, 3))
    tensor = turn @ inertia.tensor_kgm2 @ turn.T
    return Inertia(inertia.mass_kg, inertia.com_m + rng.normal(0, 0.02, 3), tensor)


def our_model(body: IdentifiedPerson) -> pin.Model:
    """Pinocchio's model of the person with inertias, built without any export."""
    model = pinocchio_model(body.person)
    for i, inertia in zip(body.person.skeleton.bodies, body.inertias, strict=True):
        com = inertia.com_m + body.person.origin_in_joint_m[i]
        model.inertias[i + 1] = pin.Inertia(inertia.mass_kg, com, inertia.tensor_kgm2)
    return model


def poses(body: IdentifiedPerson, count: int = 5) -> np.ndarray:
    """(count, nq) random configurations of our model, turned by up to about a radian."""
    return random_poses(body.person, count, 0.6, seed=7)


@dataclass(frozen=True)
class Whole:
    """The whole body: centre of mass, inertia about it, momentum about it; world axes."""

    com_m: np.ndarray
    inertia_kgm2: np.ndarray
    momentum: np.ndarray


def whole_body(model: pin.Model, q: np.ndarray, v: np.ndarray) -> Whole:
    data = model.createData()
    pin.ccrba(model, data, q, v)
    return Whole(data.com[0].copy(), data.Ig.inertia.copy(), np.array(data.hg))


def configuration(body: IdentifiedPerson, placed: dict[str, pin.SE3]) -> np.ndarray:
    """(nq,) configuration of our model in which the segments' joint frames lie like this."""
    person = body.person
    skeleton, model = person.skeleton, pinocchio_model(person)
    q = pin.neutral(model)
    for i, segment in enumerate(skeleton.segments):
        start, kind = skeleton.q_starts[i], skeleton.joint_types[i]
        here = placed[segment]
        if kind == "free":
            q[start : start + 7] = pin.SE3ToXYZQUAT(here)
            continue
        above = placed[skeleton.segments[skeleton.parents[i]]]
        turn = model.jointPlacements[i + 1].rotation.T @ above.rotation.T @ here.rotation
        if kind == "spherical":
            q[start : start + 4] = pin.Quaternion(turn).coeffs()
        else:
            q[start] = pin.log3(turn) @ person.hinge_axes()[i]
    return q


def moving_body(body: IdentifiedPerson, placed_at: Callable[[float], dict[str, pin.SE3]]) -> Whole:
    """Of our model at time zero, whose joint frames lie like this at times near it [s]."""
    model, h_s = our_model(body), 1e-5
    before, here, after = (configuration(body, placed_at(t)) for t in (-h_s, 0.0, h_s))
    return whole_body(model, here, pin.difference(model, before, after) / (2 * h_s))


def joint_frames(model: pin.Model, q: np.ndarray) -> list[pin.SE3]:
    """World placement of every segment's joint frame."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    return [data.oMi[i + 1].copy() for i in range(model.njoints - 1)]
