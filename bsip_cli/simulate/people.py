"""Draw a person: sizes, joints, true inertial parameters, markers and the soft tissue under them.

Sixteen bodies: the 15 segments of `bsip_cli.segments`, with the upper torso in two
parts (abdomen below T12/L1, thorax above). Body axes: X anterior, Y up along the segment,
Z to the right, on both sides of the body. Origins: lower_torso and abdomen at the lumbar
joint centre (LJC), thorax and head at the cervical (CJC), limbs at their proximal joint.

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

from bsip_cli.segments import SEGMENTS, without_side
from bsip_cli.simulate.numerics import from_rotation_vector
from bsip_cli.simulate.options import Richness

BODIES = ("lower_torso", "abdomen", "thorax", *SEGMENTS[2:])
SIDES = ("l", "r")
SIDE_SIGN = {"l": -1.0, "r": 1.0}
MEAN_STATURE_M = {"M": 1.77, "F": 1.61}
STATURE_M = {"M": (1.77, 0.07), "F": (1.64, 0.06)}
BODY_MASS_INDEX = (23.5, 2.8)
# Mean sizes [m], and their standard deviations among people of a stature, as a part.
WIDTHS = {
    "pelvis": ({"M": 0.238, "F": 0.240}, 0.05),
    "thorax": ({"M": 0.150, "F": 0.132}, 0.05),
    "shoulder": ({"M": 0.178, "F": 0.158}, 0.03),  # half of it
}
LENGTH_SPREAD, SIDE_SPREAD = 0.035, 0.005
LEAST_SHARE = 0.02  # of the largest second moment, of every other
# Reed's hip and lumbar joint centres from the middle of the ASIS, in pelvis widths,
# ISB pelvis axes (Dumas and Wojtusch 2018).
LUMBAR_FROM_ASIS = {"M": (-0.335, -0.032, 0.0), "F": (-0.340, 0.049, 0.0)}
HIP_FROM_ASIS = {"M": (-0.095, -0.370, 0.361), "F": (-0.139, -0.336, 0.372)}
JOINT_AT_END_OF = {"elbow": "upper_arm", "wrist": "forearm", "knee": "thigh", "ankle": "shank"}
LIMB_LENGTHS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
# Standard deviations of the true parameters about the mean person's.
MASS_SPREAD = {"upper_arm": 0.15, "forearm": 0.15, "hand": 0.15}
COM_SPREAD_M = {"lower_torso": 0.011, "thorax": 0.012, "abdomen": 0.012, "thigh": 0.007}


@cache
def table(name: str) -> list[dict[str, str]]:
    """Rows of a CSV file of this folder."""
    text = files("bsip_cli.simulate").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


# --- rigid bodies ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Inertia:
    """A rigid body's mass distribution.

    com_m : (3,) centre of mass from the body's origin, body axes.
    tensor_kgm2 : (3, 3) inertia tensor about the centre of mass, body axes.
    """

    mass_kg: float
    com_m: np.ndarray
    tensor_kgm2: np.ndarray


def second_moments(tensor: np.ndarray) -> np.ndarray:
    """Integral of r r^T dm about the centre of mass, from the inertia tensor."""
    return 0.5 * np.trace(tensor) * np.eye(3) - tensor


def tensor_of(moments: np.ndarray) -> np.ndarray:
    """Inertia tensor from the integral of r r^T dm."""
    return np.trace(moments) * np.eye(3) - moments


def nearest_physical(tensor: np.ndarray) -> np.ndarray:
    """Raise too small principal second moments to a share of the largest one."""
    values, axes = np.linalg.eigh(second_moments(tensor))
    values = np.maximum(values, LEAST_SHARE * values.max())
    return tensor_of(axes @ np.diag(values) @ axes.T)


def combined(parts: list[tuple[Inertia, np.ndarray]]) -> Inertia:
    """One body out of several that share their axes.

    parts : (inertia, origin (3,) of the part in the frame of the whole).
    """
    mass = sum(part.mass_kg for part, _ in parts)
    com = sum(part.mass_kg * (origin + part.com_m) for part, origin in parts) / mass
    tensor = np.zeros((3, 3))
    for part, origin in parts:
        d = origin + part.com_m - com
        tensor += part.tensor_kgm2 + part.mass_kg * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertia(mass, com, tensor)


# --- the person -----------------------------------------------------------------------------------


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
class Person(Build):
    """A simulated person; the truth.

    inertias : of the 16 bodies. tissue : what of the segments swings on its bone.
    """

    stature_m: float
    mass_kg: float
    inertias: dict[str, Inertia]
    markers: dict[str, Marker]
    tissue: dict[str, Swing]

    def segment_inertias(self) -> dict[str, Inertia]:
        """The 15 fitted segments; the upper torso is the upright sum of its two parts."""
        abdomen = -(self.joints_m["tjc"] + self.joints_m["cjc"])
        upper = [(self.inertias["thorax"], np.zeros(3)), (self.inertias["abdomen"], abdomen)]
        parts = {**self.inertias, "upper_torso": combined(upper)}
        return {name: parts[name] for name in SEGMENTS}


@dataclass(frozen=True, eq=False)
class MeanSegment:
    """A row of the mean person: percent of body mass, centre of mass and tensor in lengths.

    origin : joint centre from which the row's centre of mass is counted.
    """

    origin: str
    mass_percent: float
    com: np.ndarray
    tensor: np.ndarray
    length_m: float


@cache
def mean_segments(sex: str) -> dict[str, MeanSegment]:
    """The mean man's or woman's segments (Dumas 2007, trunk parts 2015), right side."""
    segments = {}
    for row in (row for row in table("mean_person.csv") if row["sex"] == sex):
        radii = {k: float(row[k]) / 100 for k in ("rxx", "ryy", "rzz", "rxy", "rxz", "ryz")}
        entry = {k: np.sign(r) * r**2 for k, r in radii.items()}
        tensor = np.array([[entry["r" + "".join(sorted(i + j))] for j in "xyz"] for i in "xyz"])
        segments[row["segment"]] = MeanSegment(
            origin=row["origin"],
            mass_percent=float(row["mass_percent"]),
            com=np.array([float(row[f"com_{axis}_percent"]) / 100 for axis in "xyz"]),
            tensor=nearest_physical(tensor),
            length_m=float(row["mean_length_m"]),
        )
    return segments


def draw_person(rng: np.random.Generator, richness: Richness, sex: str = "") -> Person:
    """Draw a person of the given sex (or of either)."""
    sex = sex or str(rng.choice(["M", "F"]))
    stature = float(np.clip(rng.normal(*STATURE_M[sex]), 1.48, 2.0))
    body_mass_index = float(np.clip(rng.normal(*BODY_MASS_INDEX), 19.0, 30.0))
    mass = body_mass_index * stature**2
    build = _draw_build(rng, sex, stature, richness)
    inertias = _draw_inertias(rng, build, mass, body_mass_index, richness.inertia_variation)
    joints, markers = build.joints_m, place_markers(rng, build, richness)
    if richness.girdle:
        joints, markers = with_girdle(rng, build, markers, richness)
    return Person(
        **vars(build) | {"joints_m": joints},
        stature_m=stature,
        mass_kg=mass,
        inertias=inertias,
        markers=markers,
        tissue=draw_tissue(rng) if richness.measured_tissue else {},
    )


def _factor(rng: np.random.Generator, spread: float) -> float:
    """A positive factor whose mean is 1 and whose logarithm has this standard deviation."""
    return float(np.exp(spread * rng.standard_normal() - 0.5 * spread**2))


def _draw_build(rng: np.random.Generator, sex: str, stature: float, richness: Richness) -> Build:
    """Lengths, widths, joints and hinges, in this order of draws."""
    size, mean = stature / MEAN_STATURE_M[sex], mean_segments(sex)
    lengths = {
        name: mean[name].length_m * size * _factor(rng, LENGTH_SPREAD)
        for name in ("head", "thorax", "abdomen")
    }
    lengths["upper_torso"] = lengths["thorax"] + lengths["abdomen"]
    for name in LIMB_LENGTHS:
        both = mean[name].length_m * size * _factor(rng, LENGTH_SPREAD)
        lengths |= {f"{name}_{side}": both * _factor(rng, SIDE_SPREAD) for side in SIDES}
    widths = {k: width[sex] * size * _factor(rng, spread) for k, (width, spread) in WIDTHS.items()}
    # true joints in their parents' frames, and how far landmarks mispredict some of them
    scale = richness.joint_centre_offset

    def offset(size_m: float) -> np.ndarray:
        return scale * size_m * rng.standard_normal(3)

    errors = {
        "ljc": offset(0.006),
        "cjc": offset(0.005) * np.array([1.0, 1.0, 0.4]),
        "shoulder_l": offset(0.006),
        "shoulder_r": offset(0.006),
    }
    lumbar, tjc_x = np.array(LUMBAR_FROM_ASIS[sex]) * widths["pelvis"], -0.01 * scale
    joints = {
        "tjc": np.array([tjc_x, lengths["abdomen"], 0.0]),
        "cjc": np.array([-tjc_x, lengths["thorax"], 0.0]),
    }
    for side, sign in SIDE_SIGN.items():
        hip = np.array([1.0, 1.0, sign]) * HIP_FROM_ASIS[sex] * widths["pelvis"]
        joints[f"hip_{side}"] = hip + offset(0.0065) - (lumbar + errors["ljc"])
        shoulder_y = -0.045 * lengths["upper_torso"] / 0.477
        joints[f"shoulder_{side}"] = np.array([0.005, shoulder_y, sign * widths["shoulder"]])
        for joint, body in JOINT_AT_END_OF.items():
            joints[f"{joint}_{side}"] = np.array([0.0, -lengths[f"{body}_{side}"], 0.0])
    hinges = {}
    for hinge in [f"{joint}_{side}" for joint in ("elbow", "knee") for side in SIDES]:
        tilt = np.deg2rad(3.0) * richness.hinge_tilt * rng.standard_normal(3)
        hinges[hinge] = from_rotation_vector(tilt) @ np.array([0.0, 0.0, 1.0])
    return Build(sex, lengths, widths, 0.045 * stature, joints, errors, hinges)


def _draw_inertias(
    rng: np.random.Generator, build: Build, mass: float, body_mass_index: float, scale: float
) -> dict[str, Inertia]:
    """True inertial parameters: the mean person's, varied, summing to the mass."""
    mean, lengths = mean_segments(build.sex), build.lengths_m
    common = {name: _factor(rng, scale * MASS_SPREAD.get(name, 0.11)) for name in mean}
    masses = {}
    for body in BODIES:
        kind = without_side(body)
        own = _factor(rng, 0.03 * scale) if kind != body else 1.0
        masses[body] = mean[kind].mass_percent * common[kind] * own
    total = sum(masses.values())
    trunk = mean["thorax"].length_m + mean["abdomen"].length_m
    inertias = {}
    for body in BODIES:
        kind, own_mass = without_side(body), mass * masses[body] / total
        row = mean[kind]
        # the pelvis' own length follows the trunk's
        pelvis = row.length_m * lengths["upper_torso"] / trunk
        length = pelvis if body == "lower_torso" else lengths[body]
        mirror = np.array([1.0, 1.0, -1.0 if body.endswith("_l") else 1.0])
        is_own = row.origin != "TJC"  # the body's own origin
        com = (np.zeros(3) if is_own else build.joints_m["tjc"]) + mirror * row.com * length
        com = com + scale * COM_SPREAD_M.get(kind, 0.004) * rng.standard_normal(3)
        if body in ("abdomen", "lower_torso"):  # a belly shifts the trunk's mass forward
            com[0] += scale * 0.0015 * (body_mass_index - BODY_MASS_INDEX[0])
        tensor = np.outer(mirror, mirror) * row.tensor * own_mass * length**2
        if scale:
            # Another physical tensor; the mean of many is this one. It is that of equal points
            # drawn from a normal distribution with its second moments (Wishart), so many that each
            # moment has this relative standard deviation. A slender body's axes turn little.
            root = np.linalg.cholesky(second_moments(tensor))
            points = rng.standard_normal((max(3, round(2.0 / (0.12 * scale) ** 2)), 3)) @ root.T
            tensor = tensor_of(points.T @ points / len(points))
        inertias[body] = Inertia(own_mass, com, tensor)
    return inertias


# --- markers, and the soft tissue under them ------------------------------------------------------


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
    x, y, _ = -np.array(LUMBAR_FROM_ASIS[build.sex]) * across
    for side, sign in SIDE_SIGN.items():
        spines = {"ASIS": [x, y, sign * 0.5 * across], "PSIS": [x - 0.68 * across, y, sign * 0.045]}
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
    for side, sign in SIDE_SIGN.items():
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
    bodies, scale, markers = {body for body, _ in places.values()}, richness.soft_tissue, {}
    sliding = {body: rng.standard_normal((3, 6)) for body in sorted(bodies)}
    for label, (body, position) in places.items():
        error = richness.placement_error_m * rng.standard_normal(3)
        own = rng.standard_normal((3, 6))
        lag = 1.5e-4 * np.exp(0.3 * rng.standard_normal())
        size = float(tissue_of(without_side(body))["skin_m"])
        gain = scale * size * (0.8 * sliding[body] + 0.6 * own) / np.sqrt(3.0)
        lag *= scale * min(size / 0.007, 1.0)
        markers[label] = Marker(body, position + error, np.hstack([gain, 0.0 * gain]), lag, 0.0)
    for label, marker in markers.items() if richness.measured_tissue else ():
        tissue = tissue_of(without_side(marker.body))
        usual, size = float(tissue["skin_m"]), float(tissue["measured_skin_m"])
        straight = marker.skin_gain_m[:, :6] * size / usual
        curved = CURVED_SHARE * scale * size * rng.standard_normal((3, 6))
        gain = np.hstack([straight, curved / np.sqrt(3.0)])
        share = scale * float(rng.uniform(*MARKER_SHARE))
        markers[label] = replace(marker, skin_gain_m=gain, swing_share=share)
    return markers


def _places(build: Build, found: dict[str, np.ndarray], girdle: str = "no") -> Places:
    """Places by the table, in its order, those of the left side before those of the right one; of
    rows without numbers as they were found.

    A coordinate is a sum of terms, metres or parts of a size; Z points outwards on each side.
    """
    places = {}
    for side, sign in {"": 1.0, **SIDE_SIGN}.items():
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
