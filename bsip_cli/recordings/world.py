"""Which way is up, and the rotation that turns the lab frame Z-up."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.label_words import Meaning, meanings
from bsip_cli.recordings.model import Finding

_LOW = ("foot_l", "foot_r", "malleolus_lateral_l", "malleolus_lateral_r")
_HIGH = ("head", "upper_torso")
_CLEARLY_ABOVE_M = 0.2
_CLEAR_SHARE = 0.75  # of all marker positions on one side of the floor
_AXES = "XYZ"


@dataclass(frozen=True)
class Up:
    """The vertical as a signed lab axis, and what it was read from."""

    axis: int  # 0, 1, 2
    sign: int  # +1 or -1
    reason: str

    @property
    def name(self) -> str:
        return ("+" if self.sign > 0 else "-") + _AXES[self.axis]

    def vector(self) -> np.ndarray:
        """Unit vector, lab frame, (3,)."""
        up = np.zeros(3)
        up[self.axis] = self.sign
        return up


def up_from_surface(
    normals: np.ndarray, points_on_floor_m: np.ndarray, markers_m: np.ndarray
) -> Up | None:
    """The lab axis nearest to the floor's normal, its sign from the markers above the floor.

    ``normals`` (n, 3) of either sign, ``points_on_floor_m`` (n, 3), ``markers_m``
    (n_frames, n_markers, 3), all in the lab frame. None if nothing settles the sign.
    """
    axis = int(np.argmax(np.abs(normals).sum(axis=0)))
    seen = markers_m[np.isfinite(markers_m).all(axis=-1)]
    if not len(seen) or not np.isfinite(points_on_floor_m[:, axis]).any():
        return None
    above = float(np.mean(seen[:, axis] > np.nanmedian(points_on_floor_m[:, axis])))
    if 1 - _CLEAR_SHARE < above < _CLEAR_SHARE:
        return None
    return Up(axis, 1 if above > 0.5 else -1, "the markers lie above the force plates")


def up_from_labels(labels: Sequence[str], markers_m: np.ndarray) -> Up | None:
    """From the feet to trunk and head, by what the labels say."""
    understood = meanings(labels)
    low = _middle(labels, markers_m, understood, _LOW)
    high = _middle(labels, markers_m, understood, _HIGH)
    if low is None or high is None:
        return None
    rise = high - low
    axis = int(np.argmax(np.abs(rise)))
    sideways = np.delete(np.abs(rise), axis).max()
    if abs(rise[axis]) < max(_CLEARLY_ABOVE_M, 2 * sideways):
        return None
    return Up(axis, 1 if rise[axis] > 0 else -1, "the feet lie below head and trunk")


def up_from_name(name: str) -> Up | None:
    """From POINT:Y_SCREEN, whose sign laboratories use either way: only the axis counts."""
    letter = name.strip().upper()[-1:]
    return Up(_AXES.index(letter), 1, "POINT:Y_SCREEN") if letter and letter in _AXES else None


def rotation_to_z_up(up: Up) -> np.ndarray:
    """Proper rotation world <- lab, (3, 3), that sends ``up`` to +Z and keeps X where it can."""
    z = up.vector()
    x = np.eye(3)[1 if up.axis == 0 else 0]
    return np.array([x, np.cross(z, x), z])


def finding_about(up: Up) -> Finding | None:
    """A line for the quality table if the lab frame was not Z-up."""
    if up.axis == 2 and up.sign > 0:
        return None
    return Finding(
        check="up_axis",
        subject="",
        found=f"the lab's vertical is {up.name}: {up.reason}",
        expected="+Z",
        action="turned the lab frame Z-up",
        level="corrected",
    )


def _middle(
    labels: Sequence[str],
    markers_m: np.ndarray,
    understood: Mapping[str, Meaning],
    places: Collection[str],
) -> np.ndarray | None:
    """The median place (3,) [m] of the markers on these segments or landmarks."""
    chosen = [
        i
        for i, label in enumerate(labels)
        if (m := understood.get(label)) and (m.segment in places or m.landmark in places)
    ]
    points = markers_m[:, chosen].reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    return np.median(points, axis=0) if len(points) else None
