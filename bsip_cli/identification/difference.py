"""What changed between two recordings of one person: a mass put on, a prosthesis, a diet.

Two identifications share the person's deviation x ~ N(0, P) from the table, so the difference of
their estimates is far better known than the sum of their variances says. Linearised, an estimate
is x_hat = R (x + change) + noise with the resolution R = 1 - C P^-1 (C its covariance) and noise
of covariance R C. The difference of a recording b from a recording a is therefore

    d = R_b change + (R_b - R_a) x + noise_a + noise_b,

- the change seen through R_b: what the wrench does not show of it is missing or lies in other
  segments (masses behind spherical joints);
- the person's own deviation where the two motions resolve it differently;
- the noise of both.

If the change is known to sit on certain segments only, both recordings together give their change
without this blur: ``change_of_segments``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.identification.problem import Estimate, Problem


@dataclass(frozen=True, eq=False)
class Difference:
    """phi (P,) of b minus a, its covariance (P, P) about ``resolution @ change`` for a true change
    (P,), and the resolution (P, P)."""

    phi: np.ndarray
    covariance: np.ndarray
    resolution: np.ndarray


@dataclass(frozen=True, eq=False)
class SegmentChange:
    """Change (10 k,) of k segments' parameters about their joints, and its covariance."""

    phi: np.ndarray
    covariance: np.ndarray


def difference(a: Estimate, b: Estimate, prior_covariance: np.ndarray) -> Difference:
    """Estimate b minus estimate a of the same person with the same estimator.

    ``prior_covariance`` (P, P) stands for estimators that do not weigh the prior themselves; of
    those that do, the mean of both is the person's.
    """
    priors = [
        prior_covariance if e.prior_covariance is None else e.prior_covariance for e in (a, b)
    ]
    (seen_a, noise_a), (seen_b, noise_b) = map(_resolved, (a, b), priors)
    unequal = seen_b - seen_a
    covariance = unequal @ (0.5 * (priors[0] + priors[1])) @ unequal.T + noise_a + noise_b
    return Difference(b.phi - a.phi, covariance, seen_b)


def change_of_segments(a: Problem, b: Problem, segments: Sequence[int]) -> SegmentChange:
    """The change of these segments that explains how b's wrench differs from a's; else the same.

    Generalised least squares for the person's deviation from the table (common to both, with the
    prior) and the ten parameters of each segment (free in b, zero in a); the former is
    marginalised. ``segments`` are indices, none the parent of another: what a joint connects
    shares its mass. Both problems need the same prior.
    """
    (information_a, right_a), (information_b, right_b) = (p.trusted_equations() for p in (a, b))
    right_a = right_a - information_a @ a.prior.phi  # of deviations from the table
    right_b = right_b - information_b @ b.prior.phi
    part = (10 * np.asarray(segments)[:, None] + np.arange(10)).ravel()
    root = a.prior.root
    inner = np.eye(root.shape[1]) + root.T @ (information_a + information_b) @ root
    common = root @ np.linalg.solve(inner, root.T)  # covariance of the common deviation
    seen = information_b[:, part]
    precision = information_b[np.ix_(part, part)] - seen.T @ common @ seen
    right = right_b[part] - seen.T @ common @ (right_a + right_b)
    scale = 1 / np.sqrt(np.diag(precision))  # kg and kg m2
    covariance = np.outer(scale, scale) * np.linalg.inv(np.outer(scale, scale) * precision)
    return SegmentChange(covariance @ right, covariance)


def _resolved(estimate: Estimate, prior_covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Resolution R = 1 - C P^-1 (P, P), and the noise's covariance R C, along the directions in
    which C is a part w of the prior; a w above 1 (C is linearised at another point) counts as 1.

    Of parameters that keep the table's values, which have no spread, nothing is resolved.
    """
    free = np.flatnonzero(np.diag(prior_covariance) > 0)
    among = np.ix_(free, free)
    prior, covariance = prior_covariance[among], estimate.covariance[among]
    scale = np.sqrt(np.diag(prior))  # kg and kg m2
    root = np.linalg.cholesky(prior / np.outer(scale, scale)) * scale[:, None]
    inverse = np.linalg.inv(root / scale[:, None]) / scale
    part, directions = np.linalg.eigh(inverse @ covariance @ inverse.T)
    part = np.clip(part, 0.0, 1.0)
    axes = root @ directions
    resolution, noise = np.zeros((2, *prior_covariance.shape))
    resolution[among] = (axes * (1 - part)) @ (directions.T @ inverse)
    noise[among] = (axes * (part * (1 - part))) @ axes.T
    return resolution, noise
