"""Estimator ``mass_factor`` (RM+mass): the table's body, all masses and tensors times one number.

What the plates say of the whole mass and no more. OM is compared with it and with RM: an error that
one number removes is no gain of identification.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.errors import NumericalError
from bsip_cli.identification.problem import Estimate, Problem
from bsip_cli.statistics.samples import Z95

_ROUNDS = 20  # of weights and number
_QUIETEST = 0.1  # of what OM leaves: no component counts as without error


def estimate(problem: Problem) -> Estimate:
    """Weighted least squares of the measured wrench on the table's, in closed form.

    Each component counts by the errors that the number itself leaves in it, of the independent
    samples: the table's centres of mass err in the moments by more than OM does. They are trusted
    as OM trusts them (``trust_ratio``). Single segments keep the table's spread, once the sum of
    their masses is known.

    NumericalError: the number is not above 0.
    """
    whole, phi, noise = problem.every_equation(), problem.prior.phi, problem.noise
    squares, products = np.einsum("i,cij,j->c", phi, whole.information, phi), whole.right @ phi
    rms = noise.rms
    for _ in range(_ROUNDS):
        weights = noise.effective / noise.samples / rms**2
        factor = float(weights @ products / (weights @ squares))
        rms = np.maximum(whole.residual_rms(factor * phi), _QUIETEST * noise.rms)
    if not factor > 0.0:
        raise NumericalError(
            f"the measured forces are {factor:.3g} times those of the table's masses",
            expected="a number above 0: forces that push the body up where it pushes down",
            remedy="look at the plates' signs in the quality table of ingest",
        )
    sd = problem.trust_ratio / float(np.sqrt(weights @ squares))
    before = factor * problem.prior.root
    total = before[::10].sum(axis=0)  # of the masses, whose sum is known
    root = before - np.outer(before @ total, total) / (total @ total)
    covariance = root @ root.T + sd**2 * np.outer(phi, phi)
    low, high = factor - Z95 * sd, factor + Z95 * sd
    note = (
        f"the table's masses (RM) times {factor:.4f} (95 % interval {low:.4f} to {high:.4f}), "
        f"{factor * float(phi[::10].sum()):.2f} kg in all"
    )
    return Estimate(factor * phi, covariance, note, before @ before.T)
