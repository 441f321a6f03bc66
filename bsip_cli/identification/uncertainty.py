"""From an estimate to what people read: values, standard deviations, and the data's share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import from_phi, readable_jacobian
from bsip_cli.identification.estimator import Estimate
from bsip_cli.identification.prior import Prior


@dataclass(frozen=True, eq=False)
class ReadableParameters:
    """Per segment (n, 10): mass, centre of mass and tensor about it in the segment frame.

    ``share`` is the part of the prior's variance that the data removed, 0 to 1.
    """

    values: np.ndarray
    sd: np.ndarray
    share: np.ndarray


def readable(estimate: Estimate, prior: Prior) -> ReadableParameters:
    """Linearised about the estimate for the sd, about the prior for the share."""
    n = len(prior.inertias)
    values, sd, share = (np.empty((n, 10)) for _ in range(3))
    for i in range(n):
        block = slice(10 * i, 10 * i + 10)
        phi = estimate.phi[block]
        covariance = estimate.covariance[block, block]
        values[i] = from_phi(phi).moved(prior.origin_in_joint_m[i]).readable()
        sd[i] = _sd(readable_jacobian(phi), covariance)
        at_table = readable_jacobian(prior.phi[block])
        before = prior.readable_sd[i]
        if estimate.prior_covariance is not None:
            before = _sd(at_table, estimate.prior_covariance[block, block])
        left = _sd(at_table, covariance) / before
        share[i] = np.clip(1.0 - left**2, 0.0, 1.0)
    return ReadableParameters(values, sd, share)


def root_of(covariance: np.ndarray) -> np.ndarray:
    """(P, P) S with covariance S S^T; what rounding has made negative counts as zero."""
    values, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0.0)))


def _sd(jacobian: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
