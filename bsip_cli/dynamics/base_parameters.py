"""Base parameters: the combinations of inertial parameters that the ground wrench can show.

Found from the regressor at random states (Gautier 1991): going through the columns from the base
to the tips, a column that depends on those before it is regrouped into them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bsip_cli.body.inertia import PARAMETERS, UNITS
from bsip_cli.dynamics.ground_wrench import wrench_regressor

_STATES = 80
_TOLERANCE = 1e-9
_SEED = 20170629


@dataclass(frozen=True, eq=False)
class Basis:
    """phi_base = combine @ phi, and the wrench is regressor[:, independent] @ phi_base.

    independent : indices of the leading parameters; combine : (rank, 10 n).
    """

    independent: np.ndarray
    combine: np.ndarray

    @property
    def rank(self) -> int:
        return len(self.independent)


def find_basis(model: pin.Model, known: np.ndarray | None = None) -> Basis:
    """Basis of a model's inertial parameters, from its geometry alone.

    known : (10 n,) parameters that are known and so in no combination; None for none.
    """
    rng, neutral = np.random.default_rng(_SEED), pin.neutral(model)
    steps = rng.uniform(-1.5, 1.5, (_STATES, model.nv))
    q = np.stack([pin.integrate(model, neutral, step) for step in steps])
    v, a = rng.normal(0, 3, steps.shape), rng.normal(0, 20, steps.shape)
    stacked = np.concatenate(wrench_regressor(model, q, v, a, np.zeros(3)))
    if known is not None:
        stacked = stacked * ~known
    scale = np.linalg.norm(stacked, axis=0)
    scale[scale == 0] = 1.0
    triangle = np.asarray(np.linalg.qr(stacked / scale, mode="r"))
    directions = np.empty((len(triangle), 0))  # of the columns that stand on their own
    alone = np.zeros(len(scale), dtype=bool)
    for k, column in enumerate(triangle.T):
        rest = column - directions @ (directions.T @ column)
        rest -= directions @ (directions.T @ rest)
        size = np.linalg.norm(rest)
        alone[k] = size >= _TOLERANCE
        if alone[k]:
            directions = np.column_stack([directions, rest / size])
    independent, dependent = np.flatnonzero(alone), np.flatnonzero(~alone)
    beta = np.linalg.lstsq(triangle[:, independent], triangle[:, dependent], rcond=None)[0]
    beta *= scale[dependent] / scale[independent][:, None]
    beta[np.abs(beta) < 1e-8] = 0.0
    combine = np.zeros((len(independent), len(scale)))
    combine[np.arange(len(independent)), independent] = 1.0
    combine[:, dependent] = beta
    return Basis(independent, combine)


def expressions(basis: Basis, segments: tuple[str, ...]) -> list[tuple[str, str, str]]:
    """(name, expression in words, unit) of every base parameter."""
    names = [f"{parameter} {segment}" for segment in segments for parameter in PARAMETERS]
    named = []
    for row, leader in zip(basis.combine, basis.independent, strict=True):
        terms = [names[leader]]
        for k in np.flatnonzero(row):
            if k != leader:
                size = "" if np.isclose(abs(row[k]), 1.0) else f"{abs(row[k]):.4g} "
                terms.append(f"{'-' if row[k] < 0 else '+'} {size}{names[k]}")
        named.append((names[leader], " ".join(terms), UNITS[leader % 10]))
    return named
