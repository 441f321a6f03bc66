"""What a plate shows, seen in its own axes about its own centre."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.scene import Plate, Scene

CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")


def plate_of(scene: Scene, name: str) -> Plate:
    return next(plate for plate in scene.plates if plate.name == name)


def loaded_plates(scene: Scene, least_N: float = 50.0) -> tuple[str, ...]:
    """Names of the plates that carry something in valid frames."""
    return tuple(
        plate.name
        for plate in scene.plates
        if scene.valid.any() and np.nanmax(plate.wrench[scene.valid, 2]) > least_N
    )


def in_plate(plate: Plate, wrench: np.ndarray) -> np.ndarray:
    """(N, 6) force and moment about the plate's centre, plate axes."""
    axes, centre = plate.axes(), plate.centre_m()
    moment = wrench[:, 3:] - np.cross(centre, wrench[:, :3])
    return np.hstack([wrench[:, :3] @ axes.T, moment @ axes.T])


def in_world(plate: Plate, reading: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin, from a reading in the plate's frame."""
    axes, centre = plate.axes(), plate.centre_m()
    force = reading[:, :3] @ axes
    return np.hstack([force, reading[:, 3:] @ axes + np.cross(centre, force)])
