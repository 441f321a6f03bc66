"""Where the 38 markers sit on a person, and how the skin under them moves.

Landmarks are placed about the true joint centres so that the usual regressions (Reed, as
Dumas 2007 and 2018 use them) predict those centres wrongly by the drawn offsets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.simulate import tissue
from bsip_cli.simulate.options import Richness

ASIS_FROM_LUMBAR = {"M": (0.335, 0.032, 0.5), "F": (0.340, -0.049, 0.5)}  # pelvis widths
CERVICAL_SHARE = {"M": (0.55, 8.0), "F": (0.53, 14.0)}  # thorax widths, degrees
SHOULDER_FROM_ACROMION = (0.42, -67.0)  # thorax widths, degrees
STERNUM_SLOPE_DEG = 25.0
SKIN_SIZE_M = {  # travel of a marker against the bone for a large joint movement
    "thigh": 0.014,
    "shank": 0.005,
    "upper_arm": 0.007,
    "forearm": 0.005,
    "thorax": 0.005,
    "clavicle": 0.005,
    "lower_torso": 0.005,
}
OTHER_SKIN_SIZE_M = 0.0015


@dataclass(frozen=True, eq=False)
class Marker:
    """One skin marker.

    body : the bone it belongs to.
    position_m : (3,) rest position in the body's frame.
    skin_gain_m : (3, 12) travel per sine of the proximal (3) and distal (3) joint rotation, and
        per square of these.
    lag_s2 : travel against the marker's acceleration [m per m/s2].
    swing_share : of the swing of the tissue under it, if that swings.
    """

    body: str
    position_m: np.ndarray
    skin_gain_m: np.ndarray
    lag_s2: float
    swing_share: float


def place_markers(
    rng: np.random.Generator,
    sex: str,
    lengths: dict[str, float],
    joints: dict[str, np.ndarray],
    errors: dict[str, np.ndarray],
    hinges: dict[str, np.ndarray],
    widths: dict[str, float],
    ankle_height: float,
    richness: Richness,
) -> dict[str, Marker]:
    """All markers of a person. Lengths in m; `errors` as drawn with the joints."""
    places = {
        **_head(lengths),
        **_trunk(sex, lengths, errors, widths),
        **_pelvis(sex, errors, widths),
    }
    for side, sign in (("l", -1.0), ("r", 1.0)):
        places |= _arm(side, sign, lengths, joints, errors, hinges, widths)
        places |= _leg(side, sign, lengths, hinges, ankle_height)
    return skin_markers(places, rng, richness)


def skin_markers(
    places: dict[str, tuple[str, np.ndarray]], rng: np.random.Generator, richness: Richness
) -> dict[str, Marker]:
    """Markers at these places of bodies, palpated with an error, on skin that slides."""
    bodies = sorted({body for body, _ in places.values()})
    sliding = {body: rng.standard_normal((3, 6)) for body in bodies}
    markers = {}
    for label, (body, position) in places.items():
        error = richness.placement_error_m * rng.standard_normal(3)
        own = rng.standard_normal((3, 6))
        lag = 1.5e-4 * np.exp(0.3 * rng.standard_normal())
        size = SKIN_SIZE_M.get(body.removesuffix("_l").removesuffix("_r"), OTHER_SKIN_SIZE_M)
        gain = richness.soft_tissue * size * (0.8 * sliding[body] + 0.6 * own) / np.sqrt(3.0)
        lag *= richness.soft_tissue * min(size / 0.007, 1.0)
        markers[label] = Marker(body, position + error, np.hstack([gain, 0.0 * gain]), lag, 0.0)
    return _with_measured_tissue(markers, rng, richness) if richness.measured_tissue else markers


def _with_measured_tissue(
    markers: dict[str, Marker], rng: np.random.Generator, richness: Richness
) -> dict[str, Marker]:
    """Larger where `tissue` says so, and curved in the pose; the share of its swing is drawn."""
    changed = {}
    for label, marker in markers.items():
        kind = marker.body.removesuffix("_l").removesuffix("_r")
        usual = SKIN_SIZE_M.get(kind, OTHER_SKIN_SIZE_M)
        size = tissue.SKIN_SIZE_M.get(kind, usual)
        straight = marker.skin_gain_m[:, :6] * size / usual
        curved = tissue.CURVED_SHARE * richness.soft_tissue * size * rng.standard_normal((3, 6))
        gain = np.hstack([straight, curved / np.sqrt(3.0)])
        share = richness.soft_tissue * float(rng.uniform(*tissue.MARKER_SHARE))
        changed[label] = replace(marker, skin_gain_m=gain, swing_share=share)
    return changed


def _head(lengths: dict[str, float]) -> dict[str, tuple[str, np.ndarray]]:
    h = lengths["head"]
    return {
        "RTEM": ("head", np.array([0.03, 0.62 * h, 0.075])),
        "LTEM": ("head", np.array([0.03, 0.62 * h, -0.075])),
        "FHEAD": ("head", np.array([0.115, 0.75 * h, 0.0])),
    }


def _trunk(
    sex: str, lengths: dict[str, float], errors: dict[str, np.ndarray], widths: dict[str, float]
) -> dict[str, tuple[str, np.ndarray]]:
    """Thorax landmarks in the thorax frame (origin CJC)."""
    size = lengths["upper_torso"]
    share, angle = CERVICAL_SHARE[sex]
    width = widths["thorax"]
    rise = np.deg2rad(angle - STERNUM_SLOPE_DEG)
    slope = np.deg2rad(-STERNUM_SLOPE_DEG)
    c7 = -errors["cjc"] - share * width * np.array([np.cos(rise), np.sin(rise), 0.0])
    sternum = c7 + width * np.array([np.cos(slope), np.sin(slope), 0.0])
    return {
        "C7": ("thorax", c7),
        "IJ": ("thorax", sternum),
        "T10": ("thorax", np.array([-0.235 * size, -0.50 * size, 0.0])),
        "XIPH": ("thorax", np.array([0.21 * size, -0.40 * size, 0.0])),
        "RSCAP": ("thorax", np.array([-0.25 * size, -0.30 * size, 0.19 * size])),
    }


def _pelvis(
    sex: str, errors: dict[str, np.ndarray], widths: dict[str, float]
) -> dict[str, tuple[str, np.ndarray]]:
    """Spines of the pelvis in the lower torso's frame (origin at the true LJC)."""
    width = widths["pelvis"]
    x, y, z = np.array(ASIS_FROM_LUMBAR[sex]) * width
    back, aside = x - 0.68 * width, 0.045
    shift = -errors["ljc"]
    return {
        "RASIS": ("lower_torso", np.array([x, y, z]) + shift),
        "LASIS": ("lower_torso", np.array([x, y, -z]) + shift),
        "RPSIS": ("lower_torso", np.array([back, y, aside]) + shift),
        "LPSIS": ("lower_torso", np.array([back, y, -aside]) + shift),
    }


def _arm(
    side: str,
    sign: float,
    lengths: dict[str, float],
    joints: dict[str, np.ndarray],
    errors: dict[str, np.ndarray],
    hinges: dict[str, np.ndarray],
    widths: dict[str, float],
) -> dict[str, tuple[str, np.ndarray]]:
    """Arm landmarks; the styloids move with the hand (pronation is at the wrist)."""
    S = side.upper()
    share, angle = SHOULDER_FROM_ACROMION
    down = np.deg2rad(angle)
    below = share * widths["thorax"] * np.array([np.cos(down), np.sin(down), 0.0])
    acromion = joints[f"shoulder_{side}"] - errors[f"shoulder_{side}"] - below
    arm, forearm = lengths[f"upper_arm_{side}"], lengths[f"forearm_{side}"]
    elbow = np.array([0.0, -arm, 0.0]) + 0.036 * sign * hinges[f"elbow_{side}"]
    upper, lower, hand = f"upper_arm_{side}", f"forearm_{side}", f"hand_{side}"
    return {
        f"{S}AC": ("thorax", acromion),
        f"{S}UA": (upper, np.array([0.008, -0.5 * arm, sign * 0.047])),
        f"{S}ELB": (upper, elbow),
        f"{S}FA": (lower, np.array([-0.01, -0.45 * forearm, sign * 0.038])),
        f"{S}WRR": (hand, np.array([0.003, 0.0, sign * 0.029])),
        f"{S}WRU": (hand, np.array([-0.003, 0.0, -sign * 0.029])),
        f"{S}HAND": (hand, np.array([-0.016, -lengths[hand], sign * 0.003])),
    }


def _leg(
    side: str,
    sign: float,
    lengths: dict[str, float],
    hinges: dict[str, np.ndarray],
    ankle_height: float,
) -> dict[str, tuple[str, np.ndarray]]:
    """Leg landmarks; foot markers about the ankle joint, sole at -ankle_height."""
    S = side.upper()
    knee = np.array([0.0, -lengths[f"thigh_{side}"], 0.0])
    across = 0.050 * sign * hinges[f"knee_{side}"]
    ankle = np.array([0.0, -lengths[f"shank_{side}"], 0.0])
    thigh, shank, foot = f"thigh_{side}", f"shank_{side}", f"foot_{side}"
    heel, front = heel_and_toe_m(lengths[foot])
    return {
        f"{S}KNEL": (thigh, knee + across),
        f"{S}KNEM": (thigh, knee - across),
        f"{S}MALL": (shank, ankle + np.array([-0.006, -0.006, sign * 0.037])),
        f"{S}MALM": (shank, ankle + np.array([0.006, 0.006, -sign * 0.037])),
        f"{S}CAL": (foot, np.array([heel, 0.036 - ankle_height, 0.0])),
        f"{S}MT2": (foot, np.array([front, 0.036 - ankle_height, -sign * 0.008])),
    }


def heel_and_toe_m(foot_length_m: float) -> tuple[float, float]:
    """X of the heel and of the metatarsal heads from the ankle joint, foot flat."""
    return -0.27 * foot_length_m, 0.73 * foot_length_m
