"""How well the motion excited the inertial parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.identification.estimator import Problem


@dataclass(frozen=True)
class Excitation:
    """singular_values (rank,) of the base regressor, each parameter in its prior spread and each
    component in its noise (below 1: the table knows better than the data); their ratio; and per
    segment (n,) the mean share that the data could decide of its ten parameters."""

    singular_values: np.ndarray
    condition_number: float
    segment_share: np.ndarray


def excitation(problem: Problem) -> Excitation:
    """Singular values, condition number and what the data could know of each segment."""
    information, _ = problem.equations.weighted(problem.noise.weights())
    root = problem.prior.root
    scaled = root.T @ information @ root
    strength = np.linalg.eigvalsh(scaled)[::-1][: problem.basis.rank]
    singular = np.sqrt(np.maximum(strength, 0.0))
    posterior = np.linalg.inv(scaled + np.eye(len(scaled)))
    share = 1.0 - np.diag(posterior).reshape(-1, 10).mean(axis=1)
    smallest = singular[-1]
    condition = float(singular[0] / smallest) if smallest > 0 else float("inf")
    return Excitation(singular, condition, share)
