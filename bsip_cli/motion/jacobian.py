"""How the model's markers move with the pose."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion import kernel
from bsip_cli.motion.inverse_kinematics import Tree, tree_of


def model_markers(person: Person, R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """(N, m, 3) world positions of the markers for orientations and joint centres R, p."""
    segments = person.marker_segments
    return p[:, segments] + np.einsum("fmij,mj->fmi", R[:, segments], person.markers_in_joint_m())


def marker_residuals(person: Person, q: np.ndarray, markers: np.ndarray) -> np.ndarray:
    """(N, m, 3) markers less the model's, in the axes of their segments [m]; NaN where missing."""
    R, p = tree_of(person).forward(q)
    world = markers - model_markers(person, R, p)
    return np.einsum("fmij,fmi->fmj", R[:, person.marker_segments], world)


def subtrees(person: Person) -> np.ndarray:
    """(n, m) True where marker m hangs on segment n or beyond it."""
    parents = person.skeleton.parents
    on = np.zeros((len(parents), len(person.markers)), dtype=bool)
    on[person.marker_segments, np.arange(len(person.markers))] = True
    for i in range(len(parents) - 1, 0, -1):
        on[parents[i]] |= on[i]
    return on


def pose_columns(
    tree: Tree, R: np.ndarray, p: np.ndarray, model: np.ndarray, below: np.ndarray
) -> np.ndarray:
    """(N, m, 3, nv) velocity of each marker for each unit velocity."""
    columns = np.zeros((*model.shape, tree.nv))
    kernel.marker_columns(R, p, model, tree.arrays, below, columns)
    return columns


def coordinate_covariance(person: Person, q: np.ndarray, prior_rad: float) -> np.ndarray:
    """(N, nv, nv) covariance of the pose for marker errors of 1 m; q (N, nq).

    ``prior_rad`` is the posture prior's standard deviation over that of the markers.
    """
    tree = tree_of(person)
    R, p = tree.forward(q)
    columns = pose_columns(tree, R, p, model_markers(person, R, p), subtrees(person))
    columns *= np.sqrt(person.marker_weights)[:, None, None]
    flat = columns.reshape(len(q), -1, tree.nv)
    information = np.einsum("fki,fkj->fij", flat, flat, optimize=True)
    information[:, range(6, tree.nv), range(6, tree.nv)] += prior_rad**-2
    return np.linalg.inv(information)
