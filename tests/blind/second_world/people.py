"""The people of the second world, their labs, and what is hidden in their recordings."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.blind.second_world.effects import Hidden
from tests.blind.second_world.lab import Equipment


@dataclass(frozen=True)
class Somebody:
    """seed : of the body, the lab's errors and the movements."""

    seed: int
    sex: str
    mass_kg: float
    height_m: float


@dataclass(frozen=True)
class Case:
    """One person in one lab.

    tasks : besides static and sequence. jolting : skin that rings when a heel strikes.
    """

    name: str
    somebody: Somebody
    equipment: Equipment
    tasks: tuple[str, ...]
    hidden: tuple[Hidden, ...] = ()
    jolting: bool = False


def _known(name: str, who: str, lab: str, tasks: str, hidden: Any = (), **skin: bool) -> Case:
    """A case as `cases.toml` has it."""
    seed, sex, mass_kg, height_m = who.split()
    marker_set, rate_hz, plate_type, plates = lab.split()
    somebody = Somebody(int(seed), sex, float(mass_kg), float(height_m))
    equipment = Equipment(marker_set, int(rate_hz), int(plate_type), plates == "2")
    effects = tuple(Hidden(**{k: _fixed(x) for k, x in one.items()}) for one in hidden)
    return Case(name, somebody, equipment, tuple(tasks.split()), effects, **skin)


def _fixed(value: Any) -> Any:
    return tuple(map(_fixed, value)) if isinstance(value, list) else value


_FILE = Path(__file__).with_name("cases.toml")
CASES = tuple(_known(**row) for row in tomllib.loads(_FILE.read_text("utf-8"))["cases"])


# --- people whom nobody has looked at: drawn from a seed, like what is hidden ---------------------


NULLS = 10
_MARKER_SETS = ("hansen2017", "plugin_gait", "plugin_gait_medial")
_TASKS = ("squat steps", "squat sway", "heeldrop squat", "sway steps", "heeldrop steps")
_HANDS = ("hand_r", "hand_l")
_IN_HAND = (0.02, 0.0, -0.07)


def drawn_cases(seed: int) -> tuple[Case, ...]:
    """Ten people with nothing hidden, and one for every way to hide something, with sizes that
    labs meet."""
    rng = np.random.default_rng(seed)
    nulls = []
    for k in range(1, NULLS + 1):
        tasks = _TASKS[rng.integers(len(_TASKS))].split()
        jolting = "heeldrop" in tasks and bool(rng.integers(2))
        somebody = _somebody(1000 * seed + k, rng)
        nulls.append(Case(f"null-{k}", somebody, _equipment(rng), tuple(tasks), jolting=jolting))
    hidden = _hidden(rng)
    return (*nulls, *(_case(1000 * seed + 100 + k, one, rng) for k, one in enumerate(hidden)))


def _case(seed: int, hidden: tuple[Hidden, ...], rng: np.random.Generator) -> Case:
    """In two tasks of which one shows it; slips are of a marker that one marker set has."""
    name = "-and-".join(one.effect for one in hidden)
    own = {one.task for one in hidden} - {None, "squat"}
    effects = {one.effect for one in hidden}
    marker_sets = _MARKER_SETS[:1] if effects & {"marker", "slip"} else _MARKER_SETS
    tasks = ("squat", *(sorted(own) or ["steps"]))
    return Case(name, _somebody(seed, rng), _equipment(rng, marker_sets), tasks, hidden)


def _somebody(seed: int, rng: np.random.Generator) -> Somebody:
    height_m, body_mass_index = rng.uniform(1.56, 1.90), rng.uniform(19.5, 28.0)
    mass_kg = round(body_mass_index * height_m**2, 1)
    return Somebody(seed, str(rng.choice(["F", "M"])), mass_kg, round(height_m, 2))


def _equipment(rng: np.random.Generator, marker_sets: tuple[str, ...] = _MARKER_SETS) -> Equipment:
    marker_set, rate_hz = str(rng.choice(marker_sets)), int(rng.choice([100, 120, 200]))
    return Equipment(marker_set, rate_hz, int(rng.choice([2, 3, 4])), bool(rng.integers(2)))


def _hidden(rng: np.random.Generator) -> list[tuple[Hidden, ...]]:
    def size(least: float, most: float) -> float:
        return float(f"{rng.uniform(least, most):.3g}")

    def signed(least: float, most: float) -> float:
        return float(rng.choice([-1, 1])) * size(least, most)

    def hand() -> str:
        return str(rng.choice(_HANDS))

    def across(least: float, most: float) -> tuple[float, float]:
        angle, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(least, most)
        return round(float(far * np.cos(angle)), 4), round(float(far * np.sin(angle)), 4)

    return [
        (Hidden("delay", signed(0.005, 0.020)),),
        (Hidden("clock", signed(200, 500)),),
        (Hidden("shift", across(0.010, 0.030)),),
        (Hidden("yaw", signed(1.0, 4.0)),),
        (Hidden("gain", signed(0.02, 0.05), 0),),
        (Hidden("crosstalk", signed(0.01, 0.03), int(rng.integers(2))),),
        (Hidden("drift", signed(10.0, 20.0), task="squat"),),
        (Hidden("worn", size(0.5, 1.5), (hand(), _IN_HAND), "squat"),),
        (Hidden("dropped", size(0.3, 0.7), hand(), "sway"),),
        (Hidden("touch", size(20.0, 40.0), hand(), "sway"),),
        (Hidden("marker", (signed(0.02, 0.04), 0.0, 0.0), "LMALL", "squat"),),
        (Hidden("slip", (0.0, 0.0, signed(0.02, 0.04)), "RKNEL", "squat"),),
        (Hidden("wobble", 4.0, "pelvis", "heeldrop"),),
        (Hidden("bend", size(0.3, 0.6)),),
        (Hidden("delay", signed(0.005, 0.020)), Hidden("shift", across(0.010, 0.030))),
        (Hidden("yaw", signed(1.0, 4.0)), Hidden("touch", size(20.0, 40.0), hand(), "sway")),
    ]
