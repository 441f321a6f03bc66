"""A person: lengths, joints and inertial parameters after de Leva 1996, each a little off.

A segment's frame sits at its proximal joint, the pelvis' between the hips; in anatomical standing
its axes are the lab's (x ahead, y to the left, z up).

De Leva gives centres of mass along the segments only, hence on the line between the joints; Dumas
2007, the table of bsip's RM, has those of thighs, shanks and trunk 7 to 29 mm behind that line. On
average over six people, drawn before the trunk's were put onto the line of its joints, the whole
body's centre of mass lay 17 mm ahead of RM's in standing: 10 for trunk and head, 5 for the thighs,
2 for the shanks; the joints themselves agreed to a few millimetres. Putting the trunk's onto the
line takes 4 mm off on average. What is left is a difference between two tables and the people's own
deviations from theirs, not a fault of a recording.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

SIDES = {"r": -1.0, "l": 1.0}  # and where it lies along y
LIMBS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
SEGMENTS = (
    "pelvis",
    "torso",
    "head",
    *(f"{limb}_{side}" for side in SIDES for limb in LIMBS),
)


@dataclass(frozen=True)
class Row:
    """Of de Leva's table 4. mass, com (from the proximal end), radii of gyration: percent.

    radii : about the sagittal, the transverse and the longitudinal axis.
    """

    mass: float
    com: float
    radii: tuple[float, float, float]
    length_mm: float


def rows_of(name: str) -> list[dict[str, str]]:
    """Of a table of this folder."""
    text = Path(__file__).with_name(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))


def _row(row: dict[str, str]) -> Row:
    mass, com, x, y, z, length_mm = (float(number) for number in list(row.values())[2:])
    return Row(mass, com, (x, y, z), length_mm)


STATURE_M = {"M": 1.741, "F": 1.735}
TABLE = {
    sex: {row["segment"]: _row(row) for row in rows_of("de_leva.csv") if row["sex"] == sex}
    for sex in STATURE_M
}
# Of a person of the table's stature [m].
_ANKLE_HEIGHT = 0.073
_NECK_BELOW_VERTEX = 0.249
_HALF_HIPS = {"M": 0.084, "F": 0.087}
HALF_SHOULDERS = {"M": 0.176, "F": 0.160}
_LUMBAR = (-0.022, 0.0, 0.108)  # the one joint of the trunk, about L4/L5, from between the hips
_SPINE, _BELOW, _WAIST_M = 0.33, 0.13, 0.11  # way to the neck, part of the torso's mass, radius
_NECK_AHEAD = -0.012
_HEAD_AHEAD = 0.018
# Standard deviations of people about the table [m], [rad] and of logarithms.
_COM_SD_M = {row["kind"]: float(row["com_sd_m"]) for row in rows_of("people.csv")}
_LENGTH_SD, _MASS_SD, _MASS_SIDE_SD, _INERTIA_SD, _INERTIA_SIDE_SD = 0.02, 0.09, 0.03, 0.13, 0.04
_INERTIA_TURN_RAD = 0.08


@dataclass
class Part:
    """mass : kg, percent of the body's before that is known. com_m (3,). inertia (3, 3) : for that
    mass, about the centre of mass."""

    mass: float
    com_m: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class Body:
    """One person.

    scale : stature over that of the table. lengths_m : by row of the table. joints_m : (3,) by name
    (``lumbar``, ``neck``, ``hip_r``, ``shoulder_r``, ...) in the frame of the segment above it
    (hips, lumbar: pelvis; spine, neck, shoulders: torso). The abdomen, from lumbar to spine, is the
    part of the torso that may turn less; its frame is the torso's while the spine is straight.
    parts : by segment, in its frame.
    """

    sex: str
    mass_kg: float
    height_m: float
    scale: float
    lengths_m: dict[str, float]
    joints_m: dict[str, np.ndarray]
    parts: dict[str, Part]

    @property
    def ankle_height_m(self) -> float:
        return _ANKLE_HEIGHT * self.scale

    @property
    def foot_centre_m(self) -> np.ndarray:
        """Middle of the foot's support, from the ankle in the foot's frame (3,)."""
        return np.array([0.048 * self.scale, 0.0, -self.ankle_height_m])

    @property
    def ball_m(self) -> np.ndarray:
        """What the foot turns about when the heel rises, from the ankle in its frame (3,)."""
        return np.array([0.135 * self.scale, 0.0, -self.ankle_height_m])

    @property
    def leg_m(self) -> float:
        return self.lengths_m["thigh"] + self.lengths_m["shank"]


def kind_of(segment: str) -> str:
    """``thigh`` of ``thigh_r``."""
    return segment[:-2] if segment[-2:] in ("_r", "_l") else segment


def draw_body(sex: str, mass_kg: float, height_m: float, rng: np.random.Generator) -> Body:
    """A person of that mass and stature, off the table mostly alike on both sides."""
    scale = height_m / STATURE_M[sex]
    table = TABLE[sex]
    lengths = {
        name: row.length_mm / 1000.0 * scale * (1.0 + rng.normal(0.0, _LENGTH_SD))
        for name, row in table.items()
    }
    joints = _joints(sex, height_m, scale, lengths, rng)
    parts = _inertial_parameters(table, scale, lengths, joints)
    _vary(parts, rng)
    factor = mass_kg / sum(part.mass for part in parts.values())
    for part in parts.values():
        part.mass *= factor
        part.inertia *= factor
    _split_torso(joints, parts)
    return Body(sex, mass_kg, height_m, scale, lengths, joints, parts)


def suprasternale_m(lengths_m: dict[str, float]) -> float:
    """Height above the hips, standing."""
    return lengths_m["lower_trunk"] + lengths_m["middle_trunk"] + lengths_m["upper_trunk"]


def usual_neck_m(height_m: float, scale: float, lengths_m: dict[str, float]) -> float:
    """Height of the neck joint above the hips, standing, before a person deviates from it."""
    hips = _ANKLE_HEIGHT * scale + lengths_m["shank"] + lengths_m["thigh"]
    return height_m - hips - _NECK_BELOW_VERTEX * scale


def _joints(
    sex: str, height_m: float, scale: float, lengths: dict[str, float], rng: np.random.Generator
) -> dict[str, np.ndarray]:
    nearly_central = np.array([1.0, 0.2, 1.0])
    lumbar = np.array(_LUMBAR) * scale + rng.normal(0.0, 0.008, 3) * nearly_central
    neck = np.array([_NECK_AHEAD * scale, 0.0, usual_neck_m(height_m, scale, lengths)])
    neck += rng.normal(0.0, 0.006, 3) * nearly_central
    joints = {"lumbar": lumbar, "neck": neck - lumbar}
    shoulders = suprasternale_m(lengths) - 0.042 * scale
    for side, sign in SIDES.items():
        hip = np.array([0.0, sign * _HALF_HIPS[sex] * scale, 0.0])
        joints[f"hip_{side}"] = hip + rng.normal(0.0, 0.004, 3)
        shoulder = np.array([_NECK_AHEAD * scale, sign * HALF_SHOULDERS[sex] * scale, shoulders])
        joints[f"shoulder_{side}"] = shoulder + rng.normal(0.0, 0.006, 3) - lumbar
    return joints


def _inertial_parameters(
    table: dict[str, Row], scale: float, lengths: dict[str, float], joints: dict[str, np.ndarray]
) -> dict[str, Part]:
    """The table's masses [percent], centres of mass and inertias, per segment."""
    parts: dict[str, Part] = {}

    def put(segment: str, row: str, com: Sequence[float], order: Sequence[int] = (0, 1, 2)) -> None:
        inertia = _inertia(table[row], lengths[row], order)
        parts[segment] = Part(table[row].mass, np.array(com, float), inertia)

    lumbar = joints["lumbar"]
    pelvis_up = lengths["lower_trunk"] * (1.0 - table["lower_trunk"].com / 100.0)
    put("pelvis", "lower_trunk", [lumbar[0] * pelvis_up / lumbar[2], 0.0, pelvis_up])
    head_up = _NECK_BELOW_VERTEX * scale - lengths["head"] * table["head"].com / 100.0
    put("head", "head", [_HEAD_AHEAD * scale, 0.0, head_up])
    for side in SIDES:
        for limb in ("upper_arm", "forearm", "hand", "thigh", "shank"):
            put(f"{limb}_{side}", limb, [0.0, 0.0, -lengths[limb] * table[limb].com / 100.0])
        ahead = -0.06 * scale + lengths["foot"] * table["foot"].com / 100.0
        put(f"foot_{side}", "foot", [ahead, 0.0, -0.038 * scale], order=(2, 1, 0))
    return parts | {"torso": _torso(table, lengths, joints)}


def _inertia(row: Row, length_m: float, order: Sequence[int] = (0, 1, 2)) -> np.ndarray:
    """About the centre of mass, for a mass in percent; order : which radius belongs to x, y, z."""
    radii = np.array(row.radii)[list(order)] / 100.0 * length_m
    return row.mass * np.diag(radii**2)


def _torso(table: dict[str, Row], lengths: dict[str, float], joints: dict[str, np.ndarray]) -> Part:
    """Upper and middle trunk as one, both on the line from the lumbar joint to the neck."""
    line = joints["neck"] / joints["neck"][2]  # ahead and up per metre up
    top, bottom, both = suprasternale_m(lengths), joints["lumbar"][2], []
    for name in ("upper_trunk", "middle_trunk"):
        above_hips = top - lengths[name] * table[name].com / 100.0
        both.append((table[name], lengths[name], line * (above_hips - bottom)))
        top -= lengths[name]
    mass = sum(row.mass for row, _, _ in both)
    com = sum(row.mass * place for row, _, place in both) / mass
    inertia = np.zeros((3, 3))
    for row, length, place in both:
        d = place - com
        inertia += _inertia(row, length) + row.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Part(mass, com, inertia)


def _split_torso(joints: dict[str, np.ndarray], parts: dict[str, Part]) -> None:
    """The abdomen, a cylinder, and what it leaves of the torso, in place."""
    joints["spine"] = _SPINE * joints["neck"]
    whole = parts["torso"]
    below, low = _BELOW * whole.mass, 0.5 * joints["spine"]
    high = (whole.mass * whole.com_m - below * low) / (whole.mass - below)
    long = np.linalg.norm(joints["spine"])
    across = below * (3.0 * _WAIST_M**2 + long**2) / 12.0
    own = np.diag([across, across, 0.5 * below * _WAIST_M**2])
    apart, shared = low - high, below * (whole.mass - below) / whole.mass
    pair = shared * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    parts["abdomen"] = Part(below, low, own)
    parts["torso"] = Part(whole.mass - below, high, whole.inertia - own - pair)


def _vary(parts: dict[str, Part], rng: np.random.Generator) -> None:
    """Take a person off the table, in place."""
    common: dict[str, tuple[float, np.ndarray, np.ndarray]] = {}
    for segment in SEGMENTS:
        part, kind = parts[segment], kind_of(segment)
        if kind not in common:
            heavier, off = rng.normal(0.0, _MASS_SD), rng.normal(0.0, 1.0, 3)
            common[kind] = heavier, off, rng.normal(0.0, _INERTIA_SD, 3)
        heavier, off, larger = common[kind]
        paired = segment != kind
        if paired:
            heavier += rng.normal(0.0, _MASS_SIDE_SD)
        part.mass *= np.exp(heavier)
        mirrored = 0.3 if not paired else (-1.0 if segment.endswith("_l") else 1.0)
        own = 0.35 * rng.normal(0.0, 1.0, 3) * [1.0, 1.0 if paired else 0.3, 1.0]
        part.com_m = part.com_m + _COM_SD_M[kind] * (0.9 * off * [1.0, mirrored, 1.0] + own)
        stretch = np.exp((larger + rng.normal(0.0, _INERTIA_SIDE_SD, 3)) / 2.0)
        Q = Rotation.from_rotvec(rng.normal(0.0, _INERTIA_TURN_RAD, 3)).as_matrix()
        part.inertia = Q @ (part.inertia * np.outer(stretch, stretch)) @ Q.T
