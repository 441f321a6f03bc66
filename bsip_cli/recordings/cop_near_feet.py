"""Does the centre of pressure lie where some marker is near the floor?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plates import LOADED_N, cop_at_height

FAR_M = 0.3  # two feet on one plate: half their distance
NEAR_M = 0.15
_NEAR_FLOOR_M = 0.17  # ankles and below
_FEW = 200


@dataclass(frozen=True, eq=False)
class Scene:
    """The markers in the world frame, and how their frames and the plates' samples meet."""

    markers_m: np.ndarray  # (n_frames, n_markers, 3)
    marker_rate_hz: float
    analog_rate_hz: float


def cop_findings(recording: Recording) -> list[Finding]:
    """A warning for each plate whose centre of pressure keeps away from all low markers."""
    findings = []
    for plate in recording.plates:
        distance = median_distance_m(recording, plate)
        if distance > FAR_M:
            findings.append(
                Finding(
                    check="plate_cop",
                    subject=plate.name,
                    found=f"centre of pressure {distance:.2f} m from the nearest low marker",
                    expected=f"less than {FAR_M} m",
                    action="kept the plate; its frame, zero or gain may be wrong",
                    level="warning",
                )
            )
    return findings


def median_distance_m(recording: Recording, plate: Plate) -> float:
    """Median horizontal distance from the loaded plate's COP to the nearest low marker."""
    scene = Scene(recording.markers_m, recording.marker_rate_hz, recording.analog_rate_hz)
    return distance_to_low_markers_m(scene, plate)


def distance_to_low_markers_m(scene: Scene, plate: Plate) -> float:
    """Median horizontal distance from the loaded plate's COP to the nearest low marker, or NaN."""
    loaded, frames = _loaded_samples(scene, plate)
    height = 0.0 if plate.corners_m is None else float(plate.corners_m[:, 2].mean())
    cop = cop_at_height(plate.force_N[loaded], plate.moment_Nm[loaded], height)
    distances = [
        _nearest(point, scene.markers_m[frame], height)
        for point, frame in zip(cop, frames, strict=True)
    ]
    known = np.array([d for d in distances if np.isfinite(d)])
    return float(np.median(known)) if len(known) else float("nan")


def _loaded_samples(scene: Scene, plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    """Some samples of heavy load and their frames, (n,) int each."""
    load = np.where(plate.usable, plate.force_N[:, 2], 0.0)
    if not len(load):
        return np.zeros(0, int), np.zeros(0, int)
    loaded = np.flatnonzero(load > max(LOADED_N, 0.5 * np.percentile(load, 99)))
    loaded = loaded[:: max(1, len(loaded) // _FEW)]
    frames = np.round(loaded * scene.marker_rate_hz / scene.analog_rate_hz).astype(int)
    inside = frames < len(scene.markers_m)
    return loaded[inside], frames[inside]


def _nearest(point: np.ndarray, markers_m: np.ndarray, height_m: float) -> float:
    low = markers_m[markers_m[:, 2] < height_m + _NEAR_FLOOR_M, :2]
    return float(np.linalg.norm(low - point, axis=1).min()) if len(low) else float("nan")
