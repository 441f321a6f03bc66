"""A person who moves all joints on two plates that measure exactly what the model predicts."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.inertia import Inertia
from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.effects.scene import Plate, Scene
from tests.body.standing_person import Swing, standing

MASS_KG, RATE_HZ = 72.0, 100.0
# Corners as in a C3D file: x from the second to the first, y from the fourth to the first.
CORNERS = np.array([[0.3, 0.5, 0.0], [-0.3, 0.5, 0.0], [-0.3, -0.5, 0.0], [0.3, -0.5, 0.0]])

ASIDE = np.array([0.0, 0.55, 0.0])


def phi_of(person: Person, inertias: tuple[Inertia, ...]) -> np.ndarray:
    """(10 n,) parameters about the joint centres."""
    moved = zip(inertias, person.origin_in_joint_m, strict=True)
    return np.concatenate([inertia.moved(-origin).phi() for inertia, origin in moved])


@cache
def phi() -> np.ndarray:
    person = standing().person
    return phi_of(person, regress(person, "M", MASS_KG).inertias)


def unwritable(x: np.ndarray) -> np.ndarray:
    seen = x.view()
    seen.flags.writeable = False
    return seen


def scene_of(q: np.ndarray, v: np.ndarray, a: np.ndarray, **fields) -> Scene:
    """Plates share the load, 0.4 to 0.6. Arrays are read-only, as those of a file's table are."""
    times = np.arange(len(q)) / RATE_HZ
    q, v, a = (unwritable(x) for x in (q, v, a))
    bare = Scene(times, standing().person, q, v, a, phi(), (), np.ones(len(q), dtype=bool))
    plates = (
        Plate("1", CORNERS + ASIDE, unwritable(0.4 * bare.predicted)),
        Plate("2", CORNERS - ASIDE, unwritable(0.6 * bare.predicted)),
    )
    return replace(bare, plates=plates, **fields)


@cache
def moving(duration_s: float = 6.0, amplitude: float = 0.4) -> Scene:
    swing = Swing(pinocchio_model(standing().person), standing().q, 3, amplitude)
    return scene_of(*swing.sampled(duration_s, RATE_HZ)[1:])


@cache
def standing_still(duration_s: float = 2.0) -> Scene:
    count, nv = round(duration_s * RATE_HZ), len(standing().person.skeleton.v_names)
    still = np.zeros((count, nv))
    return scene_of(np.tile(standing().q, (count, 1)), still, still)


def derivatives(q: np.ndarray, person: Person | None = None) -> tuple[np.ndarray, np.ndarray]:
    """v, a (N, nv) of poses (N, nq), by differences on the manifold."""
    person = person or standing().person
    model, skeleton = pinocchio_model(person), person.skeleton
    q = q.copy()
    for start, kind in zip(skeleton.q_starts, skeleton.joint_types, strict=True):
        if kind != "revolute":
            part = slice(start + 3, start + 7) if kind == "free" else slice(start, start + 4)
            signs = np.sign(np.einsum("fi,fi->f", q[1:, part], q[:-1, part]))
            q[1:, part] *= np.cumprod(signs)[:, None]
    far = [pin.difference(model, q[k - 1], q[k + 1]) for k in range(1, len(q) - 1)]
    v = np.stack([far[0], *far, far[-1]]) * RATE_HZ / 2
    return v, np.gradient(v, 1 / RATE_HZ, axis=0)


def rms(x: np.ndarray, ends: int = 20) -> np.ndarray:
    """(6,) over frames, without the trial's ends."""
    return np.sqrt((x[ends:-ends] ** 2).mean(axis=0))
