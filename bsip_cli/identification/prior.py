"""What is known of a person before the data: the table's values and how far people stray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import Inertia, readable_jacobian
from bsip_cli.body.person import Person


@dataclass(frozen=True)
class Spread:
    """Standard deviations of people about the table, as in configs/default.toml, [prior]."""

    mass_sd_percent: float
    com_sd_percent: float
    inertia_sd_percent: float
    total_mass_sd_percent: float


@dataclass(frozen=True, eq=False)
class Prior:
    """Mean and covariance of the inertial parameters before the data.

    Attributes
    ----------
    inertias : per segment, in the segment frame.
    origin_in_joint_m : (n, 3) segment origin seen from the joint; parallel frames.
    phi : (10 n,) mean, about the joint centres (Pinocchio's order).
    root : (10 n, 10 n) S with covariance S S^T.
    readable_sd : (n, 10) the same spread for mass, centre of mass and tensor.
    spread_sd : (n, 10) spread of each on its own, before the masses' sum is known to
        total_mass_sd_kg.
    fixed : (n,) segments that keep the table's values, as those do whose motion no markers show;
        the scale tells about the others.
    """

    inertias: tuple[Inertia, ...]
    origin_in_joint_m: np.ndarray
    phi: np.ndarray
    root: np.ndarray
    readable_sd: np.ndarray
    spread_sd: np.ndarray
    total_mass_sd_kg: float
    fixed: np.ndarray

    def fixed_parameters(self) -> np.ndarray:
        """(10 n,) which parameters keep the table's values."""
        return np.repeat(self.fixed, 10)


def prior_of(
    inertias: tuple[Inertia, ...],
    person: Person,
    spread: Spread,
    fixed: np.ndarray | None = None,
) -> Prior:
    """Build the prior: parameters spread independently, but the free masses sum to the scale's.

    fixed : (n,) segments that keep the table's values; by default those whose motion is unknown.
    """
    origins = person.origin_in_joint_m
    n = len(inertias)
    phi, root = np.empty(10 * n), np.zeros((10 * n, 10 * n))
    spread_sd = np.empty((n, 10))
    for i, inertia in enumerate(inertias):
        block = slice(10 * i, 10 * i + 10)
        phi[block] = inertia.moved(-origins[i]).phi()
        spread_sd[i] = _readable_sd(inertia, spread)
        root[block, block] = np.linalg.solve(readable_jacobian(phi[block]), np.diag(spread_sd[i]))
    total_mass_sd_kg = spread.total_mass_sd_percent / 100 * float(phi[::10].sum())
    fixed = person.without_data() if fixed is None else fixed
    root = _with_total_mass(root, total_mass_sd_kg, ~fixed)
    readable_sd = np.empty((n, 10))
    for i in range(n):
        block = slice(10 * i, 10 * i + 10)
        readable_sd[i] = np.linalg.norm(readable_jacobian(phi[block]) @ root[block], axis=1)
    return Prior(inertias, origins, phi, root, readable_sd, spread_sd, total_mass_sd_kg, fixed)


def likeliest(prior: Prior, information: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(P,) parameters of the largest posterior density, everything Gaussian.

    ``information`` (P, P) and ``right`` (P,) of the weighted normal equations.
    """
    scaled = prior.root.T @ information @ prior.root + np.eye(len(prior.phi))
    slope = prior.root.T @ (right - information @ prior.phi)
    return prior.phi + prior.root @ np.linalg.solve(scaled, slope)


def _with_total_mass(root: np.ndarray, sd_kg: float, free: np.ndarray) -> np.ndarray:
    """The root of the covariance once the sum of the free (n,) masses is known to ``sd_kg``."""
    total = root[::10][free].sum(axis=0)
    variance = total @ total
    shrink = 1.0 - sd_kg / np.sqrt(variance + sd_kg**2)
    return root - shrink * np.outer(root @ total, total) / variance


def _readable_sd(inertia: Inertia, spread: Spread) -> np.ndarray:
    """(10,) in the order of :meth:`Inertia.readable`."""
    moments = np.diag(inertia.tensor_kgm2)
    products = np.sqrt([moments[0] * moments[1], moments[0] * moments[2], moments[1] * moments[2]])
    part = spread.inertia_sd_percent / 100
    return np.array(
        [
            spread.mass_sd_percent / 100 * inertia.mass_kg,
            *[spread.com_sd_percent / 100 * _rod_length_m(inertia)] * 3,
            *(part * moments),
            *(0.5 * part * products),
        ]
    )


def _rod_length_m(inertia: Inertia) -> float:
    """Length of the rod whose mass lies as far from its centre, in the mean, as the segment's.

    Near to the length of a limb; the tables' lengths of pelvis and hand are a third and a half of
    what these segments measure.
    """
    return float(np.sqrt(6 * np.trace(inertia.tensor_kgm2) / inertia.mass_kg))
