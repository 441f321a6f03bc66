"""Draw a person: sizes, joints, true inertial parameters, marker placements.

Sixteen bodies: the 15 segments of `bsip_cli.body.names`, with the upper torso in two
parts (abdomen below T12/L1, thorax above). Body axes: X anterior, Y up along the segment,
Z to the right, on both sides of the body. Origins: lower_torso and abdomen at the lumbar
joint centre (LJC), thorax and head at the cervical (CJC), limbs at their proximal joint.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.girdle import with_girdle
from bsip_cli.simulate.inertia import (
    Inertia,
    combined,
    nearest_physical,
    varied_tensor,
)
from bsip_cli.simulate.landmarks import Marker, place_markers
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.rotations import from_rotation_vector
from bsip_cli.simulate.tissue import Swing, draw_tissue

BODIES = ("lower_torso", "abdomen", "thorax", *SEGMENTS[2:])
SIDES = ("l", "r")
SIDE_SIGN = {"l": -1.0, "r": 1.0}
MEAN_STATURE_M = {"M": 1.77, "F": 1.61}
STATURE_M = {"M": (1.77, 0.07), "F": (1.64, 0.06)}
BODY_MASS_INDEX = (23.5, 2.8)
PELVIS_WIDTH_M = {"M": 0.238, "F": 0.240}
THORAX_WIDTH_M = {"M": 0.150, "F": 0.132}
HALF_SHOULDER_WIDTH_M = {"M": 0.178, "F": 0.158}
# Reed's hip and lumbar joint centres from the middle of the ASIS, in pelvis widths,
# ISB pelvis axes (Dumas and Wojtusch 2018).
LUMBAR_FROM_ASIS = {"M": (-0.335, -0.032, 0.0), "F": (-0.340, 0.049, 0.0)}
HIP_FROM_ASIS = {"M": (-0.095, -0.370, 0.361), "F": (-0.139, -0.336, 0.372)}
LIMB_LENGTHS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
# Standard deviations of the true parameters about the mean person's.
MASS_SPREAD = {"upper_arm": 0.15, "forearm": 0.15, "hand": 0.15}
COM_SPREAD_M = {"lower_torso": 0.011, "thorax": 0.012, "abdomen": 0.012, "thigh": 0.007}


@dataclass(frozen=True, eq=False)
class Person:
    """A simulated person; the truth.

    lengths_m : per segment (limbs per side), joint to joint; the foot heel to metatarsals.
    joints_m : (3,) of each joint in its parent's frame: tjc and cjc in the abdomen,
        neck (always zero), shoulder_* in the thorax, hip_* in lower_torso, and so on;
        sternoclavicular_* in the thorax, if the shoulders move against it.
    hinges : unit axes (3,) of elbow_* in the upper arm and knee_* in the thigh.
    inertias : of the 16 bodies.
    ankle_height_m : of the ankle joint above the sole.
    tissue : what of the segments swings on its bone.
    """

    sex: str
    stature_m: float
    mass_kg: float
    lengths_m: dict[str, float]
    joints_m: dict[str, np.ndarray]
    hinges: dict[str, np.ndarray]
    inertias: dict[str, Inertia]
    markers: dict[str, Marker]
    ankle_height_m: float
    pelvis_width_m: float
    thorax_width_m: float
    trunk_bend: float
    tissue: dict[str, Swing]

    def segment_inertias(self) -> dict[str, Inertia]:
        """The 15 fitted segments; the upper torso is the upright sum of its two parts."""
        origin_abdomen = -(self.joints_m["tjc"] + self.joints_m["cjc"])
        upper = combined(
            [
                (self.inertias["thorax"], np.zeros(3)),
                (self.inertias["abdomen"], origin_abdomen),
            ]
        )
        parts = {**self.inertias, "upper_torso": upper}
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
    table = files("bsip_cli.simulate").joinpath("mean_person.csv").read_text(encoding="utf-8")
    rows = [row for row in csv.DictReader(table.splitlines()) if row["sex"] == sex]
    return {row["segment"]: _mean_segment(row) for row in rows}


def _mean_segment(row: dict[str, str]) -> MeanSegment:
    radii = {k: float(row[k]) / 100 for k in ("rxx", "ryy", "rzz", "rxy", "rxz", "ryz")}
    entry = {k: np.sign(r) * r**2 for k, r in radii.items()}
    tensor = np.array([[entry["r" + "".join(sorted(i + j))] for j in "xyz"] for i in "xyz"])
    com = np.array([float(row[f"com_{axis}_percent"]) / 100 for axis in "xyz"])
    return MeanSegment(
        row["origin"],
        float(row["mass_percent"]),
        com,
        nearest_physical(tensor),
        float(row["mean_length_m"]),
    )


def draw_person(rng: np.random.Generator, richness: Richness, sex: str = "") -> Person:
    """Draw a person of the given sex (or of either)."""
    sex = sex or str(rng.choice(["M", "F"]))
    stature = float(np.clip(rng.normal(*STATURE_M[sex]), 1.48, 2.0))
    body_mass_index = float(np.clip(rng.normal(*BODY_MASS_INDEX), 19.0, 30.0))
    mass = body_mass_index * stature**2
    size = stature / MEAN_STATURE_M[sex]
    lengths = _draw_lengths(rng, sex, size)
    widths = {
        "pelvis": PELVIS_WIDTH_M[sex] * size * _factor(rng, 0.05),
        "thorax": THORAX_WIDTH_M[sex] * size * _factor(rng, 0.05),
        "shoulder": HALF_SHOULDER_WIDTH_M[sex] * size * _factor(rng, 0.03),
    }
    ankle_height = 0.045 * stature
    joints, predicted = _draw_joints(rng, sex, lengths, widths, richness.joint_centre_offset)
    hinges = _draw_hinges(rng, richness.hinge_tilt)
    inertias = _draw_inertias(
        rng, sex, mass, lengths, joints["tjc"], body_mass_index, richness.inertia_variation
    )
    markers = place_markers(
        rng, sex, lengths, joints, predicted, hinges, widths, ankle_height, richness
    )
    if richness.girdle:
        joints, markers = with_girdle(
            rng, joints, markers, lengths, hinges, widths["thorax"], ankle_height, richness
        )
    return Person(
        sex=sex,
        stature_m=stature,
        mass_kg=mass,
        lengths_m=lengths,
        joints_m=joints,
        hinges=hinges,
        inertias=inertias,
        markers=markers,
        ankle_height_m=ankle_height,
        pelvis_width_m=widths["pelvis"],
        thorax_width_m=widths["thorax"],
        trunk_bend=richness.trunk_bend,
        tissue=draw_tissue(rng) if richness.measured_tissue else {},
    )


def _factor(rng: np.random.Generator, spread: float) -> float:
    """A positive factor whose mean is 1 and whose logarithm has this standard deviation."""
    return float(np.exp(spread * rng.standard_normal() - 0.5 * spread**2))


def _draw_lengths(rng: np.random.Generator, sex: str, size: float) -> dict[str, float]:
    mean = mean_segments(sex)
    lengths = {
        name: mean[name].length_m * size * _factor(rng, 0.035)
        for name in ("head", "thorax", "abdomen")
    }
    lengths["upper_torso"] = lengths["thorax"] + lengths["abdomen"]
    for name in LIMB_LENGTHS:
        both = mean[name].length_m * size * _factor(rng, 0.035)
        for side in SIDES:
            lengths[f"{name}_{side}"] = both * _factor(rng, 0.005)
    return {name: float(length) for name, length in lengths.items()}


def _draw_joints(
    rng: np.random.Generator,
    sex: str,
    lengths: dict[str, float],
    widths: dict[str, float],
    offset_scale: float,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """True joints in their parents' frames, and how far landmarks mispredict some of them.

    The second dictionary holds, for ljc, cjc and shoulder_*, true minus predicted (3,).
    """

    def offset(size_m: float) -> np.ndarray:
        return offset_scale * size_m * rng.standard_normal(3)

    errors = {
        "ljc": offset(0.006),
        "cjc": offset(0.005) * np.array([1.0, 1.0, 0.4]),
        "shoulder_l": offset(0.006),
        "shoulder_r": offset(0.006),
    }
    lumbar = np.array(LUMBAR_FROM_ASIS[sex]) * widths["pelvis"]
    tjc_x = -0.01 * offset_scale
    joints = {
        "tjc": np.array([tjc_x, lengths["abdomen"], 0.0]),
        "cjc": np.array([-tjc_x, lengths["thorax"], 0.0]),
    }
    for side, sign in SIDE_SIGN.items():
        mirror = np.array([1.0, 1.0, sign])
        hip = mirror * HIP_FROM_ASIS[sex] * widths["pelvis"]
        joints[f"hip_{side}"] = hip + offset(0.0065) - (lumbar + errors["ljc"])
        shoulder_y = -0.045 * lengths["upper_torso"] / 0.477
        joints[f"shoulder_{side}"] = np.array([0.005, shoulder_y, sign * widths["shoulder"]])
        joints[f"elbow_{side}"] = np.array([0.0, -lengths[f"upper_arm_{side}"], 0.0])
        joints[f"wrist_{side}"] = np.array([0.0, -lengths[f"forearm_{side}"], 0.0])
        joints[f"knee_{side}"] = np.array([0.0, -lengths[f"thigh_{side}"], 0.0])
        joints[f"ankle_{side}"] = np.array([0.0, -lengths[f"shank_{side}"], 0.0])
    return joints, errors


def _draw_hinges(rng: np.random.Generator, tilt_scale: float) -> dict[str, np.ndarray]:
    hinges = {}
    for joint in ("elbow", "knee"):
        for side in SIDES:
            tilt = np.deg2rad(3.0) * tilt_scale * rng.standard_normal(3)
            hinges[f"{joint}_{side}"] = from_rotation_vector(tilt) @ np.array([0.0, 0.0, 1.0])
    return hinges


def _draw_inertias(
    rng: np.random.Generator,
    sex: str,
    mass: float,
    lengths: dict[str, float],
    tjc: np.ndarray,
    body_mass_index: float,
    scale: float,
) -> dict[str, Inertia]:
    """True inertial parameters: the mean person's, varied, summing to the mass."""
    mean = mean_segments(sex)
    common = {name: _factor(rng, scale * MASS_SPREAD.get(name, 0.11)) for name in mean}
    masses = {
        body: mean[kind].mass_percent
        * common[kind]
        * (_factor(rng, 0.03 * scale) if kind != body else 1.0)
        for body, kind in _kinds().items()
    }
    total = sum(masses.values())
    return {
        body: _draw_inertia(
            rng,
            body,
            mean[kind],
            mass * masses[body] / total,
            _table_length(body, lengths, sex),
            tjc if mean[kind].origin == "TJC" else np.zeros(3),  # others: the body's own origin
            body_mass_index,
            scale,
        )
        for body, kind in _kinds().items()
    }


def _kinds() -> dict[str, str]:
    """The row of the mean person for each of the 16 bodies."""
    return {b: b.removesuffix("_l").removesuffix("_r") for b in BODIES}


def _table_length(body: str, lengths: dict[str, float], sex: str) -> float:
    """The length [m] that the mean person's row is scaled by."""
    if body == "lower_torso":  # its own length follows the trunk's
        mean = mean_segments(sex)
        upper = mean["thorax"].length_m + mean["abdomen"].length_m
        return mean["lower_torso"].length_m * lengths["upper_torso"] / upper
    return lengths[body]


def _draw_inertia(
    rng: np.random.Generator,
    body: str,
    mean: MeanSegment,
    mass: float,
    length: float,
    origin: np.ndarray,
    body_mass_index: float,
    scale: float,
) -> Inertia:
    mirror = np.array([1.0, 1.0, -1.0 if body.endswith("_l") else 1.0])
    kind = body.removesuffix("_l").removesuffix("_r")
    com = origin + mirror * mean.com * length
    com = com + scale * COM_SPREAD_M.get(kind, 0.004) * rng.standard_normal(3)
    if body in ("abdomen", "lower_torso"):  # a belly shifts the trunk's mass forward
        com[0] += scale * 0.0015 * (body_mass_index - BODY_MASS_INDEX[0])
    tensor = np.outer(mirror, mirror) * mean.tensor * mass * length**2
    tensor = varied_tensor(tensor, rng, 0.12 * scale) if scale else tensor
    return Inertia(mass, com, tensor)
