"""Draw a person: sizes, joints, true inertial parameters, marker placements.

Sixteen bodies: the 15 segments of `bsip_cli.segments`, with the upper torso in two
parts (abdomen below T12/L1, thorax above). Body axes: X anterior, Y up along the segment,
Z to the right, on both sides of the body. Origins: lower_torso and abdomen at the lumbar
joint centre (LJC), thorax and head at the cervical (CJC), limbs at their proximal joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from bsip_cli.segments import SEGMENTS, without_side
from bsip_cli.simulate.landmarks import (
    Build,
    Marker,
    Swing,
    draw_tissue,
    place_markers,
    table,
    with_girdle,
)
from bsip_cli.simulate.numerics import from_rotation_vector
from bsip_cli.simulate.options import Richness

BODIES = ("lower_torso", "abdomen", "thorax", *SEGMENTS[2:])
SIDES = ("l", "r")
SIDE_SIGN = {"l": -1.0, "r": 1.0}
MEAN_STATURE_M = {"M": 1.77, "F": 1.61}
STATURE_M = {"M": (1.77, 0.07), "F": (1.64, 0.06)}
BODY_MASS_INDEX = (23.5, 2.8)
PELVIS_WIDTH_M = {"M": 0.238, "F": 0.240}
THORAX_WIDTH_M = {"M": 0.150, "F": 0.132}
LEAST_SHARE = 0.02  # of the largest second moment, of every other
HALF_SHOULDER_WIDTH_M = {"M": 0.178, "F": 0.158}
# Reed's hip and lumbar joint centres from the middle of the ASIS, in pelvis widths,
# ISB pelvis axes (Dumas and Wojtusch 2018).
LUMBAR_FROM_ASIS = {"M": (-0.335, -0.032, 0.0), "F": (-0.340, 0.049, 0.0)}
HIP_FROM_ASIS = {"M": (-0.095, -0.370, 0.361), "F": (-0.139, -0.336, 0.372)}
JOINT_AT_END_OF = {"elbow": "upper_arm", "wrist": "forearm", "knee": "thigh", "ankle": "shank"}
LIMB_LENGTHS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
# Standard deviations of the true parameters about the mean person's.
MASS_SPREAD = {"upper_arm": 0.15, "forearm": 0.15, "hand": 0.15}
COM_SPREAD_M = {"lower_torso": 0.011, "thorax": 0.012, "abdomen": 0.012, "thigh": 0.007}


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
    for row in table("mean_person.csv"):
        if row["sex"] != sex:
            continue
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
    trunk = ("head", "thorax", "abdomen")
    lengths = {name: mean[name].length_m * size * _factor(rng, 0.035) for name in trunk}
    lengths["upper_torso"] = lengths["thorax"] + lengths["abdomen"]
    for name in LIMB_LENGTHS:
        both = mean[name].length_m * size * _factor(rng, 0.035)
        lengths |= {f"{name}_{side}": both * _factor(rng, 0.005) for side in SIDES}
    widths = {
        "pelvis": PELVIS_WIDTH_M[sex] * size * _factor(rng, 0.05),
        "thorax": THORAX_WIDTH_M[sex] * size * _factor(rng, 0.05),
        "shoulder": HALF_SHOULDER_WIDTH_M[sex] * size * _factor(rng, 0.03),
    }
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
