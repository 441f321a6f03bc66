"""A person who shifts the weight between two feet on two plates, as plates of either format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plate_reading import Opened, PlateSource
from bsip_cli.recordings.plates import PlateDescription
from bsip_cli.recordings.plates_of_files import C3dPlate, ForceOnPoint, points_that_move

N, RATE_HZ = 400, 100.0
LABELS = ["RASI", "LASI", "RPSI", "LPSI", "RHEE", "RTOE", "RANK", "LHEE", "LTOE", "LANK"]
_PLACES_M = np.array(
    [
        *[[0.62, 0.38, 1.0], [0.62, 0.62, 1.0], [0.45, 0.44, 1.0], [0.45, 0.56, 1.0]],
        *[[0.42, 0.38, 0.05], [0.62, 0.36, 0.04], [0.47, 0.36, 0.1]],
        *[[0.42, 0.62, 0.05], [0.62, 0.64, 0.04], [0.47, 0.64, 0.1]],
    ]
)  # X ahead, Y left, Z up
CENTRES_M = np.array([[0.6, 0.2, 0.0], [0.6, 0.8, 0.0]])  # of the right and the left plate
_HALF_M = (0.3, 0.25)


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Markers (N, 10, 3), and of the right and left foot forces (2, N, 3) and points (2, N, 3)."""
    time_s = np.arange(N) / RATE_HZ
    shift = 0.3 * np.sin(2 * np.pi * 0.4 * time_s)
    share = np.array([0.5 + shift, 0.5 - shift])
    sway = 0.03 * np.sin(2 * np.pi * 0.3 * time_s + 1.0)
    # An inverted pendulum: the body goes less far than the centre of pressure, and is driven by it.
    aside = -0.26 * shift / (1.0 + (2 * np.pi * 0.4) ** 2 / GRAVITY_M_S2)
    ahead = sway / (1.0 + (2 * np.pi * 0.3) ** 2 / GRAVITY_M_S2)
    force = np.zeros((2, N, 3))
    force[..., 2] = 600.0 * share
    force[..., 1] = -((2 * np.pi * 0.4) ** 2) * aside * 60.0 * share
    force[..., 0] = -((2 * np.pi * 0.3) ** 2) * ahead * 60.0 * share
    inward = 24.0 * 4.0 * share[0] * share[1]  # the legs are spread
    force[..., 1] += np.array([inward, -inward])
    point = np.zeros((2, N, 3))
    point[..., 0] = 0.52 + sway
    point[..., 1] = np.array([[0.37], [0.63]]) + 0.005 * np.sin(5 * time_s)
    markers = np.repeat(_PLACES_M[None], N, axis=0)
    markers[:, :4, 1] += aside[:, None] / 0.9  # nine tenths of the mass
    markers[:, :4, 0] += ahead[:, None] / 0.9
    return markers, force, point


def opened(sources: list[PlateSource], markers_m: np.ndarray | None = None) -> Opened:
    markers = motion()[0] if markers_m is None else markers_m
    recording = Recording(
        path=Path("a"),
        marker_rate_hz=RATE_HZ,
        labels=tuple(LABELS),
        markers_m=markers,
        analog_rate_hz=RATE_HZ,
        plates=(),
        findings=(),
        rotation_world_lab=np.eye(3),
        forces_note="",
        time0_s=0.0,
    )
    return Opened(recording, tuple(sources))


def free_moment(force: np.ndarray) -> np.ndarray:
    """Vertical moment at the centre of pressure, 2 mm times the force, (N, 3)."""
    return np.column_stack([np.zeros((N, 2)), 0.002 * force[:, 2]])


def of_table(about: str = "stated", point_scale: float = 1.0, moment_scale: float = 1.0):
    """Both forces as a MOT has them: moments about ``about``, in other units."""
    _, forces, points = motion()
    sources = []
    for k, (force, point) in enumerate(zip(forces, points, strict=True)):
        arm = {"stated": 0.0 * point, "origin": point, "fixed": point - CENTRES_M[k]}[about]
        sources.append(
            ForceOnPoint(
                name=str(k + 1),
                force_N=force,
                points=point * point_scale,
                moment=(free_moment(force) + np.cross(arm, force)) * moment_scale,
                point_height=0.0,
                points_move=points_that_move(point, force[:, 2] > 100),
                known=np.ones(N, bool),
                rotation_world_lab=np.eye(3),
            )
        )
    return sources


def corners(k: int) -> np.ndarray:
    """Of plate ``k``, wound as C3D wants: z of the plate into the floor, (4, 3)."""
    x, y = _HALF_M
    return CENTRES_M[k] + np.array([[x, y, 0], [-x, y, 0], [-x, -y, 0], [x, -y, 0]])[[0, 3, 2, 1]]


def of_c3d(
    turn: int = 0,
    moment_scale: float = 1.0,
    origin_m: tuple[float, float, float] = (0.01, -0.02, -0.04),
    stated_origin_m: tuple[float, float, float] | None = None,
    sign: int = 1,
) -> list[C3dPlate]:
    """Both plates as a C3D file has them, described with faults."""
    _, forces, points = motion()
    sources = []
    for k, (force, point) in enumerate(zip(forces, points, strict=True)):
        true = PlateDescription(str(k + 1), 2, corners(k), np.array(origin_m))
        axes = true.rotation_lab_plate()
        moment = free_moment(force) + np.cross(point - CENTRES_M[k], force)
        local, moment = sign * force @ axes, sign * moment @ axes
        at_sensor = moment - np.cross(local, origin_m)
        channels = np.hstack([local, at_sensor * moment_scale])
        stated = PlateDescription(
            true.name,
            2,
            np.roll(corners(k), turn, axis=0),
            np.array(origin_m if stated_origin_m is None else stated_origin_m) + 0.0,
        )
        sources.append(C3dPlate(stated, channels, np.ones(N, bool), np.eye(3)))
    return sources
