"""The quadratic programme of the estimators that keep masses positive."""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from bsip_cli.errors import NumericalError

_SOLVED = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)


def smallest(
    equal: sparse.sparray | np.ndarray,
    targets: np.ndarray,
    below: sparse.sparray | np.ndarray,
    limits: np.ndarray,
) -> np.ndarray:
    """(k,) vector x of the smallest square with ``equal x = targets`` and ``below x <= limits``.

    Raises
    ------
    NumericalError
        There is none.
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    size = equal.shape[1]
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.eye_array(size)),
        np.zeros(size),
        sparse.csc_matrix(sparse.vstack([sparse.csc_array(equal), sparse.csc_array(below)])),
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
