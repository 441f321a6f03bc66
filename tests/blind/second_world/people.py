"""The people of the second world, their labs, and what is hidden in their recordings."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tests.blind.second_world.effects import Hidden


@dataclass(frozen=True)
class Somebody:
    """seed : of the body, the lab's errors and the movements."""

    seed: int
    sex: str
    mass_kg: float
    height_m: float


@dataclass(frozen=True)
class Equipment:
    """plate_type : 2, 3 or 4, as C3D numbers them; two_plates : one for each foot."""

    marker_set: str = "hansen2017"
    rate_hz: int = 100
    plate_type: int = 2
    two_plates: bool = False


@dataclass(frozen=True)
class Case:
    """One person in one lab.

    tasks : besides static and sequence. jolting : skin that rings when a heel strikes.
    """

    name: str
    somebody: Somebody
    equipment: Equipment
    tasks: tuple[str, ...] = ("squat", "steps")
    hidden: tuple[Hidden, ...] = ()
    jolting: bool = False


def _case(
    name: str,
    who: str,
    equipment: Equipment,
    *hidden: Hidden,
    tasks: str = "",
    jolting: bool = False,
) -> Case:
    """who : seed, sex, mass [kg] and height [m]. tasks : squats and that which shows what is
    hidden, unless told."""
    shown = next((one.task for one in hidden if one.task not in (None, "squat")), "steps")
    seed, sex, mass_kg, height_m = who.split()
    somebody = Somebody(int(seed), sex, float(mass_kg), float(height_m))
    return Case(
        name, somebody, equipment, tuple((tasks or f"squat {shown}").split()), hidden, jolting
    )


ONE, TWO = Equipment(), Equipment(two_plates=True)
PLUG = Equipment("plugin_gait")
PLUG_TWO = Equipment("plugin_gait", two_plates=True)
MEDIAL = Equipment("plugin_gait_medial")
MEDIAL_TWO = Equipment("plugin_gait_medial", two_plates=True)
_SHANK = ("shank_r", (0.02, -0.05, -0.2))
_HAND = ("hand_r", (0.02, 0.0, -0.07))
_CHEST = ("torso", (0.12, 0.0, 0.2))

NULLS = (
    _case("null-2", "102 F 58.0 1.64", replace(PLUG_TWO, rate_hz=120)),
    _case(
        "null-3",
        "103 F 69.0 1.72",
        replace(ONE, rate_hz=200, plate_type=3),
        tasks="heeldrop sway",
        jolting=True,
    ),
    _case("null-4", "104 M 90.0 1.88", replace(MEDIAL_TWO, plate_type=4), tasks="squat heeldrop"),
    _case("null-5", "105 M 65.0 1.70", replace(TWO, rate_hz=120), tasks="squat sway"),
    _case("null-6", "106 F 72.0 1.69", PLUG),
    _case("null-7", "107 M 83.0 1.82", replace(TWO, plate_type=3)),
    _case(
        "null-8",
        "108 F 52.0 1.58",
        replace(MEDIAL, rate_hz=120),
        tasks="heeldrop steps",
        jolting=True,
    ),
)
IN_ALL_TRIALS = (
    _case("delay-12ms", "201 M 81.0 1.83", TWO, Hidden("delay", 0.012), tasks="squat sway"),
    _case("delay-6ms", "211 F 64.0 1.71", MEDIAL, Hidden("delay", 0.006)),
    _case("shift-20mm", "202 F 66.0 1.70", MEDIAL, Hidden("shift", (0.020, 0))),
    _case("shift-15mm", "215 M 71.0 1.79", TWO, Hidden("shift", (0, 0.015))),
    _case("yaw-3deg", "207 F 55.0 1.60", ONE, Hidden("yaw", 3.0)),
    _case("gain-3.5-percent", "206 M 84.0 1.86", replace(TWO, plate_type=4), Hidden("gain", 0.035)),
    _case("crosstalk", "209 F 60.0 1.67", PLUG, Hidden("crosstalk", 0.02, 0)),
)
IN_ONE_TRIAL = (
    _case("drift-15n", "210 M 68.0 1.74", TWO, Hidden("drift", 15.0, task="squat")),
    _case("worn-on-shank", "203 F 61.0 1.66", ONE, Hidden("worn", 1.2, _SHANK, "squat")),
    _case("worn-on-chest", "214 M 88.0 1.84", MEDIAL_TWO, Hidden("worn", 1.0, _CHEST, "steps")),
    _case("dropped", "208 M 79.0 1.78", ONE, Hidden("dropped", 0.6, "hand_r", "sway")),
    _case("touch-by-right", "205 M 72.0 1.76", ONE, Hidden("touch", 30.0, "hand_r", "sway")),
    _case("touch-by-left", "213 F 59.0 1.64", PLUG_TWO, Hidden("touch", 35.0, "hand_l", "sway")),
    _case(
        "slipped-marker",
        "204 M 77.0 1.80",
        PLUG_TWO,
        Hidden("slip", (0.0, 0.0, 0.03), "RKNE", "steps"),
    ),
    _case(
        "misplaced-marker",
        "212 F 67.0 1.65",
        ONE,
        Hidden("marker", (0.03, 0.0, 0.0), "LMALL", "squat"),
    ),
)
# Made after everything above had led to rules.
LATER = (
    _case("clock-300ppm", "401 F 68.0 1.73", MEDIAL_TWO, Hidden("clock", 300)),
    _case(
        "wobbling-4kg",
        "402 M 95.0 1.81",
        ONE,
        Hidden("wobble", 4.0, "pelvis", "heeldrop"),
        tasks="heeldrop squat",
    ),
    _case(
        "gain-of-one-plate", "403 F 62.0 1.69", replace(TWO, rate_hz=120), Hidden("gain", 0.045, 0)
    ),
    _case("gain-in-one-trial", "404 M 73.0 1.78", PLUG, Hidden("gain", -0.03, task="squat")),
    _case("yaw-2deg", "405 M 80.0 1.85", replace(MEDIAL, plate_type=3), Hidden("yaw", -2.0)),
    _case("yaw-of-both", "412 M 78.0 1.79", TWO, Hidden("yaw", 2.5)),
    _case(
        "crosstalk-of-both",
        "413 F 63.0 1.68",
        replace(MEDIAL_TWO, rate_hz=120),
        Hidden("crosstalk", -0.02, 0),
    ),
    _case("dropped-by-left", "406 F 57.0 1.62", PLUG_TWO, Hidden("dropped", 0.4, "hand_l", "sway")),
    _case("worn-on-hand", "407 M 76.0 1.80", TWO, Hidden("worn", 0.7, _HAND, "sway")),
    _case(
        "slipped-ankle", "408 F 65.0 1.70", ONE, Hidden("slip", (0.025, 0.0, 0.0), "LMALL", "squat")
    ),
    _case("second-bend", "414 M 74.0 1.77", ONE, Hidden("bend", 0.5)),
    _case("slight-bend", "415 F 66.0 1.72", MEDIAL_TWO, Hidden("bend", 0.3)),
    _case(
        "delay-and-worn",
        "409 M 85.0 1.88",
        MEDIAL,
        Hidden("delay", 0.010),
        Hidden("worn", 1.2, _HAND, "squat"),
    ),
    _case(
        "yaw-and-drift",
        "410 F 70.0 1.74",
        ONE,
        Hidden("yaw", 3.0),
        Hidden("drift", 15.0, task="squat"),
    ),
    _case(
        "shift-and-crosstalk",
        "411 M 69.0 1.72",
        PLUG,
        Hidden("shift", (0.02, 0.01)),
        Hidden("crosstalk", 0.02, 1),
    ),
)
# Not in the diagnosis' catalogue as such: at best it says that something is wrong.
OUTSIDE = (
    _case("lowpass-3hz", "301 M 70.0 1.75", ONE, Hidden("lowpass", 3.0)),
    _case("tether", "302 F 63.0 1.68", MEDIAL_TWO, Hidden("tether", 80.0)),
    _case("nonlinear", "303 M 75.0 1.77", ONE, Hidden("nonlinear", 0.10)),
    _case("clipped", "304 F 70.0 1.73", ONE, Hidden("clipped", 1.08)),
)
CASES = (*NULLS, *IN_ALL_TRIALS, *IN_ONE_TRIAL, *LATER, *OUTSIDE)
