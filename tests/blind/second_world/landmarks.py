"""Where markers sit on a person, and three marker sets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.blind.second_world.body import (
    HALF_SHOULDERS,
    SIDES,
    Body,
    rows_of,
    suprasternale_m,
    usual_neck_m,
)

_HALF_ASIS = {"M": 0.118, "F": 0.122}  # of a person of the table's stature [m]


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
    """All landmarks by name, each some millimetres off where `landmarks.csv` has it."""
    found: dict[str, Landmark] = {}
    for side, sign in {**SIDES, "": 1.0}.items():
        for row in rows_of("landmarks.csv"):
            if ("*" in row["name"]) == bool(side):
                off = rng.normal(0.0, float(row["sd_m"]), 3) * [1.0, 1.0 if side else 0.5, 1.0]
                segment = row["segment"].replace("*", side)
                place = _place(body, row, sign) + off
                found[row["name"].replace("*", side)] = Landmark(segment, place)
    return found


def _place(body: Body, row: dict[str, str], sign: float) -> np.ndarray:
    """(3,) in the segment's frame [m]: parts of the body's scale ahead, outward and up; up, too, a
    part of a length or of a height above the hips, and metres."""
    size, top = body.scale, suprasternale_m(body.lengths_m)
    widths = {"hips": _HALF_ASIS[body.sex], "shoulders": HALF_SHOULDERS[body.sex] + 0.010}
    lengths = body.lengths_m | {
        "suprasternale": top,
        "xiphoid": top - body.lengths_m["upper_trunk"],
        "neck": usual_neck_m(body.height_m, size, body.lengths_m),
        "ankle": body.ankle_height_m,
        "": 0.0,
    }
    ahead, up, along, up_m = (float(row[name]) for name in ("ahead", "up", "along", "up_m"))
    outward = widths[row["outward"]] if row["outward"] in widths else float(row["outward"])
    height = along * lengths[row["of"]] + up * size + up_m
    place = np.array([ahead * size, sign * outward * size, height])
    return place - body.joints_m["lumbar"] if row["segment"] == "torso" else place
