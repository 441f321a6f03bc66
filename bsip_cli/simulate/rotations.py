"""Rotation matrices for arrays of angles. Shapes: angles (T,), matrices (T, 3, 3)."""

from __future__ import annotations

import numpy as np


def skew(vectors: np.ndarray) -> np.ndarray:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def unskew(matrices: np.ndarray) -> np.ndarray:
    """Axis vectors (..., 3) of the antisymmetric part of matrices (..., 3, 3)."""
    m = matrices
    return 0.5 * np.stack(
        [
            m[..., 2, 1] - m[..., 1, 2],
            m[..., 0, 2] - m[..., 2, 0],
            m[..., 1, 0] - m[..., 0, 1],
        ],
        axis=-1,
    )


def about_axis(axis: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """Rotations by angles (T,) about one fixed unit axis (3,) (Rodrigues)."""
    K = skew(axis)
    angle = np.asarray(angle_rad, dtype=float)[..., None, None]
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def about_x(angle_rad: np.ndarray) -> np.ndarray:
    return about_axis(np.array([1.0, 0.0, 0.0]), angle_rad)


def about_y(angle_rad: np.ndarray) -> np.ndarray:
    return about_axis(np.array([0.0, 1.0, 0.0]), angle_rad)


def about_z(angle_rad: np.ndarray) -> np.ndarray:
    return about_axis(np.array([0.0, 0.0, 1.0]), angle_rad)


def euler_zxy(angles_rad: np.ndarray) -> np.ndarray:
    """Rz(a) Rx(b) Ry(c) of angles (T, 3): flexion, side bending, axial rotation."""
    a, b, c = np.moveaxis(np.asarray(angles_rad, dtype=float), -1, 0)
    return about_z(a) @ about_x(b) @ about_y(c)


def from_rotation_vector(vectors_rad: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) of rotation vectors (T, 3)."""
    vectors = np.asarray(vectors_rad, dtype=float)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    K = skew(vectors)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.eye(3) + first * K + second * (K @ K)


def transpose(matrices: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrices, -1, -2)


def rotate(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply (T, 3, 3) to vectors (T, 3) or to one vector (3,)."""
    return np.einsum("...ij,...j->...i", matrices, vectors)


def frame_of(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Right-handed frames (..., 3, 3): column 0 along `first`, column 2 near `second`."""
    x = first / np.linalg.norm(first, axis=-1, keepdims=True)
    z = second - np.sum(second * x, axis=-1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)
