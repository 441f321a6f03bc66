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
    stacked = np.concatenate(random_regressor(model, _STATES))
    if known is not None:
        stacked = stacked * ~known
    scale = np.linalg.norm(stacked, axis=0)
    scale[scale == 0] = 1.0
    triangle = np.asarray(np.linalg.qr(stacked / scale, mode="r"))
    independent, dependent = _split(triangle)
    beta = np.linalg.lstsq(triangle[:, independent], triangle[:, dependent], rcond=None)[0]
    beta *= scale[dependent] / scale[independent][:, None]
    beta[np.abs(beta) < 1e-8] = 0.0
    combine = np.zeros((len(independent), len(scale)))
    combine[np.arange(len(independent)), independent] = 1.0
    combine[:, dependent] = beta
    return Basis(independent, combine)


def random_regressor(model: pin.Model, states: int) -> np.ndarray:
    """(states, 6, 10 n) regressor at random configurations, velocities and accelerations."""
    rng = np.random.default_rng(_SEED)
    q = np.stack(
        [
            pin.integrate(model, pin.neutral(model), rng.uniform(-1.5, 1.5, model.nv))
            for _ in range(states)
        ]
    )
    v, a = rng.normal(0, 3, (states, model.nv)), rng.normal(0, 20, (states, model.nv))
    return wrench_regressor(model, model.createData(), q, v, a, np.zeros(3))


def _split(triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns that stand on their own, and those that depend on earlier ones."""
    columns = triangle.shape[1]
    directions = np.empty((triangle.shape[0], 0))
    independent, dependent = [], []
    for k in range(columns):
        rest = triangle[:, k] - directions @ (directions.T @ triangle[:, k])
        rest -= directions @ (directions.T @ rest)
        size = np.linalg.norm(rest)
        if size < _TOLERANCE:
            dependent.append(k)
        else:
            independent.append(k)
            directions = np.column_stack([directions, rest / size])
    return np.array(independent), np.array(dependent)


def expressions(basis: Basis, segments: tuple[str, ...]) -> list[tuple[str, str, str]]:
    """(name, expression in words, unit) of every base parameter."""
    named = []
    for row, leader in zip(basis.combine, basis.independent, strict=True):
        terms = [
            _term(row[k], f"{PARAMETERS[k % 10]} {segments[k // 10]}")
            for k in np.flatnonzero(row)
            if k != leader
        ]
        name = f"{PARAMETERS[leader % 10]} {segments[leader // 10]}"
        named.append((name, " ".join([name, *terms]), UNITS[leader % 10]))
    return named


def _term(factor: float, name: str) -> str:
    sign = "-" if factor < 0 else "+"
    size = abs(factor)
    return f"{sign} {name}" if np.isclose(size, 1.0) else f"{sign} {size:.4g} {name}"
