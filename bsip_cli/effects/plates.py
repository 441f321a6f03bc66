"""What a laboratory gets wrong: its force plates, its clocks and its axes.

A channel, as the diagnosis names it ("1 fz"), is a component of the force or moment *on the body*
about the plate's sensor, in the plate's own axes turned about x until z points up. So a person who
stands reads a positive fz, and an offset of +10 N in fz makes everybody seem 1 kg heavier."""

from __future__ import annotations

from abc import abstractmethod
from itertools import permutations
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.ground_wrench import move_moments
from bsip_cli.dynamics.segment_motion import UP
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.scene import Plate, Scene

CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")
ALL = "all"  # every plate alike: one amplifier, or one lab whose origin is not where it is said
_WORDS = (
    *("the horizontal force along {} x axis", "the horizontal force along {} y axis"),
    *("the vertical force", "the moment about {} x axis", "the moment about {} y axis"),
    "the moment about the vertical",
)
OF_A_PLATE = {k: x.format("the plate's") for k, x in zip(CHANNELS, _WORDS, strict=True)}
OF_THE_LAB = {
    k: x.format("the lab's").replace(" x ", " X ").replace(" y ", " Y ")
    for k, x in zip(CHANNELS, _WORDS, strict=True)
}


def unit_of(channel: str) -> str:
    """``N`` of a force, ``N m`` of a moment."""
    return "N" if channel.startswith("f") else "N m"


def loaded_plates(scene: Scene, least_N: float = 50.0) -> tuple[str, ...]:
    """Names of the plates that carry something in valid frames."""
    return tuple(
        plate.name
        for plate in scene.plates
        if scene.valid.any() and np.nanmax(plate.wrench[scene.valid, 2]) > least_N
    )


def plates_of(scene: Scene, name: str) -> tuple[Plate, ...]:
    """The plate of a name, which the scene must have; those that carry something for ``all``."""
    by_name = {plate.name: plate for plate in scene.plates}
    return tuple(by_name[one] for one in (loaded_plates(scene) if name == ALL else (name,)))


def plates_called(name: str) -> str:
    """``plate 1`` or ``all plates``."""
    return "all plates" if name == ALL else f"plate {name}"


def in_channels(plate: Plate, amounts: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin where each channel shows so much (6,) of a signal
    (N,)."""
    reading = signal[:, None] * amounts
    force, moment = (part @ plate.axes() for part in np.hsplit(reading, 2))
    return np.hstack([force, moment + np.cross(plate.moments_about_m(), force)])


def shown(plate: Plate, channel: int) -> np.ndarray:
    """(N,) what a channel shows, 0 where there is no reading."""
    about = move_moments(np.nan_to_num(plate.wrench), plate.moments_about_m())
    return np.hstack([part @ plate.axes().T for part in np.hsplit(about, 2)])[:, channel]


class OfPlates(Effect):
    """Of one plate that carries something or, where they are several, of all of them together.

    ``channels`` : in which channels of it; none where it is the plate's as a whole. ``of_all`` :
    whether all plates may have it alike.
    """

    scope = "laboratory"
    of_the_plates = True
    of_the_forces = True
    channels: ClassVar[tuple[str, ...]] = ()
    of_all: ClassVar[bool] = True

    def targets(self, scene: Scene) -> tuple[str, ...]:
        loaded = loaded_plates(scene)
        plates = (*loaded, ALL) if self.of_all and len(loaded) > 1 else loaded
        return tuple(f"{p} {c}".strip() for p in plates for c in self.channels or ("",))

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        """And the plates with their verb, and the channels in words."""
        name, *channel = target.split(" ")
        known = super().spoken(scene, target, values) | {"plates": plates_called(name)}
        known |= {"s": "", "are": "are"} if name == ALL else {"s": "s", "are": "is"}
        for one in channel:
            known |= {"channel": OF_A_PLATE[one[:2]], "other": OF_A_PLATE[one[-2:]]}
            known["unit"] = unit_of(one)
        return known


_ASIDE_M = 0.15  # of any place on a plate of 0.4 by 0.6 m from its middle: standard deviation
_FARTHEST_M = 0.5
# moments of a force in a channel about a middle that is not known
_TURNS_ABOUT = {"fx": ("mz",), "fy": ("mz",), "fz": ("mx", "my")}


class OfAChannel(OfPlates):
    """A channel shows so much of a signal.

    Its force acts in the plate's middle. Where the file does not say where that is, its moments are
    numbers more: a misplaced middle is not taken for another fault.
    """

    @abstractmethod
    def signal(self, scene: Scene, plate: Plate, channel: str) -> np.ndarray:
        """(N,) for a size of one."""

    def share(self, size: float) -> float:
        """Of the signal, in what the channel shows."""
        return size

    def size(self, scene: Scene, target: str) -> Parameter:
        """What a person reads."""
        return self.numbers[0]

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        size = self.size(scene, target)
        most, typical = _FARTHEST_M * size.most, _ASIDE_M * size.typical
        unit = "m" if size.unit == "1" else size.unit.replace("N", "N m")
        names = (f"{size.name}_{one[-1]}" for one in self._turning(scene, target))
        return (size, *(Parameter(name, unit, -most, most, typical) for name in names))

    def _turning(self, scene: Scene, target: str) -> tuple[str, ...]:
        name, channel = target.split(" ")
        # what a laboratory says of its plates is of no trial
        placed = scene is None or all(plate.is_placed for plate in plates_of(scene, name))
        return () if placed else _TURNS_ABOUT.get(channel[-2:], ())

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        (name, channel), amounts = target.split(" "), np.zeros(6)
        shown_in = (channel[-2:], *self._turning(scene, target))
        amounts[[CHANNELS.index(one) for one in shown_in]] = self.share(values[0]), *values[1:]
        plates = plates_of(scene, name)
        return np.sum(
            [in_channels(p, amounts, self.signal(scene, p, channel)) for p in plates], axis=0
        )

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """And the middle is not far away: that is another place of the plate."""
        size, *moments = np.abs(values)
        least = 0.1 * self.size(scene, target).typical
        near = all(one < _FARTHEST_M * (size + least) for one in moments)
        return near and super().possible(scene, target, values)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The size alone."""
        return super().reported(scene, target, values)[:1]


class OwnSignal(OfAChannel):
    """Whatever the channel of one plate measures, but where software has written zeros since."""

    channels = CHANNELS
    of_all = False

    def signal(self, scene: Scene, plate: Plate, channel: str) -> np.ndarray:
        shows = np.ones(len(scene.times_s))
        return shows if plate.silent is None else np.where(plate.silent, 0.0, shows)


class PlateZero(OwnSignal):
    """A force plate's channel with a constant offset."""

    def is_shared_at(self, scene: Scene, target: str) -> bool:
        (plate,) = plates_of(scene, target.split(" ")[0])
        return not plate.zeroed

    def size(self, scene: Scene, target: str) -> Parameter:
        unit = unit_of(target.split(" ")[1])
        bounds = (-200.0, 200.0, 10.0) if unit == "N" else (-100.0, 100.0, 5.0)
        return Parameter("offset", unit, *bounds)


class PlateDrift(OwnSignal):
    """A force plate's channel that drifts through the trial.

    Linear, zero where the trial begins.
    """

    def size(self, scene: Scene, target: str) -> Parameter:
        unit, duration = unit_of(target.split(" ")[1]), float(np.ptp(scene.times_s))
        most, typical = (20.0, 15.0) if unit == "N" else (10.0, 7.0)
        return Parameter("drift", f"{unit}/s", -most, most, typical / duration)

    def signal(self, scene: Scene, plate: Plate, channel: str) -> np.ndarray:
        return super().signal(scene, plate, channel) * (scene.times_s - scene.times_s[0])


class PlateGain(OfAChannel):
    """Force plates whose forces are scaled wrongly.

    One force channel, in the own axes of a plate or of all, shows 1 + gain times the truth.
    """

    channels = CHANNELS[:3]

    def share(self, size: float) -> float:
        return size / (1 + size)

    def signal(self, scene: Scene, plate: Plate, channel: str) -> np.ndarray:
        return shown(plate, CHANNELS.index(channel))


class PlateCrosstalk(OfAChannel):
    """A channel of a force plate that leaks into another.

    A force channel also shows a part of another one, in one plate or, with the same amplifiers
    and no calibration, in all.
    """

    channels = tuple(f"{a}>{b}" for a, b in permutations(CHANNELS[:3], 2))

    def signal(self, scene: Scene, plate: Plate, channel: str) -> np.ndarray:
        return shown(plate, CHANNELS.index(channel[:2]))


class PlateRotation(OfPlates):
    """Force plates that are turned against what the file says.

    The plate is truly turned about its centre, or all plates about the middle of their centres:
    measured are the true vectors turned back.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        plates = plates_of(scene, target)
        wrench = np.sum([np.nan_to_num(plate.wrench) for plate in plates], axis=0)
        centre = np.mean([plate.centre_m() for plate in plates], axis=0)
        force, moment = np.hsplit(move_moments(wrench, centre), 2)
        true = Rotation.from_rotvec([*values]).as_matrix().T  # it refuses read-only arrays
        change = np.hstack([force - force @ true, moment - moment @ true])
        return move_moments(change, -centre)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        """A tenth of a degree is not worth a word."""
        known, tilt = self.spoken(scene, target, values), np.degrees(np.hypot(*values[:2]))
        turned = f"turned by {known['yaw']:+.1f} degrees about the vertical"
        tilted = f"tilted by {tilt:.1f} degrees"
        said = [turned] if tilt < 0.1 else [tilted] if abs(known["yaw"]) < 0.1 else [turned, tilted]
        what = f"{known['plates']} {known['are']} {' and '.join(said)}"
        return Words(what, is_signed=turned in said)


class PlateTranslation(OfPlates):
    """Force plates that lie elsewhere than the file says.

    The plate, or every plate, truly lies at its stated place plus the shift: the measured moment
    lacks shift x force.

    Feet deform where they press, and a body whose mass lies ahead of the model's looks alike; the
    height shows only where forces point sideways, and there arms heavier than the model's do. Far
    away is a plate that was moved; its height is off by the depth of its sensors, if by anything.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        loads = [np.nan_to_num(plate.wrench[:, :3]) for plate in plates_of(scene, target)]
        force = np.sum(loads, axis=0)
        return np.hstack([np.zeros_like(force), -np.cross(values, force)])

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        """The height if it is more than 20 mm, by which bodies of another table seem to be higher
        or lower, and more than it is sideways; or three times as much."""
        known = super().spoken(scene, target, values)
        z, sideways = known["z"], np.hypot(known["x"], known["y"])
        height = f", height {z:+.0f} mm" if abs(z) > min(60.0, max(20.0, sideways)) else ""
        return known | {"sideways": sideways, "height": height}


# --- clocks of cameras and plates that do not agree -----------------------------------------------


class Delay(Effect):
    """The forces come late against the markers."""

    scope = "laboratory"
    of_the_forces = True
    is_signed = False

    @abstractmethod
    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(N,) how late the forces of each frame were recorded [s]."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return corrected(scene, self.late_s(scene, values))


class SyncOffset(Delay):
    """The forces come late against the markers."""

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return np.full(len(scene.times_s), values[0])


class ClockDrift(Delay):
    """The plates' clock runs at another rate than the cameras'.

    The delay is zero where the trial begins and grows evenly.
    """

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s - scene.times_s[0])


class FrameRate(Effect):
    """Recordings at another rate than the file states.

    Markers and plates keep step, so only what accelerates is too large or too small.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return ((1 + values[0]) ** 2 - 1) * (scene.predicted - scene.at_rest)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("rate_ratio", "1", 1 + float(values[0])),)


def corrected(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) the measured wrench less the same corrected by (N,) seconds; the trial's ends stay.

    From the measured signal: the simulated one holds the noise of the motion, whose derivative
    would make every delay seem smaller than it is.
    """
    return scene.measured - scene.measured_signal(right_times_s(scene, late_s))


def right_times_s(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N,) when the forces that belong to each frame were recorded, inside the trial."""
    return np.clip(scene.times_s + late_s, scene.times_s[0], scene.times_s[-1])


# --- axes of the lab and of the cameras that are not those of plates and gravity ------------------


class Turned(Effect):
    """Something of the lab is turned against the rest by the angles about x and y (rotation
    vector)."""

    scope = "laboratory"
    numbers = tuple(Parameter(f"angle_{axis}", "rad", -0.2, 0.2, 0.01) for axis in "xy")
    is_signed = False

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The angle, and its parts about the lab's axes."""
        parts = super().reported(scene, target, values)
        return (("angle", "rad", float(np.hypot(*values))), *parts)


class GravityTilt(Turned):
    """A lab whose Z axis is not the vertical.

    The lab's axes are turned against the world by the angles about x and y (rotation vector).

    Markers and plates are turned together, so only gravity does not point down the lab's Z.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        down = scene.model.gravity.linear
        turned = Rotation.from_rotvec([values[0], values[1], 0.0]).apply(down)
        weight = scene.mass_kg * (down - turned)
        force = np.broadcast_to(weight, (len(scene.times_s), 3))
        return np.hstack([force, np.cross(scene.centre_of_mass_m, force)])


class CameraFrame(Turned):
    """Cameras whose axes are turned against plates and gravity.

    All markers are turned about the origin by the angles about x and y (rotation vector).

    A turn about the vertical is one of all plates the other way: ``plate_rotation``.
    """

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The same motion turned back, under the same gravity."""
        weight = scene.mass_kg * GRAVITY_M_S2 * UP
        centre = scene.centre_of_mass_m
        back = Rotation.from_rotvec([-values[0], -values[1], 0.0]).as_matrix().T
        force, moment = np.split(scene.predicted - scene.at_rest, 2, axis=1)
        moved = centre @ back - centre
        return np.hstack([force @ back - force, moment @ back - moment + np.cross(moved, weight)])
