"""How well the motion excited the inertial parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from bsip_cli.identification.data_share import beforehand
from bsip_cli.identification.estimator import Problem

_BETTER_THAN_TABLE = 0.5  # part of the prior variance: below it the data know more than the table


@dataclass(frozen=True, eq=False)
class Excitation:
    """What the motion shows, each parameter in its prior spread, each component in its noise.

    singular_values : (rank,) of the base regressor; below 1 the table knows better than the data.
    condition_number : their ratio.
    segment_share : (n,) mean share of its ten parameters that the data could decide.
    combinations : (n,) of a segment's ten parameters, how many independent combinations the data
        know better than the table does. With none the segment was not excited.
    """

    singular_values: np.ndarray
    condition_number: float
    segment_share: np.ndarray
    combinations: np.ndarray


def excitation(problem: Problem) -> Excitation:
    """Singular values, condition number and what the data could know of each segment."""
    information, _ = problem.trusted_equations()
    root = problem.prior.root
    strength = np.linalg.eigvalsh(root.T @ information @ root)[::-1][: problem.basis.rank]
    singular = np.sqrt(np.maximum(strength, 0.0))
    smallest = singular[-1]
    condition = float(singular[0] / smallest) if smallest > 0 else float("inf")
    known = beforehand(problem)
    table, left = (_segments(known.covariance(x)) for x in (0 * information, information))
    share = 1.0 - np.einsum("nii->n", left) / 10
    parts = [eigh(*pair, eigvals_only=True) for pair in zip(left, table, strict=True)]
    combinations = (np.array(parts) < _BETTER_THAN_TABLE).sum(axis=1)
    return Excitation(singular, condition, share, combinations)


def _segments(covariance: np.ndarray) -> np.ndarray:
    """(n, 10, 10) of each segment's own parameters."""
    n = len(covariance) // 10
    return covariance.reshape(n, 10, n, 10)[np.arange(n), :, np.arange(n)]
