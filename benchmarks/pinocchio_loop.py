"""Gauss-Newton inverse kinematics as a Python loop over Pinocchio's calls."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.inverse_kinematics import subtrees

_STEPS = 20


def solve(person: Person, markers_m: np.ndarray, q_first: np.ndarray) -> np.ndarray:
    """(N, nq) least-squares poses, each started from the last.

    One call per step fills Pinocchio's Jacobian of all joints; the markers' columns follow from
    it by whole-array numpy. It stops at the kernel's criterion: a gain of 1e-9 of the cost.
    """
    model = pinocchio_model(person)
    data = model.createData()
    joints = [int(j) + 1 for j in person.marker_segments]
    local = person.markers_in_joint_m()
    moves = _moves(person)
    out = np.empty((len(markers_m), model.nq))
    q = q_first
    for frame, measured in enumerate(markers_m):
        cost = np.inf
        for _ in range(_STEPS):
            pin.computeJointJacobians(model, data, q)
            placements = [data.oMi[j] for j in range(model.njoints)]
            R = np.array([placement.rotation for placement in placements])[joints]
            p = np.array([placement.translation for placement in placements])[joints]
            places = p + np.einsum("mij,mj->mi", R, local)
            apart = measured - places
            before, cost = cost, 0.5 * float((apart**2).sum())
            if before - cost <= 1e-9 * cost:
                break
            J = data.J
            columns = (J[:3].T[None] + np.cross(J[3:].T[None], places[:, None])) * moves
            flat = np.swapaxes(columns, 1, 2).reshape(-1, model.nv)
            normal = flat.T @ flat
            normal[np.diag_indices_from(normal)] += 1e-12
            q = pin.integrate(model, q, np.linalg.solve(normal, flat.T @ apart.ravel()))
        out[frame] = q
    return out


def _moves(person: Person) -> np.ndarray:
    """(m, nv, 1) 1 where a velocity moves a marker."""
    sizes = {"free": 6, "spherical": 3, "revolute": 1}
    counts = [sizes[kind] for kind in person.skeleton.joint_types]
    return np.repeat(subtrees(person), counts, axis=0).T[..., None].astype(float)
