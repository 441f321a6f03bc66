"""From force-plate channels to a wrench: types 1 to 4 of the C3D format.

Plate frame: x from corner 2 to corner 1, y from corner 4 to corner 1, z into the floor,
origin at the centre of the surface. The channels hold the reaction on the body.
Done on whole arrays; ezc3d's extraction gives the same numbers
for types 2 and 4 (a test compares), but loops over samples and gives up on all plates
when one is described badly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
CHANNELS_OF = {
    1: ("Fx", "Fy", "Fz", "Px", "Py", "Tz"),
    2: CHANNELS,
    3: ("Fx12", "Fx34", "Fy14", "Fy23", "Fz1", "Fz2", "Fz3", "Fz4"),
    4: CHANNELS,
}
LOADED_N = 100.0  # a foot stands on the plate
LIGHT_N = 20.0  # laboratories set points and moments below 10 to 20 N to nothing
_LEAST_FORCE_N = 1e-6
_MM = 1e3


@dataclass(frozen=True, eq=False)
class PlateDescription:
    """What the file says of one plate, SI, lab frame."""

    name: str
    kind: int  # FORCE_PLATFORM:TYPE, 1 to 4
    corners_m: np.ndarray  # (4, 3)
    origin_m: np.ndarray  # (3,), see `surface_offset_m`; type 3: sensor distances a, b, az0
    cop_polynomial: np.ndarray | None = None  # (2, 6), see `cop_shift_m`

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

    def surface_offset_m(self) -> np.ndarray:
        """From the sensor's origin to the centre of the surface, plate frame, (3,).

        The format wants z < 0. Many exporters write the opposite vector: reversed here.
        """
        if self.kind == 1:
            return np.zeros(3)
        if self.kind == 3:  # the first two are sensor distances and no offset
            return np.array([0.0, 0.0, -abs(self.origin_m[2])])
        return -self.origin_m if self.origin_m[2] > 0 else self.origin_m


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


def measured(channels: np.ndarray, kind: int) -> np.ndarray:
    """What a wrench is linear in, (n, k), of channels (n, 6 or 8) in N, N m (type 1: m).

    Of type 1 these are force, each of its products with Px and with Py, and Tz; else the channels.
    """
    if kind != 1:
        return channels
    force, point, torque = np.split(channels, [3, 5], axis=1)
    products = point[:, :, None] * force[:, None]
    return np.hstack([force, products.reshape(len(force), 6), torque])


def wrench_matrix(plate: PlateDescription) -> np.ndarray:
    """From what is `measured` to the wrench at the sensor's origin, plate frame, (6, k)."""
    if plate.kind == 1:
        matrix = np.zeros((6, 10))
        matrix[[0, 1, 2, 3, 4, 5, 5, 5], [0, 1, 2, 8, 5, 4, 6, 9]] = [1, 1, 1, 1, -1, 1, -1, 1]
        return matrix
    if plate.kind != 3:
        return np.eye(6)
    # Kistler: sensors at the distances a, b from the centre.
    a, b = np.abs(plate.origin_m[:2])
    return np.array(
        [
            [1, 1, 0, 0, 0, 0, 0, 0],
            [0, 0, 1, 1, 0, 0, 0, 0],
            [0, 0, 0, 0, 1, 1, 1, 1],
            [0, 0, 0, 0, b, b, -b, -b],
            [0, 0, 0, 0, -a, a, a, -a],
            [-b, b, a, -a, 0, 0, 0, 0],
        ],
        dtype=float,
    )


def cop_shift_m(cop_m: np.ndarray, plate: PlateDescription) -> np.ndarray:
    """By how much the maker's polynomial moves a centre of pressure on the surface, plate frame,
    (n, 2).

    Kistler, manual of the force plate type 9287C, section 8.4.3: x is lessened by
    (P1 y^4 + P2 y^2 + P3) x^3 + (P4 y^4 + P5 y^2 + P6) x, y likewise with x and y exchanged;
    coefficients per mm. Outside the outline, where nothing was fitted, the shift of the
    nearest point of the rim counts.
    """
    assert plate.cop_polynomial is not None
    limits, shifts = plate.half_size_m(), []
    x, y = np.clip(np.nan_to_num(cop_m), -limits, limits).T * _MM
    for p, along, across in zip(plate.cop_polynomial, (x, y), (y, x), strict=True):
        cubic, linear = (p[k] * across**4 + p[k + 1] * across**2 + p[k + 2] for k in (0, 3))
        shifts.append(cubic * along**3 + linear * along)
    return np.column_stack(shifts) / _MM


def side_lengths(corners_m: np.ndarray) -> np.ndarray:
    """Of corners (4, 3), (4,)."""
    return np.linalg.norm(np.roll(corners_m, -1, axis=0) - corners_m, axis=1)


def corners_are_plausible(corners_m: np.ndarray) -> bool:
    """A flat, roughly rectangular quadrilateral of 0.1 to 5 m, not too far away."""
    if not np.isfinite(corners_m).all() or np.abs(corners_m).max() > 100.0:
        return False
    sides = side_lengths(corners_m)
    if sides.min() < 0.1 or sides.max() > 5.0:
        return False
    diagonals = np.linalg.norm(corners_m[2:] - corners_m[:2], axis=1)
    apart = [abs(diagonals[0] - diagonals[1]), parallelogram_gap(corners_m)]
    return bool(max(apart) < 0.1 * diagonals.max())


def parallelogram_gap(corners_m: np.ndarray) -> float:
    """How far the middles of the diagonals of corners (4, 3) are apart, twice."""
    return float(np.linalg.norm(corners_m[::2].sum(axis=0) - corners_m[1::2].sum(axis=0)))
