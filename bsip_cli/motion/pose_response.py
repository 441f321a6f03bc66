"""How the pose answers to small errors of the markers."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion.inverse_kinematics import tree_of
from bsip_cli.motion.jacobian import model_markers, pose_columns, subtrees

_BLOCK = 400
_PRIOR_M = 1e-3  # against the markers' metres: a joint without markers stays where it is


def pose_response(person: Person, q: np.ndarray, errors_m: np.ndarray) -> np.ndarray:
    """(N, nv, k) change of the pose, in the tangent space, for marker errors (N, m, 3, k) [m].

    The least-squares step of the inverse kinematics at q (N, nq).
    """
    tree, below = tree_of(person), subtrees(person)
    root = np.sqrt(person.marker_weights)[:, None, None]
    found = np.empty((len(q), tree.nv, errors_m.shape[-1]))
    for start in range(0, len(q), _BLOCK):
        part = slice(start, start + _BLOCK)
        R, p = tree.forward(q[part])
        columns = root * pose_columns(person, tree, R, p, model_markers(person, R, p), below)
        flat = columns.reshape(len(columns), -1, tree.nv)
        moved = (root * errors_m[part]).reshape(len(columns), flat.shape[1], -1)
        information = np.einsum("fki,fkj->fij", flat, flat, optimize=True)
        information[:, range(6, tree.nv), range(6, tree.nv)] += _PRIOR_M**2
        found[part] = np.linalg.solve(information, np.swapaxes(flat, 1, 2) @ moved)
    return found
