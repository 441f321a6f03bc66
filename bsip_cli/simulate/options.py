"""What a simulated study may vary, and ready-made studies. Every richness can be turned off."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from bsip_cli.files.regular import read_toml

ALL_TASKS = ("static", "sequence", "throwing", "basketball", "squat", "steps", "walking", "running")
MORE_TASKS = ("hops", "stepon", "postures")


@dataclass(frozen=True)
class Richness:
    """How much the simulated world differs from the model that is fitted to it.

    soft_tissue : scale of the markers' motion against the bone (0 = rigid).
    measured_tissue : whether it is that of measured people (`people`): larger on trunk and
        thighs, curved in the pose, and swinging with part of the segments' mass.
    marker_noise_m : white noise, standard deviation per axis.
    marker_drift_m : slow correlated noise, standard deviation per axis.
    gaps : whether markers get lost for 5 to 40 frames.
    force_noise_n, moment_noise_nm : white noise of the analog channels.
    quantised : whether the analog channels are rounded to a 16-bit step.
    hinge_tilt : scale of the tilt of elbow and knee axes against their segment's Z.
    joint_centre_offset : scale of the true joint centres' distance from the regressions.
    placement_error_m : marker placement, standard deviation per axis.
    inertia_variation : scale of the person's distance from the mean person.
    girdle : whether the shoulders move against the thorax, seen by 51 markers instead of 38.
    """

    soft_tissue: float = 1.0
    measured_tissue: bool = False
    marker_noise_m: float = 0.0003
    marker_drift_m: float = 0.0001
    gaps: bool = True
    force_noise_n: float = 1.0
    moment_noise_nm: float = 0.3
    quantised: bool = True
    hinge_tilt: float = 1.0
    joint_centre_offset: float = 1.0
    placement_error_m: float = 0.005
    inertia_variation: float = 1.0
    girdle: bool = False


@dataclass(frozen=True)
class Rates:
    """Sampling rates [Hz]; the analog rate is a multiple of the marker rate.

    Both must divide the simulation's 1000 Hz.
    """

    marker_hz: int = 100
    analog_hz: int = 1000


@dataclass(frozen=True)
class Laboratory:
    """Where the plates and the person are in the lab (Z up).

    plate_size_m : along and across the walking direction.
    plate_centre_m : of the first plate, X and Y in the lab.
    facing_deg : heading of the walking direction from lab X, counter-clockwise.
    plates : 1, or 2: a second plate lies ahead of the first and stays unloaded
        unless a foot treads on it.
    plate_per_foot : instead of the first plate two, left and right of its middle line; the feet
        push against each other along the floor, as feet do.
    plate_depth_m : depth of the transducers' origin under the surface.
    """

    plate_size_m: tuple[float, float] = (0.6, 1.2)
    plate_centre_m: tuple[float, float] = (0.70, 0.40)
    facing_deg: float = 90.0
    plates: int = 1
    plate_per_foot: bool = False
    plate_depth_m: float = 0.048


@dataclass(frozen=True)
class Asked:
    """One effect as asked for; `target` as on the command line, may be empty."""

    name: str
    size: float
    target: str = ""


@dataclass(frozen=True)
class StudyOptions:
    """A whole simulated study.

    durations_s : of the tasks whose length can be chosen.
    rates : by task name; "default" serves the others.
    ball_mass_kg : range from which the thrown ball's mass is drawn.
    sexes : one letter per participant, or empty to draw them alternately.
    run : number of the recordings; each draws its own movement of the same person.
    effects : hidden in the recordings. effect_tasks : in these tasks only; empty: wherever
        each effect usually is.
    """

    participants: int = 6
    seed: int = 1
    tasks: tuple[str, ...] = ALL_TASKS
    durations_s: dict[str, float] = field(default_factory=dict)
    rates: dict[str, Rates] = field(default_factory=lambda: {"default": Rates()})
    richness: Richness = field(default_factory=Richness)
    laboratory: Laboratory = field(default_factory=Laboratory)
    ball_mass_kg: tuple[float, float] = (0.15, 0.40)
    sexes: str = ""
    run: int = 1
    effects: tuple[Asked, ...] = ()
    effect_tasks: tuple[str, ...] = ()

    def rates_of(self, task: str) -> Rates:
        return self.rates.get(task, self.rates.get("default", Rates()))


PRESETS = {
    name: StudyOptions(
        **row
        | {"tasks": tuple(row["durations_s"])}
        | {"rates": {task: Rates(*hz) for task, hz in row["rates"].items()}}
    )
    for name, row in read_toml(Path(__file__).parent / "presets.toml").items()
}
