"""Mass, centre of mass and inertia of one rigid body, and how to vary them physically."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Inertia:
    """A rigid body's mass distribution.

    mass_kg : mass.
    com_m : (3,) centre of mass from the body's origin, body axes.
    tensor_kgm2 : (3, 3) inertia tensor about the centre of mass, body axes.
    """

    mass_kg: float
    com_m: np.ndarray
    tensor_kgm2: np.ndarray

    def is_physical(self) -> bool:
        """Positive mass and positive definite second moments (pseudo-inertia > 0)."""
        moments = np.linalg.eigvalsh(second_moments(self.tensor_kgm2))
        return self.mass_kg > 0.0 and bool(moments.min() > 0.0)


def second_moments(tensor: np.ndarray) -> np.ndarray:
    """Integral of r r^T dm about the centre of mass, from the inertia tensor."""
    return 0.5 * np.trace(tensor) * np.eye(3) - tensor


def tensor_of(moments: np.ndarray) -> np.ndarray:
    """Inertia tensor from the integral of r r^T dm."""
    return np.trace(moments) * np.eye(3) - moments


def nearest_physical(tensor: np.ndarray, least_share: float = 0.02) -> np.ndarray:
    """Raise too small principal second moments to a share of the largest one."""
    values, axes = np.linalg.eigh(second_moments(tensor))
    values = np.maximum(values, least_share * values.max())
    return tensor_of(axes @ np.diag(values) @ axes.T)


def varied_tensor(tensor: np.ndarray, rng: np.random.Generator, share: float) -> np.ndarray:
    """Another physical tensor; the mean of many is the given one.

    It is that of equal points drawn from a normal distribution with the given second moments
    (Wishart), so many that each moment has the relative standard deviation `share`. The axes of
    a slender body turn little, those of a round one freely.
    """
    count = max(3, round(2.0 / share**2))
    points = rng.standard_normal((count, 3)) @ np.linalg.cholesky(second_moments(tensor)).T
    return tensor_of(points.T @ points / count)


def combined(parts: list[tuple[Inertia, np.ndarray]]) -> Inertia:
    """One body out of several that share their axes.

    parts : (inertia, origin (3,) of the part in the frame of the whole).
    """
    mass = sum(part.mass_kg for part, _ in parts)
    com = sum(part.mass_kg * (origin + part.com_m) for part, origin in parts) / mass
    tensor = np.zeros((3, 3))
    for part, origin in parts:
        d = origin + part.com_m - com
        tensor += part.tensor_kgm2 + part.mass_kg * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertia(mass, com, tensor)
