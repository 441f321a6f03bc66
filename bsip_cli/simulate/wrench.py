"""Ground wrench by the rate of momentum of all bodies (Newton and Euler for the whole).

F = dp/dt - m g and M = dL/dt - sum r x m g about the walkway's origin, with momenta by
numerical differentiation of positions and rotations. No equations of motion of a tree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.calculus import derivative
from bsip_cli.simulate.inertia import Inertia
from bsip_cli.simulate.loads import GRAVITY, Load, total_load
from bsip_cli.simulate.poses import Poses
from bsip_cli.simulate.rotations import rotate, transpose, unskew


@dataclass(frozen=True, eq=False)
class Momentum:
    """Whole-body momentum in an inertial frame.

    com_m : (T, 3). linear : (T, 3) [kg m/s]. angular : (T, 3) about the origin [kg m2/s].
    """

    mass_kg: float
    com_m: np.ndarray
    linear: np.ndarray
    angular: np.ndarray

    def spin(self) -> np.ndarray:
        """(T, 3) angular momentum about the centre of mass."""
        return self.angular - np.cross(self.com_m, self.linear)


def momentum_of(inertias: dict[str, Inertia], poses: Poses, step_s: float) -> Momentum:
    """Sum over bodies of their momenta."""
    mass = sum(part.mass_kg for part in inertias.values())
    samples = len(next(iter(poses.origin_m.values())))
    first, linear, angular = (np.zeros((samples, 3)) for _ in range(3))
    for body, part in inertias.items():
        R = poses.rotation[body]
        r = poses.point(body, part.com_m)
        p = part.mass_kg * derivative(r, step_s)
        turning = unskew(transpose(R) @ derivative(R, step_s))  # body axes
        first += part.mass_kg * r
        linear += p
        angular += np.cross(r, p) + rotate(R, turning @ part.tensor_kgm2)
    return Momentum(mass, first / mass, linear, angular)


def locked_inertia(inertias: dict[str, Inertia], poses: Poses, com_m: np.ndarray) -> np.ndarray:
    """(T, 3, 3) inertia of the body as if it were stiff, about its centre of mass."""
    total = np.zeros((len(com_m), 3, 3))
    for body, part in inertias.items():
        R = poses.rotation[body]
        lever = poses.point(body, part.com_m) - com_m
        total += R @ part.tensor_kgm2 @ transpose(R) + part.mass_kg * _parallel(lever)
    return total


def _parallel(r: np.ndarray) -> np.ndarray:
    """(T, 3, 3) r.r 1 - r r^T."""
    square = np.sum(r * r, axis=-1)[:, None, None] * np.eye(3)
    return square - r[:, :, None] * r[:, None, :]


def ground_wrench(
    inertias: dict[str, Inertia], poses: Poses, step_s: float, loads: Iterable[Load] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Force (T, 3) [N] on the body and moment (T, 3) [N m] about the walkway's origin."""
    momentum = momentum_of(inertias, poses, step_s)
    weight = momentum.mass_kg * GRAVITY
    load_force, load_moment = total_load(loads, poses, step_s)
    force = derivative(momentum.linear, step_s) - weight + load_force
    gravity_moment = np.cross(momentum.com_m, weight)
    moment = derivative(momentum.angular, step_s) - gravity_moment + load_moment
    return force, moment


def centre_of_pressure(force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """(T, 2) X and Z on the ground where the horizontal moments vanish (NaN if unloaded)."""
    vertical = np.where(np.abs(force[:, 1]) > 1e-6, force[:, 1], np.nan)
    return np.stack([moment[:, 2] / vertical, -moment[:, 0] / vertical], axis=1)
