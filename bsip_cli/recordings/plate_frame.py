"""A plate's outline and axes against the feet: too small, or turned about the vertical."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bsip_cli.recordings.cop_near_feet import FAR_M, NEAR_M, Scene, distance_to_low_markers_m
from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plates import (
    LOADED_N,
    LocalWrench,
    PlateDescription,
    inside_share,
)

_RIM_M = 0.02
_GOOD_SHARE = 0.9
_BAD_SHARE = 0.2
_CLEARLY = 0.5  # of the next best distance
_TURNS = {1: "90", 2: "180", 3: "270"}  # corners moved on by so many: degrees

ToPlate = Callable[[LocalWrench, PlateDescription], Plate]


def settle_frame(
    wrench: LocalWrench, description: PlateDescription, scene: Scene, to_plate: ToPlate
) -> tuple[Plate | None, tuple[Finding, ...]]:
    """The plate in the world frame, its outline and axes as the feet prove them.

    ``wrench`` about the centre of the surface, plate frame. A centre of pressure beside the
    outline but under a foot widens the outline; one far from all feet, which another order
    of the corners puts under them, turns the axes. Without such proof a plate whose load is
    outside its outline is left out.
    """
    plate = to_plate(wrench, description)
    share = _inside(wrench, description, plate.usable)
    distance = distance_to_low_markers_m(scene, plate)
    if share < _BAD_SHARE and distance < NEAR_M:
        return _widened(wrench, description, share, distance, to_plate)
    if distance > FAR_M:
        turned = _turned(wrench, description, distance, scene, to_plate)
        if turned is not None:
            return turned
    if share < _BAD_SHARE:
        finding = _outside(description, share, distance, "left the plate out", "excluded")
        return None, (finding,)
    return plate, ()


def _inside(wrench: LocalWrench, description: PlateDescription, usable: np.ndarray) -> float:
    loaded = usable & (np.abs(wrench.force_N[:, 2]) > LOADED_N)
    share = inside_share(wrench.cop()[loaded], description.half_size_m())
    return 1.0 if np.isnan(share) else share


def _widened(
    wrench: LocalWrench,
    description: PlateDescription,
    share: float,
    distance_m: float,
    to_plate: ToPlate,
) -> tuple[Plate, tuple[Finding, ...]]:
    loaded = np.abs(wrench.force_N[:, 2]) > LOADED_N
    reach = np.nanpercentile(np.abs(wrench.cop()[loaded]), 99, axis=0) + _RIM_M
    factors = np.maximum(reach / description.half_size_m(), 1.0)
    centre, rotation = description.centre_m(), description.rotation_lab_plate()
    local = (description.corners_m - centre) @ rotation * [*factors, 1.0]
    wider = replace(description, corners_m=centre + local @ rotation.T)
    old, new = (" x ".join(f"{2 * s:.2f}" for s in d.half_size_m()) for d in (description, wider))
    finding = _outside(
        description, share, distance_m, f"widened the outline from {old} to {new} m", "corrected"
    )
    return to_plate(wrench, wider), (finding,)


def _turned(
    wrench: LocalWrench,
    description: PlateDescription,
    distance_m: float,
    scene: Scene,
    to_plate: ToPlate,
) -> tuple[Plate, tuple[Finding, ...]] | None:
    """The plate with the one order of corners that brings its load under the feet, or None."""
    tried = {}
    for turn in _TURNS:
        other = replace(description, corners_m=np.roll(description.corners_m, -turn, axis=0))
        usable = to_plate(wrench, other).usable
        if _inside(wrench, other, usable) >= _GOOD_SHARE:
            plate = to_plate(wrench, other)
            tried[turn] = (distance_to_low_markers_m(scene, plate), plate)
    ranked = sorted(tried, key=lambda turn: tried[turn][0])
    if not ranked or not tried[ranked[0]][0] < NEAR_M:
        return None
    best, plate = tried[ranked[0]]
    if any(best > _CLEARLY * tried[turn][0] for turn in ranked[1:]):
        return None
    finding = Finding(
        check="plate_frame",
        subject=description.name,
        found=f"centre of pressure {distance_m:.2f} m from the nearest low marker",
        expected=f"less than {FAR_M} m",
        action=f"turned the plate's axes by {_TURNS[ranked[0]]} degrees, which leaves {best:.2f} m",
        level="corrected",
    )
    return plate, (finding,)


def _outside(
    description: PlateDescription, share: float, distance_m: float, action: str, level: str
) -> Finding:
    near = "no low marker is seen"
    if np.isfinite(distance_m):
        near = f"{distance_m:.2f} m from the nearest low marker"
    return Finding(
        check="plate_cop",
        subject=description.name,
        found=f"centre of pressure inside the plate in {100 * share:.0f} % of loaded samples, "
        + near,
        expected=f"at least {100 * _GOOD_SHARE:.0f} %",
        action=action,
        level=level,
    )
