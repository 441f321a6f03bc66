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


ONE, TWO = Equipment(), Equipment(two_plates=True)
PLUG = Equipment("plugin_gait")
PLUG_TWO = Equipment("plugin_gait", two_plates=True)
MEDIAL = Equipment("plugin_gait_medial")
MEDIAL_TWO = Equipment("plugin_gait_medial", two_plates=True)
_SQUAT_SWAY = ("squat", "sway")
_SHANK = ("shank_r", (0.02, -0.05, -0.2))
_HAND = ("hand_r", (0.02, 0.0, -0.07))
_CHEST = ("torso", (0.12, 0.0, 0.2))

NULLS = (
    Case("null-2", Somebody(102, "F", 58.0, 1.64), replace(PLUG_TWO, rate_hz=120)),
    Case(
        "null-3",
        Somebody(103, "F", 69.0, 1.72),
        replace(ONE, rate_hz=200, plate_type=3),
        tasks=("heeldrop", "sway"),
        jolting=True,
    ),
    Case(
        "null-4",
        Somebody(104, "M", 90.0, 1.88),
        replace(MEDIAL_TWO, plate_type=4),
        tasks=("squat", "heeldrop"),
    ),
    Case("null-5", Somebody(105, "M", 65.0, 1.70), replace(TWO, rate_hz=120), tasks=_SQUAT_SWAY),
    Case("null-6", Somebody(106, "F", 72.0, 1.69), PLUG),
    Case("null-7", Somebody(107, "M", 83.0, 1.82), replace(TWO, plate_type=3)),
    Case(
        "null-8",
        Somebody(108, "F", 52.0, 1.58),
        replace(MEDIAL, rate_hz=120),
        tasks=("heeldrop", "steps"),
        jolting=True,
    ),
)
IN_ALL_TRIALS = (
    Case(
        "delay-12ms",
        Somebody(201, "M", 81.0, 1.83),
        TWO,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("delay", 0.012),),
    ),
    Case("delay-6ms", Somebody(211, "F", 64.0, 1.71), MEDIAL, hidden=(Hidden("delay", 0.006),)),
    Case(
        "shift-20mm", Somebody(202, "F", 66.0, 1.70), MEDIAL, hidden=(Hidden("shift", (0.020, 0)),)
    ),
    Case("shift-15mm", Somebody(215, "M", 71.0, 1.79), TWO, hidden=(Hidden("shift", (0, 0.015)),)),
    Case("yaw-3deg", Somebody(207, "F", 55.0, 1.60), ONE, hidden=(Hidden("yaw", 3.0),)),
    Case(
        "gain-3.5-percent",
        Somebody(206, "M", 84.0, 1.86),
        replace(TWO, plate_type=4),
        hidden=(Hidden("gain", 0.035),),
    ),
    Case("crosstalk", Somebody(209, "F", 60.0, 1.67), PLUG, hidden=(Hidden("crosstalk", 0.02, 0),)),
)
IN_ONE_TRIAL = (
    Case(
        "drift-15n",
        Somebody(210, "M", 68.0, 1.74),
        TWO,
        hidden=(Hidden("drift", 15.0, task="squat"),),
    ),
    Case(
        "worn-on-shank",
        Somebody(203, "F", 61.0, 1.66),
        ONE,
        hidden=(Hidden("worn", 1.2, _SHANK, "squat"),),
    ),
    Case(
        "worn-on-chest",
        Somebody(214, "M", 88.0, 1.84),
        MEDIAL_TWO,
        hidden=(Hidden("worn", 1.0, _CHEST, "steps"),),
    ),
    Case(
        "dropped",
        Somebody(208, "M", 79.0, 1.78),
        ONE,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("dropped", 0.6, "hand_r", "sway"),),
    ),
    Case(
        "touch-by-right",
        Somebody(205, "M", 72.0, 1.76),
        ONE,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("touch", 30.0, "hand_r", "sway"),),
    ),
    Case(
        "touch-by-left",
        Somebody(213, "F", 59.0, 1.64),
        PLUG_TWO,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("touch", 35.0, "hand_l", "sway"),),
    ),
    Case(
        "slipped-marker",
        Somebody(204, "M", 77.0, 1.80),
        PLUG_TWO,
        hidden=(Hidden("slip", (0.0, 0.0, 0.03), "RKNE", "steps"),),
    ),
    Case(
        "misplaced-marker",
        Somebody(212, "F", 67.0, 1.65),
        ONE,
        hidden=(Hidden("marker", (0.03, 0.0, 0.0), "LMALL", "squat"),),
    ),
)
# Made after everything above had led to rules.
LATER = (
    Case(
        "clock-300ppm", Somebody(401, "F", 68.0, 1.73), MEDIAL_TWO, hidden=(Hidden("clock", 300),)
    ),
    Case(
        "wobbling-4kg",
        Somebody(402, "M", 95.0, 1.81),
        ONE,
        tasks=("heeldrop", "squat"),
        hidden=(Hidden("wobble", 4.0, "pelvis", "heeldrop"),),
    ),
    Case(
        "gain-of-one-plate",
        Somebody(403, "F", 62.0, 1.69),
        replace(TWO, rate_hz=120),
        hidden=(Hidden("gain", 0.045, 0),),
    ),
    Case(
        "gain-in-one-trial",
        Somebody(404, "M", 73.0, 1.78),
        PLUG,
        hidden=(Hidden("gain", -0.03, task="squat"),),
    ),
    Case(
        "yaw-2deg",
        Somebody(405, "M", 80.0, 1.85),
        replace(MEDIAL, plate_type=3),
        hidden=(Hidden("yaw", -2.0),),
    ),
    Case("yaw-of-both", Somebody(412, "M", 78.0, 1.79), TWO, hidden=(Hidden("yaw", 2.5),)),
    Case(
        "crosstalk-of-both",
        Somebody(413, "F", 63.0, 1.68),
        replace(MEDIAL_TWO, rate_hz=120),
        hidden=(Hidden("crosstalk", -0.02, 0),),
    ),
    Case(
        "dropped-by-left",
        Somebody(406, "F", 57.0, 1.62),
        PLUG_TWO,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("dropped", 0.4, "hand_l", "sway"),),
    ),
    Case(
        "worn-on-hand",
        Somebody(407, "M", 76.0, 1.80),
        TWO,
        tasks=_SQUAT_SWAY,
        hidden=(Hidden("worn", 0.7, _HAND, "sway"),),
    ),
    Case(
        "slipped-ankle",
        Somebody(408, "F", 65.0, 1.70),
        ONE,
        hidden=(Hidden("slip", (0.025, 0.0, 0.0), "LMALL", "squat"),),
    ),
    Case("second-bend", Somebody(414, "M", 74.0, 1.77), ONE, hidden=(Hidden("bend", 0.5),)),
    Case("slight-bend", Somebody(415, "F", 66.0, 1.72), MEDIAL_TWO, hidden=(Hidden("bend", 0.3),)),
    Case(
        "delay-and-worn",
        Somebody(409, "M", 85.0, 1.88),
        MEDIAL,
        hidden=(Hidden("delay", 0.010), Hidden("worn", 1.2, _HAND, "squat")),
    ),
    Case(
        "yaw-and-drift",
        Somebody(410, "F", 70.0, 1.74),
        ONE,
        hidden=(Hidden("yaw", 3.0), Hidden("drift", 15.0, task="squat")),
    ),
    Case(
        "shift-and-crosstalk",
        Somebody(411, "M", 69.0, 1.72),
        PLUG,
        hidden=(Hidden("shift", (0.02, 0.01)), Hidden("crosstalk", 0.02, 1)),
    ),
)
# Not in the diagnosis' catalogue as such: at best it says that something is wrong.
OUTSIDE = (
    Case("lowpass-3hz", Somebody(301, "M", 70.0, 1.75), ONE, hidden=(Hidden("lowpass", 3.0),)),
    Case("tether", Somebody(302, "F", 63.0, 1.68), MEDIAL_TWO, hidden=(Hidden("tether", 80.0),)),
    Case("nonlinear", Somebody(303, "M", 75.0, 1.77), ONE, hidden=(Hidden("nonlinear", 0.10),)),
    Case("clipped", Somebody(304, "F", 70.0, 1.73), ONE, hidden=(Hidden("clipped", 1.08),)),
)
CASES = (*NULLS, *IN_ALL_TRIALS, *IN_ONE_TRIAL, *LATER, *OUTSIDE)
