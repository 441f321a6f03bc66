"""Where markers sit on a person, and three marker sets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.blind.second_world.body import HALF_SHOULDERS, SIDES, Body, suprasternale_m, usual_neck_m


@dataclass(frozen=True)
class Landmark:
    """segment : that it is fixed to; place_m : (3,) in that segment's frame."""

    segment: str
    place_m: np.ndarray


def _pairs(text: str) -> dict[str, str]:
    """Landmarks by label, as in "C7 c7, T10 t10"."""
    return dict(pair.split() for pair in text.split(","))


_TRUNK_PLUG_IN = _pairs(
    """C7 c7, T10 t10, STRN xiphoid, CLAV suprasternale, RBAK scapula, RFHD forehead_r,
    LFHD forehead_l, RBHD occiput_r, LBHD occiput_l"""
)
_TRUNK_HANSEN = _pairs(
    """C7 c7, T10 t10, XIPH xiphoid, IJ suprasternale, RSCAP scapula, RTEM temple_r, LTEM temple_l,
    FHEAD forehead"""
)
# Labels without their side, which comes before them.
_SIDES_PLUG_IN = _pairs(
    """SHO acromion, ASI asis, PSI psis, UPA upper_arm, ELB elbow, FRM forearm, WRA radius,
    WRB ulna, FIN knuckle, THI thigh, KNE knee_lateral, TIB shank, ANK ankle_lateral,
    HEE heel, TOE toe"""
)
_SIDES_HANSEN = _pairs(
    """AC acromion, ASIS asis, PSIS psis, UA upper_arm, ELB elbow, FA forearm, WRR radius, WRU ulna,
    HAND knuckle, KNEL knee_lateral, KNEM knee_medial, MALL ankle_lateral, MALM ankle_medial,
    CAL heel, MT2 toe"""
)
_SIDES_MEDIAL = {**_SIDES_PLUG_IN, "KNM": "knee_medial", "ANM": "ankle_medial"}


def _set(trunk: dict[str, str], sides: dict[str, str]) -> dict[str, str]:
    both = {f"{S}{label}": f"{name}_{S.lower()}" for S in "RL" for label, name in sides.items()}
    return {**trunk, **both}


MARKER_SETS = {
    "hansen2017": _set(_TRUNK_HANSEN, _SIDES_HANSEN),
    "plugin_gait": _set(_TRUNK_PLUG_IN, _SIDES_PLUG_IN),
    "plugin_gait_medial": _set(_TRUNK_PLUG_IN, _SIDES_MEDIAL),
}


def place_landmarks(body: Body, rng: np.random.Generator) -> dict[str, Landmark]:
    """All landmarks by name, each some millimetres off where a book has it."""
    found: dict[str, Landmark] = {}

    def put(name: str, segment: str, place_m: np.ndarray, sd_m: float) -> None:
        found[name] = Landmark(segment, place_m + rng.normal(0.0, sd_m, 3))

    for side, sign in SIDES.items():
        for name, (segment, place, sd) in _trunk_of_a_side(body, sign).items():
            put(f"{name}_{side}", segment, place, sd)
        for name, (limb, place, sd) in _limbs_of_a_side(body, sign).items():
            put(f"{name}_{side}", f"{limb}_{side}", place, sd)
    for name, (segment, place) in _midline(body).items():
        nearly_central = [1.0, 0.5, 1.0]
        found[name] = Landmark(segment, place + rng.normal(0.0, 0.004, 3) * nearly_central)
    return found


Places = dict[str, tuple[str, np.ndarray, float]]


def _trunk_of_a_side(body: Body, sign: float) -> Places:
    """Segment, place [m] and its standard deviation [m]."""
    size, lumbar = body.scale, body.joints_m["lumbar"]
    wide = 0.118 if body.sex == "M" else 0.122
    shoulder = sign * (HALF_SHOULDERS[body.sex] + 0.010) * size
    acromion = np.array([-0.018 * size, shoulder, suprasternale_m(body.lengths_m) + 0.006 * size])
    return {
        "asis": ("pelvis", np.array([0.064, sign * wide, 0.080]) * size, 0.004),
        "psis": ("pelvis", np.array([-0.098, sign * 0.045, 0.098]) * size, 0.004),
        "acromion": ("torso", acromion - lumbar, 0.005),
        "temple": ("head", np.array([0.045, sign * 0.082, 0.130]) * size, 0.004),
        "forehead": ("head", np.array([0.085, sign * 0.068, 0.160]) * size, 0.004),
        "occiput": ("head", np.array([-0.080, sign * 0.062, 0.158]) * size, 0.004),
    }


def _limbs_of_a_side(body: Body, sign: float) -> Places:
    """Limb, place [m] and its standard deviation [m]."""
    size, sole = body.scale, -body.ankle_height_m
    upper, fore, hand = (body.lengths_m[name] for name in ("upper_arm", "forearm", "hand"))
    thigh, shank = body.lengths_m["thigh"], body.lengths_m["shank"]

    def at(ahead: float, outward: float, up_m: float) -> np.ndarray:
        return np.array([ahead * size, sign * outward * size, up_m])

    return {
        "upper_arm": ("upper_arm", at(0.012, 0.048, -0.52 * upper), 0.010),
        "elbow": ("upper_arm", at(-0.004, 0.041, 0.003 - upper), 0.005),
        "forearm": ("forearm", at(-0.018, 0.033, -0.5 * fore), 0.010),
        "radius": ("hand", at(0.002, 0.033, 0.002), 0.003),
        "ulna": ("hand", at(-0.004, -0.031, 0.006), 0.003),
        "knuckle": ("hand", at(-0.020, 0.0, -0.95 * hand), 0.003),
        "thigh": ("thigh", at(0.015, 0.085, -0.55 * thigh), 0.012),
        "knee_lateral": ("thigh", at(-0.004, 0.053, 0.004 - thigh), 0.005),
        "knee_medial": ("thigh", at(-0.004, -0.051, 0.002 - thigh), 0.005),
        "shank": ("shank", at(0.012, 0.052, -0.48 * shank), 0.012),
        "ankle_lateral": ("shank", at(-0.009, 0.040, -0.004 - shank), 0.003),
        "ankle_medial": ("shank", at(0.005, -0.038, 0.006 - shank), 0.003),
        "heel": ("foot", at(-0.070, 0.002, sole + 0.036), 0.003),
        "toe": ("foot", at(0.122, 0.004, sole + 0.044), 0.003),
    }


def _midline(body: Body) -> dict[str, tuple[str, np.ndarray]]:
    """Segment and place [m]."""
    size, lumbar = body.scale, body.joints_m["lumbar"]
    top = suprasternale_m(body.lengths_m)
    xiphoid = top - body.lengths_m["upper_trunk"]
    neck = usual_neck_m(body.height_m, size, body.lengths_m)
    return {
        "forehead": ("head", np.array([0.112, 0.0, 0.165]) * size),
        "c7": ("torso", np.array([-0.078 * size, 0.0, neck + 0.012 * size]) - lumbar),
        "t10": ("torso", np.array([-0.108 * size, 0.0, 0.94 * xiphoid]) - lumbar),
        "xiphoid": ("torso", np.array([0.108 * size, 0.0, xiphoid]) - lumbar),
        "suprasternale": ("torso", np.array([0.048 * size, 0.0, top]) - lumbar),
        "scapula": (
            "torso",
            np.array([-0.108 * size, -0.095 * size, top - 0.07 * size]) - lumbar,
        ),
    }
