"""Estimator ``hansen2017``: what the data show by least squares, the rest nearest to RM.

Hansen 2017 solves the base parameters by least squares (eq. 7). How segments follow from them is
not in print; we take those nearest to the regression among all with these base parameters and
masses > 0, since 128 combinations do not make 150 parameters. Nearness is
measured in standard deviations of people about the table, and a combination that the data do not
know clearly better than the table stays at the table: the paper's motions are rich enough for all,
a clinic's trial is not. With everything excited this is the paper's method.
"""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from bsip_cli.errors import NumericalError
from bsip_cli.identification.problem import Estimate, Problem

_SMALLEST_MASS = 0.05  # of the table's


def estimate(problem: Problem) -> Estimate:
    """Least squares in the directions that the data know clearly better than the table.

    In coordinates z with phi = phi_RM + S z, where z is N(0, 1) among people, the data give each
    eigendirection of their information a variance; those below 1 are taken from the data.

    NumericalError: no parameters with positive masses satisfy the data.
    """
    prior = problem.prior
    information, right = problem.trusted_equations()
    scaled = prior.root.T @ information @ prior.root
    gradient = prior.root.T @ (right - information @ prior.phi)
    strength, directions = np.linalg.eigh(scaled)
    known = strength > 1.0
    shown = directions[:, known]
    target = (shown.T @ gradient) / strength[known]
    z = shown @ target
    note = f"{int(known.sum())} of {problem.basis.rank} combinations decided by the data"
    if np.any((prior.phi + prior.root @ z)[::10] < 0):
        room = prior.phi[::10] * (1 - _SMALLEST_MASS)
        z = smallest(shown.T, target, -prior.root[::10], room)
        note += "; masses kept positive"
    variance = np.where(known, 1.0 / np.where(known, strength, 1.0), 1.0)
    spread = prior.root @ directions
    return Estimate(prior.phi + prior.root @ z, (spread * variance) @ spread.T, note)


# --- the quadratic programme of estimators that keep masses positive ------------------------------


_SOLVED = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)


def smallest(
    equal: np.ndarray, targets: np.ndarray, below: np.ndarray, limits: np.ndarray
) -> np.ndarray:
    """(k,) vector x of the smallest square with ``equal x = targets`` and ``below x <= limits``.

    NumericalError: there is none.
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    size = equal.shape[1]
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.eye_array(size)),
        np.zeros(size),
        sparse.csc_matrix(np.vstack([equal, below])),
        np.concatenate([targets, limits]),
        [clarabel.ZeroConeT(len(targets)), clarabel.NonnegativeConeT(len(limits))],
        settings,
    ).solve()
    if solution.status not in _SOLVED:
        raise NumericalError(
            f"no inertial parameters with positive masses fit the data ({solution.status})",
            expected="a motion and forces that belong together",
            remedy="look at the residuals of the identification trial",
        )
    return np.array(solution.x)
