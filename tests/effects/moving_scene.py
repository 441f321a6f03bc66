"""A person who moves all joints on two plates that measure exactly what the model predicts; and
where and how large effects are tried on them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Plate, Scene
from tests.body.standing_person import Swing, parameters_of, standing

MASS_KG, RATE_HZ = 72.0, 100.0
# Corners as in a C3D file: x from the second to the first, y from the fourth to the first.
CORNERS = np.array([[0.3, 0.5, 0.0], [-0.3, 0.5, 0.0], [-0.3, -0.5, 0.0], [0.3, -0.5, 0.0]])

ASIDE = np.array([0.0, 0.55, 0.0])


@cache
def phi() -> np.ndarray:
    person = standing().person
    return parameters_of(person, regress(person, "M", MASS_KG).inertias)


def phi_with(scene: Scene, segment: str, more: np.ndarray) -> np.ndarray:
    """(10 n,) the scene's parameters with (10,) more of one segment."""
    part, found = part_of(scene, segment), scene.phi.copy()
    found[part] += more
    return found


def part_of(scene: Scene, segment: str) -> slice:
    """Where a segment's parameters are."""
    k = 10 * scene.bodies.index(segment)
    return slice(k, k + 10)


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
    model, q = pinocchio_model(person), continuous(q, person)
    far = [pin.difference(model, q[k - 1], q[k + 1]) for k in range(1, len(q) - 1)]
    v = np.stack([far[0], *far, far[-1]]) * RATE_HZ / 2
    return v, np.gradient(v, 1 / RATE_HZ, axis=0)


def quaternions(person: Person) -> list[slice]:
    """Where they are in a pose."""
    offset = {"free": 3, "spherical": 0}
    starts = zip(person.skeleton.q_starts, person.skeleton.joint_types, strict=True)
    firsts = [start + offset[kind] for start, kind in starts if kind in offset]
    return [slice(first, first + 4) for first in firsts]


def continuous(q: np.ndarray, person: Person) -> np.ndarray:
    """The same poses (N, nq), no quaternion of another sign than that before it."""
    q = q.copy()
    for part in quaternions(person):
        signs = np.sign(np.einsum("fi,fi->f", q[1:, part], q[:-1, part]))
        q[1:, part] *= np.cumprod(signs)[:, None]
    return q


def rms(x: np.ndarray, ends: int = 20) -> np.ndarray:
    """(6,) over frames, without the trial's ends."""
    return np.sqrt((x[ends:-ends] ** 2).mean(axis=0))


def some(effect: Effect, scene: Scene) -> list[str]:
    """First, middle and last target."""
    targets = effect.targets(scene)
    assert targets
    return sorted({targets[0], targets[len(targets) // 2], targets[-1]})


def values_of(effect: Effect, scene: Scene, target: str, size: float) -> np.ndarray:
    """``size`` times typical, at the middle of what is scanned."""
    parameters = effect.parameters(scene, target)
    return np.array([p.scan[len(p.scan) // 2] if p.scan else size * p.typical for p in parameters])
