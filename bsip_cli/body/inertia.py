"""Conversions between the ways to write a rigid body's inertia.

``phi`` is the ten parameters in Pinocchio's order, ``m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz,
Izz``, about the origin of their frame; people read mass, centre of mass and the tensor about it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

PARAMETERS = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
UNITS = ("kg", "kg m", "kg m", "kg m", *["kg m2"] * 6)

SYMMETRIC = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # Pinocchio's order of I
_READABLE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # the tables' order of I


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass [kg], centre of mass (3,) [m] and tensor (3, 3) [kg m2] about it, in one frame."""

    mass_kg: float
    com_m: np.ndarray
    tensor_kgm2: np.ndarray

    def phi(self) -> np.ndarray:
        """(10,) parameters about the frame's origin."""
        about_origin = self.tensor_kgm2 + self.mass_kg * _steiner(self.com_m)
        moments = [about_origin[i, j] for i, j in SYMMETRIC]
        return np.array([self.mass_kg, *(self.mass_kg * self.com_m), *moments])

    def readable(self) -> np.ndarray:
        """(10,) mass, centre of mass, Ixx, Iyy, Izz, Ixy, Ixz, Iyz: the columns of the tables."""
        moments = [self.tensor_kgm2[i, j] for i, j in _READABLE]
        return np.array([self.mass_kg, *self.com_m, *moments])

    def moved(self, origin_m: np.ndarray) -> Inertia:
        """The same body seen from a parallel frame whose origin lies at ``origin_m``."""
        return Inertia(self.mass_kg, self.com_m - origin_m, self.tensor_kgm2)

    def is_physical(self) -> bool:
        """Positive mass and a positive second moment along every axis."""
        least = np.linalg.eigvalsh(second_moments(self.tensor_kgm2))[0]
        return self.mass_kg > 0 and bool(least > 0)


def from_phi(phi: np.ndarray) -> Inertia:
    """Inverse of :meth:`Inertia.phi`.

    ZeroDivisionError: the mass is zero: there is no centre of mass.
    """
    mass = float(phi[0])
    if mass == 0.0:
        raise ZeroDivisionError("a body without mass has no centre of mass")
    com = np.asarray(phi[1:4]) / mass
    return Inertia(mass, com, _tensor(SYMMETRIC, phi[4:]) - mass * _steiner(com))


def from_readable(values: np.ndarray) -> Inertia:
    """Inverse of :meth:`Inertia.readable`."""
    tensor = _tensor(_READABLE, values[4:])
    return Inertia(float(values[0]), np.array(values[1:4], dtype=float), tensor)


def readable_jacobian(phi: np.ndarray) -> np.ndarray:
    """(10, 10) derivative of the readable parameters with respect to ``phi``, same frame."""
    columns = []
    for h, unit in zip(1e-6 * np.maximum(1.0, np.abs(phi)), np.eye(10), strict=True):
        difference = from_phi(phi + h * unit).readable() - from_phi(phi - h * unit).readable()
        columns.append(difference / (2 * h))
    return np.stack(columns, axis=1)


def readable_jacobians(phi: np.ndarray) -> np.ndarray:
    """(10 n, 10 n) of n bodies, one after the other."""
    return block_diag(*map(readable_jacobian, phi.reshape(-1, 10)))


def rod_length_m(inertia: Inertia) -> float:
    """Length of the rod whose mass lies as far from its centre, in the mean, as the segment's.

    Near to the length of a limb; the tables' lengths of pelvis and hand are a third and a half of
    what these segments measure.
    """
    return float(np.sqrt(6 * np.trace(inertia.tensor_kgm2) / inertia.mass_kg))


def second_moments(tensor: np.ndarray) -> np.ndarray:
    """(3, 3) second moments of mass ``integral r r^T dm`` of a tensor about the same point."""
    return 0.5 * np.trace(tensor) * np.eye(3) - tensor


def nearest_physical_tensor(tensor: np.ndarray) -> np.ndarray:
    """Nearest tensor (Frobenius norm of the second moments) that a body can have.

    No second moment is left below a hundredth of their sum: the triangle inequality of the
    principal moments (Wensing 2018) holds with that margin.
    """
    moments, axes = np.linalg.eigh(second_moments(tensor))
    lifted = axes @ np.diag(np.maximum(moments, 0.01 * moments.sum())) @ axes.T
    return np.trace(lifted) * np.eye(3) - lifted


def _tensor(order: Iterable[tuple[int, int]], values: np.ndarray) -> np.ndarray:
    tensor = np.empty((3, 3))
    for (i, j), value in zip(order, values, strict=True):
        tensor[i, j] = tensor[j, i] = value
    return tensor


def _steiner(r: np.ndarray) -> np.ndarray:
    return float(r @ r) * np.eye(3) - np.outer(r, r)
