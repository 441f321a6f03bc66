"""Segments as pseudo-inertias, and the log-det divergence between them.

The 4x4 pseudo-inertia of a segment is J = [[S, m c], [m c^T, m]], S the second moments of mass
about the joint: a body can have these parameters exactly if J > 0 (Wensing, Kim and Slotine 2018).
All functions take the parameters (10 n,) of n segments in Pinocchio's order.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.body.inertia import second_moments


def _basis() -> np.ndarray:
    """(10, 4, 4) derivative of J with respect to the ten parameters."""
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for k in range(3):
        basis[1 + k, k, 3] = basis[1 + k, 3, k] = 1.0
    for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))):
        tensor = np.zeros((3, 3))
        tensor[i, j] = tensor[j, i] = 1.0
        basis[4 + k, :3, :3] = second_moments(tensor)
    return basis


BASIS = _basis()


def pseudo_inertias(phi: np.ndarray) -> np.ndarray:
    """(n, 4, 4) pseudo-inertias."""
    return np.einsum("nk,kij->nij", phi.reshape(-1, 10), BASIS)


def are_physical(phi: np.ndarray) -> bool:
    """Every segment is one that a body can have."""
    try:
        np.linalg.cholesky(pseudo_inertias(phi))
    except np.linalg.LinAlgError:
        return False
    return True


def divergences(phi: np.ndarray, table: np.ndarray) -> np.ndarray:
    """(n,) Bregman divergence of -log det: tr(J0^-1 J) - log det(J0^-1 J) - 4; inf if not J > 0."""
    if not are_physical(phi):
        return np.full(len(phi) // 10, np.inf)
    ratio = np.linalg.solve(pseudo_inertias(table), pseudo_inertias(phi))
    return np.einsum("nii->n", ratio) - np.linalg.slogdet(ratio)[1] - 4.0


def gradient(phi: np.ndarray, table: np.ndarray) -> np.ndarray:
    """(10 n,) of the sum of the divergences."""
    pull = np.linalg.inv(pseudo_inertias(table)) - np.linalg.inv(pseudo_inertias(phi))
    return np.einsum("nij,kji->nk", pull, BASIS).ravel()


def hessian(phi: np.ndarray) -> np.ndarray:
    """(10 n, 10 n) of the sum of the divergences, one block per segment, whatever the table."""
    turned = np.einsum("nij,kjl->nkil", np.linalg.inv(pseudo_inertias(phi)), BASIS)
    blocks = np.einsum("nkil,nmli->nkm", turned, turned)
    out = np.zeros((phi.size, phi.size))
    for i, block in enumerate(blocks):
        out[10 * i : 10 * i + 10, 10 * i : 10 * i + 10] = block
    return out
