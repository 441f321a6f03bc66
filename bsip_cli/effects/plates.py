"""Force plates that show something else than what is on them.

A channel, as the diagnosis names it ("1 fz"), is a component of the force or moment *on the body*
about the plate's sensor, in the plate's own axes turned about x until z points up. So a person who
stands reads a positive fz, and an offset of +10 N in fz makes everybody seem 1 kg heavier."""

from __future__ import annotations

from abc import abstractmethod
from itertools import permutations
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.scene import Plate, Scene

CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")
ALL = "all"  # every plate alike: one amplifier, or one lab whose origin is not where it is said


def _words(x: str, y: str) -> dict[str, str]:
    """The channels as people say them, along axes of these names."""
    forces = (f"the horizontal force along {axis} axis" for axis in (x, y))
    moments = (f"the moment about {axis} axis" for axis in (x, y))
    words = (*forces, "the vertical force", *moments, "the moment about the vertical")
    return dict(zip(CHANNELS, words, strict=True))


OF_A_PLATE = _words("the plate's x", "the plate's y")
OF_THE_LAB = _words("the lab's X", "the lab's Y")


def unit_of(channel: str) -> str:
    """``N`` of a force, ``N m`` of a moment."""
    return "N" if channel.startswith("f") else "N m"


def plate_of(scene: Scene, name: str) -> Plate:
    """The plate of this name, which the scene must have."""
    return next(plate for plate in scene.plates if plate.name == name)


def loaded_plates(scene: Scene, least_N: float = 50.0) -> tuple[str, ...]:
    """Names of the plates that carry something in valid frames."""
    return tuple(
        plate.name
        for plate in scene.plates
        if scene.valid.any() and np.nanmax(plate.wrench[scene.valid, 2]) > least_N
    )


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


def in_channel(plate: Plate, channel: int, signal: np.ndarray | float) -> np.ndarray:
    """(N, 6) wrench about the world's origin of a signal (N,) that one channel shows."""
    reading = np.zeros((len(plate.wrench), 6))
    reading[:, channel] = signal
    axes = plate.axes()
    force = reading[:, :3] @ axes
    return np.hstack([force, reading[:, 3:] @ axes + np.cross(plate.moments_about_m(), force)])


def shown(plate: Plate, channel: int) -> np.ndarray:
    """(N,) what a channel shows, 0 where there is no reading."""
    wrench, axes = np.nan_to_num(plate.wrench), plate.axes()
    moment = wrench[:, 3:] - np.cross(plate.moments_about_m(), wrench[:, :3])
    return np.hstack([wrench[:, :3] @ axes.T, moment @ axes.T])[:, channel]


class OfPlates(Effect):
    """Of one plate that carries something or, where they are several, of all of them together.

    ``channels`` : in which channels of it; none where it is the plate's as a whole.
    """

    is_of_laboratory = True
    of_the_plates = True
    of_the_forces = True
    channels: tuple[str, ...] = ()

    def targets(self, scene: Scene) -> tuple[str, ...]:
        loaded = loaded_plates(scene)
        plates = (*loaded, ALL) if len(loaded) > 1 else loaded
        return tuple(f"{p} {c}".strip() for p in plates for c in self.channels or ("",))


class OwnSignal(OfPlates):
    """A channel of one plate shows a signal too much, whatever it measures, but where software has
    written zeros since."""

    channels = CHANNELS

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_plates(scene) for c in self.channels)

    def signal(self, scene: Scene) -> np.ndarray:
        """(N,) for a size of one."""
        return np.ones(len(scene.times_s))

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        plate, signal = plate_of(scene, name), values[0] * self.signal(scene)
        if plate.silent is not None:
            signal = np.where(plate.silent, 0.0, signal)
        return in_channel(plate, CHANNELS.index(channel), signal)

    def _reads(self, target: str) -> tuple[str, str]:
        """Whose channel it is in words, and its unit."""
        name, channel = target.rsplit(" ", 1)
        return f"plate {name} reads {OF_A_PLATE[channel]}", unit_of(channel)


class PlateZero(OwnSignal):
    """A force plate's channel with a constant offset."""

    name = "plate_zero"
    looks = "a constant difference in one channel, with and without load"
    remedy = "step off the plate for five seconds"

    def is_shared_at(self, scene: Scene, target: str) -> bool:
        return not plate_of(scene, target.split(" ")[0]).zeroed

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        _, unit = self._reads(target)
        bounds = (-200.0, 200.0, 10.0) if unit == "N" else (-100.0, 100.0, 5.0)
        return (Parameter("offset", unit, *bounds),)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        reads, unit = self._reads(target)
        return Words(f"{reads} with a constant offset of {values[0]:+.1f} {unit}")


class PlateDrift(OwnSignal):
    """A force plate's channel that drifts through the trial.

    Linear, zero where the trial begins.
    """

    name = "plate_drift"
    is_of_laboratory = False
    looks = "a difference in one channel that grows evenly with time"
    remedy = "step off the plate at the beginning and at the end"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        (_, unit), duration = self._reads(target), float(np.ptp(scene.times_s))
        most, typical = (20.0, 15.0) if unit == "N" else (10.0, 7.0)
        return (Parameter("drift", f"{unit}/s", -most, most, typical / duration),)

    def signal(self, scene: Scene) -> np.ndarray:
        return scene.times_s - scene.times_s[0]

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        reads, unit = self._reads(target)
        return Words(f"{reads} with a drift of {values[0]:+.2f} {unit} per second")


class PlateGain(OfPlates):
    """Force plates whose forces are scaled wrongly.

    One force channel, in the own axes of a plate or of all, shows 1 + gain times the truth.
    """

    name = "plate_gain"
    # A quarter of 0.04 is not reported: plates of one lab differ by some tenths of a percent.
    numbers = (Parameter("gain", "1", -0.6, 1.5, 0.04),)  # an amplifier at another range
    channels = CHANNELS[:3]
    looks = (
        "forces of one plate or channel are too large or too small in proportion; in "
        "stance the mass is off by the same part"
    )
    remedy = "weigh the person on a scale; lay a known weight on the plate"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        share, k = values[0] / (1 + values[0]), CHANNELS.index(channel)
        parts = [in_channel(p, k, share * shown(p, k)) for p in plates_of(scene, name)]
        return np.sum(parts, axis=0)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        name, channel = target.rsplit(" ", 1)
        order = "large" if values[0] > 0 else "small"
        reads = plates_that(name, "reads", "read")
        what = f"{reads} {OF_A_PLATE[channel]} {100 * abs(values[0]):.1f} % too {order}"
        return Words(what, is_signed=False)


class PlateCrosstalk(OfPlates):
    """A channel of a force plate that leaks into another.

    A force channel also shows a part of another one, in one plate or, with the same amplifiers
    and no calibration, in all.
    """

    name = "plate_crosstalk"
    # Makers state 1 to 3 %; what leaks more than 8 is no crosstalk.
    numbers = (Parameter("coefficient", "1", -0.08, 0.08, 0.02),)
    channels = tuple(f"{a}>{b}" for a, b in permutations(CHANNELS[:3], 2))
    looks = (
        "one channel repeats another one, smaller: a horizontal force or a moment with "
        "the shape of the vertical force"
    )
    remedy = "load the plate with a weight at several places"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, pair = target.rsplit(" ", 1)
        source, sink = (CHANNELS.index(c) for c in pair.split(">"))
        leaks = [in_channel(p, sink, shown(p, source)) for p in plates_of(scene, name)]
        return values[0] * np.sum(leaks, axis=0)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        name, pair = target.rsplit(" ", 1)
        source, sink = (OF_A_PLATE[c] for c in pair.split(">"))
        return Words(
            f"{100 * values[0]:+.1f} % of {source} of {plates_called(name)} leaks into {sink}"
        )


class PlateRotation(OfPlates):
    """Force plates that are turned against what the file says.

    The plate is truly turned about its centre, or all plates about the middle of their centres:
    measured are the true vectors turned back.
    """

    name = "plate_rotation"
    numbers = tuple(Parameter(n, "rad", -0.5, 0.5, 0.02) for n in ("tilt_x", "tilt_y", "yaw"))
    looks = (
        "horizontal forces that point aside in proportion to the force on the plate; with"
        " a tilt, a horizontal force in quiet stance"
    )
    remedy = "push forwards and sideways on the plate, turn yourself by 90 degrees and repeat"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        plates = plates_of(scene, target)
        wrench = np.sum([np.nan_to_num(plate.wrench) for plate in plates], axis=0)
        centre = np.mean([plate.centre_m() for plate in plates], axis=0)
        force = wrench[:, :3]
        moment = wrench[:, 3:] - np.cross(centre, force)
        true = Rotation.from_rotvec([*values]).as_matrix().T  # it refuses read-only arrays
        dforce, dmoment = force - force @ true, moment - moment @ true
        return np.hstack([dforce, dmoment + np.cross(centre, dforce)])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        x, y, yaw = np.degrees(values)
        turned = f"turned by {yaw:+.1f} degrees about the vertical"
        tilted = f"tilted by {np.hypot(x, y):.1f} degrees"
        # A tenth of a degree is not worth a word.
        said = (
            [turned] if np.hypot(x, y) < 0.1 else [tilted] if abs(yaw) < 0.1 else [turned, tilted]
        )
        what = f"{plates_that(target, 'is', 'are')} {' and '.join(said)}"
        return Words(what, is_signed=turned in said)


class PlateTranslation(OfPlates):
    """Force plates that lie elsewhere than the file says.

    The plate, or every plate, truly lies at its stated place plus the shift: the measured moment
    lacks shift x force.

    Feet deform where they press, and a body whose mass lies ahead of the model's looks alike; the
    height shows only where forces point sideways, and there arms heavier than the model's do. Far
    away is a plate that was moved; its height is off by the depth of its sensors, if by anything.
    """

    name = "plate_translation"
    numbers = (
        Parameter("x", "m", -0.3, 0.3, 0.02, known_to=0.001),
        Parameter("y", "m", -0.3, 0.3, 0.02, known_to=0.001),
        Parameter("z", "m", -0.1, 0.1, 0.02, known_to=0.015),
    )
    looks = (
        "the measured centre of pressure lies beside the simulated one by the same "
        "distance wherever the person stands; forces agree"
    )
    remedy = "stand on the plate with both feet, then turn by 90 degrees and stand again"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        loads = [np.nan_to_num(plate.wrench[:, :3]) for plate in plates_of(scene, target)]
        force = np.sum(loads, axis=0)
        return np.hstack([np.zeros_like(force), -np.cross(values, force)])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        """The height if it is more than 20 mm, by which bodies of another table seem to be higher
        or lower, and more than it is sideways; or three times as much."""
        x, y, z = 1000 * values
        sideways = np.hypot(x, y)
        height = f", height {z:+.0f} mm" if abs(z) > min(60.0, max(20.0, sideways)) else ""
        lie = plates_that(target, "lies", "lie")
        short = f"{lie} {sideways:.0f} mm sideways from where the file says"
        return Words(f"{short} (lab X {x:+.0f} mm, Y {y:+.0f} mm{height})", short)


# --- clocks of cameras and plates that do not agree -----------------------------------------------

KNOWN_TO_S = 0.0002  # filters of plates and cameras delay a little too
# Quartz keeps 100 ppm and 59.94 for 60 Hz is 1,000: clocks further apart are not two clocks.
MOST_DRIFT = 0.003


class Delay(Effect):
    """The forces come late against the markers."""

    is_of_laboratory = True
    of_the_forces = True

    @abstractmethod
    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(N,) how late the forces of each frame were recorded [s]."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return corrected(scene, self.late_s(scene, values))


class SyncOffset(Delay):
    """The forces come late against the markers."""

    name = "sync_offset"
    numbers = (Parameter("delay", "s", -0.5, 0.5, 0.01, known_to=KNOWN_TO_S),)
    looks = (
        "every rise of the simulated force leads or follows the measured one by the same "
        "time; the error is largest where the force changes fastest"
    )
    remedy = "hop three times in view of cameras and plates"

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return np.full(len(scene.times_s), values[0])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        order = "after" if values[0] > 0 else "before"
        what = f"the forces were recorded {1000 * abs(values[0]):.1f} ms {order} the markers"
        return Words(what, is_signed=False)


class ClockDrift(Delay):
    """The plates' clock runs at another rate than the cameras'.

    The delay is zero where the trial begins and grows evenly.
    """

    name = "clock_drift"
    numbers = (Parameter("rate_error", "1", -MOST_DRIFT, MOST_DRIFT, 3e-4),)
    looks = "a delay that grows through the trial: in step at its beginning, late at its end"
    remedy = "hop at the beginning and at the end of a long recording"

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s - scene.times_s[0])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        order = "slower" if values[0] > 0 else "faster"
        what = f"the plates' clock runs {1e6 * abs(values[0]):.0f} ppm {order} than the cameras'"
        return Words(what, is_signed=False)


class FrameRate(Effect):
    """Recordings at another rate than the file states.

    Markers and plates keep step, so only what accelerates is too large or too small.
    """

    name = "frame_rate"
    is_of_laboratory = True
    numbers = (Parameter("faster", "1", -0.6, 1.5, 0.1),)
    looks = "forces that are smaller or larger than the movement needs, the more, the faster it is"
    remedy = "let a marker fall: 1.2 m takes half a second"
    least_named = MappingProxyType({"faster": 0.04})  # rates in use differ more: 240 and 250 Hz

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return ((1 + values[0]) ** 2 - 1) * (scene.predicted - scene.at_rest)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("rate_ratio", "1", 1 + float(values[0])),)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        return Words(f"all was recorded at {1 + values[0]:.3g} times the rate that the file states")


def corrected(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) the measured wrench less the same corrected by (N,) seconds; the trial's ends stay.

    From the measured signal: the simulated one holds the noise of the motion, whose derivative
    would make every delay seem smaller than it is.
    """
    return scene.measured - scene.measured_signal(right_times_s(scene, late_s))


def right_times_s(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N,) when the forces that belong to each frame were recorded, inside the trial."""
    return np.clip(scene.times_s + late_s, scene.times_s[0], scene.times_s[-1])
