"""Where the markers sit on a person, and how the soft tissue under them moves.

Landmarks are placed about the true joint centres so that the usual regressions (Reed, as
Dumas 2007 and 2018 use them) predict those centres wrongly by the drawn offsets.

Soft tissue as measured on people is larger on trunk and thighs, curved in the pose, and swings.
Travel of markers against the bone: thigh cluster 18 mm and 10 degrees, shank 17 mm in the swing of
gait under fluoroscopy (CAMS-Knee data, PMC8631460); pelvis and thigh 3 to 54 mm in range, by marker
and movement (Fiorentino 2017, Gait Posture); back 9 to 11 mm between extension and flexion (Zemp
2014, PLoS ONE 9:e95426). Limbs' tissue vibrates near the frequencies of running's impacts
(Wakeling and Nigg 2001, J Appl Physiol 90:412). Assumed, without a source: how much of a segment
swings as one mass, its damping, and the trunk's frequency.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np

from bsip_cli.segments import without_side
from bsip_cli.simulate.options import Richness

ASIS_FROM_LUMBAR = {"M": (0.335, 0.032, 0.5), "F": (0.340, -0.049, 0.5)}  # pelvis widths
CERVICAL_SHARE = {"M": (0.55, 8.0), "F": (0.53, 14.0)}  # thorax widths, degrees
SHOULDER_FROM_ACROMION = (0.42, -67.0)  # thorax widths, degrees
STERNUM_SLOPE_DEG = 25.0
# Of the sternoclavicular joint from the notch of the sternum, thorax axes, right side (Holzbaur
# 2005), in the width of the thorax; how far it lies from there in people.
JOINT_FROM_NOTCH = np.array([0.0063, 0.0069, 0.0255]) / 0.136
JOINT_OFFSET_M = 0.005
CURVED_SHARE = 0.5  # travel with the square of a joint's sine, of that with the sine
DAMPING_RATIO = (0.2, 0.4)
MARKER_SHARE = (0.3, 1.0)  # of the tissue's swing that a marker over it shows
_TERM = re.compile(r"(-?[\d.]+)(?: ([a-z_]+))?")
Places = dict[str, tuple[str, np.ndarray]]
"""By label, the bone under a marker and the place (3,) in that bone's frame."""


@dataclass(frozen=True, eq=False)
class Marker:
    """One skin marker.

    body : the bone it belongs to. position_m : (3,) rest position in the body's frame.
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


@dataclass(frozen=True)
class Swing:
    """Part of a segment that hangs on its bone by a spring and a damper."""

    mass_share: float
    frequency_hz: float
    damping_ratio: float


@dataclass(frozen=True, eq=False)
class Build:
    """A person's sizes and joints.

    lengths_m : per segment (limbs per side), joint to joint; the foot heel to metatarsals.
    widths_m : of pelvis and thorax, and half that of the shoulders. ankle_height_m : of the ankle
        joint above the sole.
    joints_m : (3,) of each joint in its parent's frame: tjc and cjc in the abdomen,
        neck (always zero), shoulder_* in the thorax, hip_* in lower_torso, and so on;
        sternoclavicular_* in the thorax, if the shoulders move against it.
    hinges : unit axes (3,) of elbow_* in the upper arm and knee_* in the thigh.
    errors_m : for ljc, cjc and shoulder_*, true joint centre minus what landmarks predict (3,).
    """

    sex: str
    lengths_m: dict[str, float]
    widths_m: dict[str, float]
    ankle_height_m: float
    joints_m: dict[str, np.ndarray]
    errors_m: dict[str, np.ndarray]
    hinges: dict[str, np.ndarray]


@cache
def table(name: str) -> list[dict[str, str]]:
    """Rows of a CSV file of this folder."""
    text = files("bsip_cli.simulate").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


@cache
def tissue_of(kind: str) -> dict[str, str]:
    """Of a body, without its side: how far a marker travels against the bone in a large joint
    movement, light and as measured; the bones whose turning against it moves the skin (* is the
    body's side); what of it swings, the share of its mass, and the range of its frequency."""
    return next(row for row in table("tissue.csv") if row["body"] == kind)


def draw_tissue(rng: np.random.Generator) -> dict[str, Swing]:
    """What swings, by segment; left and right at frequencies of their own."""
    swings = {}
    for row in table("tissue.csv"):
        for segment in row["swings"].split():
            frequency = float(rng.uniform(float(row["from_hz"]), float(row["to_hz"])))
            damping = float(rng.uniform(*DAMPING_RATIO))
            swings[segment] = Swing(float(row["share"]), frequency, damping)
    return swings


def place_markers(rng: np.random.Generator, build: Build, richness: Richness) -> dict[str, Marker]:
    """The 38 markers of a person.

    From those of the thorax (origin CJC), the pelvis (origin at the true LJC) and the shoulders the
    regressions predict the joint centres wrongly by the drawn errors.
    """
    width, (share, angle) = build.widths_m["thorax"], CERVICAL_SHARE[build.sex]
    c7 = -build.errors_m["cjc"] - share * width * _in_plane(angle - STERNUM_SLOPE_DEG)
    found = {"C7": c7, "IJ": c7 + width * _in_plane(-STERNUM_SLOPE_DEG)}
    share, angle = SHOULDER_FROM_ACROMION
    across = build.widths_m["pelvis"]
    x, y, z = np.array(ASIS_FROM_LUMBAR[build.sex]) * across
    for side, sign in (("l", -1.0), ("r", 1.0)):
        spines = {"ASIS": [x, y, sign * z], "PSIS": [x - 0.68 * across, y, sign * 0.045]}
        for name, place in spines.items():
            found[side.upper() + name] = np.array(place) - build.errors_m["ljc"]
        shoulder = build.joints_m[f"shoulder_{side}"] - build.errors_m[f"shoulder_{side}"]
        found[f"{side.upper()}AC"] = shoulder - share * width * _in_plane(angle)
    return _skin_markers(_places(build, found), rng, richness)


def with_girdle(
    rng: np.random.Generator, build: Build, markers: dict[str, Marker], richness: Richness
) -> tuple[dict[str, np.ndarray], dict[str, Marker]]:
    """Joints with sternoclavicular_* (thorax axes), and 51 markers, with those of the clavicles.

    The clavicles have no mass of their own: the thorax keeps that of the girdle, as every model
    with massless clavicles has it.
    """
    joints, markers, found = dict(build.joints_m), dict(markers), {}
    for side, sign in (("l", -1.0), ("r", 1.0)):
        offset = richness.joint_centre_offset * JOINT_OFFSET_M * rng.standard_normal(3)
        from_notch = build.widths_m["thorax"] * JOINT_FROM_NOTCH * np.array([1.0, 1.0, sign])
        joint = markers["IJ"].position_m + from_notch + offset
        joints[f"sternoclavicular_{side}"] = joint
        label = f"{side.upper()}AC"
        acromion = markers[label].position_m - joint
        markers[label] = replace(markers[label], body=f"clavicle_{side}", position_m=acromion)
        found[f"{side.upper()}CLA"] = 0.5 * acromion + np.array([0.015, 0.008, 0.0])
        found[f"{side.upper()}AA"] = acromion + np.array([-0.035, -0.005, -0.01 * sign])
    return joints, markers | _skin_markers(_places(build, found, "yes"), rng, richness)


def _skin_markers(
    places: Places, rng: np.random.Generator, richness: Richness
) -> dict[str, Marker]:
    """Markers at these places, palpated with an error, on skin that slides; the share is drawn."""
    sliding = {
        body: rng.standard_normal((3, 6)) for body in sorted({body for body, _ in places.values()})
    }
    markers = {}
    for label, (body, position) in places.items():
        error = richness.placement_error_m * rng.standard_normal(3)
        own = rng.standard_normal((3, 6))
        lag = 1.5e-4 * np.exp(0.3 * rng.standard_normal())
        size = float(tissue_of(without_side(body))["skin_m"])
        gain = richness.soft_tissue * size * (0.8 * sliding[body] + 0.6 * own) / np.sqrt(3.0)
        lag *= richness.soft_tissue * min(size / 0.007, 1.0)
        markers[label] = Marker(body, position + error, np.hstack([gain, 0.0 * gain]), lag, 0.0)
    for label, marker in markers.items() if richness.measured_tissue else ():
        tissue = tissue_of(without_side(marker.body))
        usual, size = float(tissue["skin_m"]), float(tissue["measured_skin_m"])
        straight = marker.skin_gain_m[:, :6] * size / usual
        curved = CURVED_SHARE * richness.soft_tissue * size * rng.standard_normal((3, 6))
        gain = np.hstack([straight, curved / np.sqrt(3.0)])
        share = richness.soft_tissue * float(rng.uniform(*MARKER_SHARE))
        markers[label] = replace(marker, skin_gain_m=gain, swing_share=share)
    return markers


def _places(build: Build, found: dict[str, np.ndarray], girdle: str = "no") -> Places:
    """Places by the table, in its order, those of the left side before those of the right one; of
    rows without numbers as they were found.

    A coordinate is a sum of terms, metres or parts of a size; Z points outwards on each side.
    """
    places = {}
    for side, sign in (("", 1.0), ("l", -1.0), ("r", 1.0)):
        own = {name.removesuffix(f"_{side}"): size for name, size in build.lengths_m.items()}
        sizes = own | {"ankle_height": build.ankle_height_m, "": 1.0}
        for row in table("markers.csv"):
            if row["girdle"] != girdle or ("*" in row["label"]) != bool(side):
                continue
            label, place = row["label"].replace("*", side.upper()), np.zeros(3)
            for axis, name in enumerate(("x_m", "y_m", "z_m")):
                place[axis] = sum(float(k) * sizes[size] for k, size in _TERM.findall(row[name]))
            place[2] *= sign
            for along, joint in _TERM.findall(row["along_hinge_m"]):
                place = place + float(along) * sign * build.hinges[f"{joint}_{side}"]
            place = place if row["x_m"] else found[label]
            places[label] = row["body"].replace("*", side), place
    return places


def _in_plane(degrees: float) -> np.ndarray:
    """(3,) unit vector ahead, raised by an angle."""
    return np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees)), 0.0])
