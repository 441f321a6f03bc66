"""What a plate shows, seen in its own axes.

A channel, as the diagnosis names it ("1 fz"), is a component of the force or moment *on the body*
about the plate's sensor, in the plate's own axes turned about x until z points up. So a person who
stands reads a positive fz, and an offset of +10 N in fz makes everybody seem 1 kg heavier.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Plate, Scene

CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")
ALL = "all"  # every plate alike: one amplifier, or one lab whose origin is not where it is said


def plate_of(scene: Scene, name: str) -> Plate:
    return next(plate for plate in scene.plates if plate.name == name)


def loaded_plates(scene: Scene, least_N: float = 50.0) -> tuple[str, ...]:
    """Names of the plates that carry something in valid frames."""
    return tuple(
        plate.name
        for plate in scene.plates
        if scene.valid.any() and np.nanmax(plate.wrench[scene.valid, 2]) > least_N
    )


def loaded_alone_or_all(scene: Scene) -> tuple[str, ...]:
    """The plates that carry something, and where they are several, all of them together."""
    loaded = loaded_plates(scene)
    return (*loaded, ALL) if len(loaded) > 1 else loaded


def plates_of(scene: Scene, name: str) -> tuple[Plate, ...]:
    """The plate of a name; those that carry something for ``all``."""
    names = loaded_plates(scene) if name == ALL else (name,)
    return tuple(plate_of(scene, one) for one in names)


def plates_called(name: str) -> str:
    """``plate 1`` or ``all plates``."""
    return "all plates" if name == ALL else f"plate {name}"


def plates_that(name: str, does: str, do: str) -> str:
    """``plate 1 does`` or ``all plates do``."""
    return f"{plates_called(name)} {do if name == ALL else does}"


def in_plate(plate: Plate, wrench: np.ndarray) -> np.ndarray:
    """(N, 6) force and moment on the body about the plate's sensor, plate axes."""
    axes, about = plate.axes(), sensor_m(plate)
    moment = wrench[:, 3:] - np.cross(about, wrench[:, :3])
    return np.hstack([wrench[:, :3] @ axes.T, moment @ axes.T])


def in_world(plate: Plate, reading: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin, from a reading in the plate's frame."""
    axes, about = plate.axes(), sensor_m(plate)
    force = reading[:, :3] @ axes
    return np.hstack([force, reading[:, 3:] @ axes + np.cross(about, force)])


def in_channel(plate: Plate, channel: int, course: np.ndarray | float) -> np.ndarray:
    """(N, 6) wrench about the world's origin of a course (N,) that one channel shows."""
    reading = np.zeros((len(plate.wrench), 6))
    reading[:, channel] = course
    return in_world(plate, reading)


def shown(plate: Plate, channel: int) -> np.ndarray:
    """(N,) what a channel shows, 0 where there is no reading."""
    return in_plate(plate, np.nan_to_num(plate.wrench))[:, channel]


def sensor_m(plate: Plate) -> np.ndarray:
    """(3,) the point that the plate's moments are about."""
    return plate.centre_m() if plate.sensor_m is None else plate.sensor_m


class ChannelCourse(Effect):
    """A channel of a plate shows a course too much, whatever it measures."""

    of_the_plates = True

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_plates(scene) for c in CHANNELS)

    def course(self, scene: Scene) -> np.ndarray:
        """(N,) for a size of one."""
        return np.ones(len(scene.times_s))

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        course = values[0] * self.course(scene)
        return in_channel(plate_of(scene, name), CHANNELS.index(channel), course)
