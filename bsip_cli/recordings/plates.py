"""From force-plate channels to a wrench: types 1 to 4 of the C3D format.

Plate frame: x from corner 2 to corner 1, y from corner 4 to corner 1, z into the floor,
origin at the centre of the surface. The channels hold the reaction on the body.
Done here on whole arrays rather than by ezc3d's extraction, which gives the same numbers
for types 2 and 4 (a test compares), but loops over samples and gives up on all plates
when one is described badly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

N_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
LOADED_N = 100.0  # a foot stands on the plate
_LEAST_FORCE_N = 1e-6


@dataclass(frozen=True, eq=False)
class PlateDescription:
    """What the file says of one plate, SI, lab frame."""

    name: str
    kind: int  # FORCE_PLATFORM:TYPE, 1 to 4
    corners_m: np.ndarray  # (4, 3)
    origin_m: np.ndarray  # (3,), see `LocalWrench.at_surface`; type 3: sensor distances a, b, az0
    cop_polynomial: np.ndarray | None = None  # (2, 6), see `correct_cop`

    def centre_m(self) -> np.ndarray:
        return self.corners_m.mean(axis=0)

    def half_size_m(self) -> np.ndarray:
        """Half the extent along the plate's x and y, (2,)."""
        c = self.corners_m
        return 0.5 * np.array([np.linalg.norm(c[0] - c[1]), np.linalg.norm(c[0] - c[3])])

    def rotation_lab_plate(self) -> np.ndarray:
        """Columns are the plate's axes in the lab frame, (3, 3)."""
        c = self.corners_m
        x, y = c[0] - c[1], c[0] - c[3]
        z = crossing(x) @ y
        axes = np.array([x, crossing(z) @ x, z]).T
        return axes / np.linalg.norm(axes, axis=0)


@dataclass(frozen=True, eq=False)
class LocalWrench:
    """Force [N] and moment [N m] in the plate frame, (n, 3) each, at the sensor's origin."""

    force_N: np.ndarray
    moment_Nm: np.ndarray

    def at_surface(self, origin_m: np.ndarray) -> LocalWrench:
        """The moment about the centre of the surface.

        ``origin_m`` (3,) runs from the sensor's origin to that centre, so z < 0.
        """
        return replace(self, moment_Nm=self.moment_Nm + np.cross(self.force_N, origin_m))

    def cop(self) -> np.ndarray:
        """Centre of pressure on the surface, plate frame, (n, 2); NaN without load."""
        return cop_at_height(self.force_N, self.moment_Nm, 0.0)


def crossing(vector: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) whose product with another vector is the cross product."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cop_at_height(
    force_N: np.ndarray, moment_Nm: np.ndarray, height_m: float | np.ndarray
) -> np.ndarray:
    """Where wrenches (..., 3) about the origin pierce the plane z = height without Mx, My,
    (..., 2)."""
    fz = np.where(np.abs(force_N[..., 2]) > _LEAST_FORCE_N, force_N[..., 2], np.nan)
    x = (-moment_Nm[..., 1] + height_m * force_N[..., 0]) / fz
    y = (moment_Nm[..., 0] + height_m * force_N[..., 1]) / fz
    return np.stack([x, y], axis=-1)


def local_wrench(kind: int, channels: np.ndarray, plate: PlateDescription) -> LocalWrench:
    """Channels (n, 6 or 8) in N, N m (type 1: m) to the wrench at the sensor's origin."""
    return _BY_TYPE[kind](channels, plate)


def surface_offset_m(plate: PlateDescription) -> np.ndarray:
    """From the sensor's origin to the centre of the surface, plate frame, (3,).

    The format wants z < 0. Many exporters write the opposite vector: reversed here.
    """
    if plate.kind == 1:
        return np.zeros(3)
    if plate.kind == 3:  # the first two are sensor distances and no offset
        return np.array([0.0, 0.0, -abs(plate.origin_m[2])])
    return -plate.origin_m if plate.origin_m[2] > 0 else plate.origin_m


def _type_1(channels: np.ndarray, _plate: PlateDescription) -> LocalWrench:
    """Fx, Fy, Fz, COP x, COP y, free moment."""
    force = channels[:, :3]
    n = len(channels)
    point = np.column_stack([channels[:, 3:5], np.zeros(n)])
    free = np.column_stack([np.zeros((n, 2)), channels[:, 5]])
    return LocalWrench(force, np.cross(point, force) + free)


def _six_components(channels: np.ndarray, _plate: PlateDescription) -> LocalWrench:
    return LocalWrench(channels[:, :3], channels[:, 3:6])


def _type_3(channels: np.ndarray, plate: PlateDescription) -> LocalWrench:
    """Kistler: Fx12, Fx34, Fy14, Fy23, Fz1 to Fz4 at the distances a, b from the centre."""
    a, b = np.abs(plate.origin_m[:2])
    fx12, fx34, fy14, fy23, fz1, fz2, fz3, fz4 = channels[:, :8].T
    force = np.column_stack([fx12 + fx34, fy14 + fy23, fz1 + fz2 + fz3 + fz4])
    moment = np.column_stack(
        [
            b * (fz1 + fz2 - fz3 - fz4),
            a * (-fz1 + fz2 + fz3 - fz4),
            b * (fx34 - fx12) + a * (fy14 - fy23),
        ]
    )
    return LocalWrench(force, moment)


_BY_TYPE: dict[int, Callable[[np.ndarray, PlateDescription], LocalWrench]] = {
    1: _type_1,
    2: _six_components,
    3: _type_3,
    4: _six_components,
}


def to_world(
    wrench: LocalWrench, plate: PlateDescription, rotation_world_lab: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Surface wrench in the plate frame to force and moment about the world origin, (n, 3) each."""
    rotation = rotation_world_lab @ plate.rotation_lab_plate()
    force = wrench.force_N @ rotation.T
    centre = rotation_world_lab @ plate.centre_m()
    return force, wrench.moment_Nm @ rotation.T + np.cross(centre, force)


def corners_are_plausible(corners_m: np.ndarray) -> bool:
    """A flat, roughly rectangular quadrilateral of 0.1 to 5 m, not too far away."""
    if not np.isfinite(corners_m).all() or np.abs(corners_m).max() > 100.0:
        return False
    sides = np.linalg.norm(np.roll(corners_m, -1, axis=0) - corners_m, axis=1)
    if sides.min() < 0.1 or sides.max() > 5.0:
        return False
    diagonals = np.linalg.norm(corners_m[2:] - corners_m[:2], axis=1)
    return bool(abs(diagonals[0] - diagonals[1]) < 0.1 * diagonals.max())
