"""Is this a person? The skeleton that came out of scaling, against what people are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.anthropometry import mean_length_m, stature_m
from bsip_cli.body.person import Person
from bsip_cli.segments import in_words

# Segments' lengths at one stature: standard deviations of 4 to 6 % in adults (Dumas 2007, table 1),
# children's proportions a tenth off, joint centres another 5 %. Beyond these no person is.
_DOUBTED, _IMPOSSIBLE = 1.35, 2.0
_UNEQUAL = 0.15  # of the mean: left and right differ by 2 % at most in 95 % of people
_STATURE, _NO_STATURE = 1.12, 1.4  # from the long segments over the stated height
_LONG = ("torso", "thigh", "shank")
_BMI = (12.0, 60.0)  # kg/m2: as where masses and heights are read (stated.py)
# Rotation from the neutral pose that no healthy joint goes beyond [degrees]. Shoulders may turn
# over, and wrists, which turn with the forearm here.
_REACH = {"waist": 110.0, "neck": 120.0, "hip": 160.0, "ankle": 110.0}
# Joint to joint short, or held by two markers: their lengths say little.
_VAGUE = ("lower_torso", "upper_torso", "head", "hand_l", "hand_r")


@dataclass(frozen=True)
class Doubt:
    """One thing that people are not: what was found, what was expected, and what may be the cause.

    ``is_gross``: no person is so, whatever the measurement's errors.
    """

    found: str
    expected: str
    cause: str
    is_gross: bool


def doubts_about(
    person: Person, q: np.ndarray, sex: str, height_m: float | None, mass_kg: float
) -> list[Doubt]:
    """What makes the skeleton no person's.

    ``q`` (N, nq) are poses of some frames; ``height_m`` is the stated height, None if there is
    none; ``mass_kg`` is NaN where it is not known.
    """
    rows = np.array(person.skeleton.table_rows)
    own = stature_m(sex, {row: float(person.lengths_m[rows == row].mean()) for row in _LONG})
    stature = height_m or own
    doubts, index = [], mass_kg / stature**2
    if height_m is not None and (ratio := max(own / height_m, height_m / own)) > _STATURE:
        doubts.append(
            Doubt(
                f"a trunk and legs of a person {own:.2f} m tall",
                f"the stated {height_m:.2f} m",
                "the unit of the markers, the height in participants.tsv, or labels on wrong "
                "segments",
                ratio > _NO_STATURE,
            )
        )
    doubts += [*_about_lengths(person, sex, stature), *_about_sides(person)]
    if np.isfinite(index) and not _BMI[0] <= index <= _BMI[1]:
        doubts.append(
            Doubt(
                f"{mass_kg:.1f} kg at {stature:.2f} m, a body-mass index of {index:.0f} kg/m2",
                f"{_BMI[0]:g} to {_BMI[1]:g} kg/m2",
                "the unit of the mass, of the height or of the markers",
                False,
            )
        )
    return [*doubts, *_about_joints(person, q)]


def _about_lengths(person: Person, sex: str, stature: float) -> Iterator[Doubt]:
    for name, row, length in _segments(person):
        usual = mean_length_m(sex, row, stature)
        ratio = max(length / usual, usual / max(length, 1e-6))
        if ratio > _DOUBTED:
            yield Doubt(
                f"the {in_words(name)} is {1e3 * length:.0f} mm long",
                f"about {1e3 * usual:.0f} mm at {stature:.2f} m",
                "a label on the wrong place",
                ratio > _IMPOSSIBLE and row in _LONG,
            )


def _about_sides(person: Person) -> Iterator[Doubt]:
    lengths = {name: length for name, _, length in _segments(person)}
    for name, left in lengths.items():
        right = lengths.get(f"{name[:-2]}_r") if name.endswith("_l") else None
        if right is not None and abs(left - right) > _UNEQUAL * (left + right) / 2:
            yield Doubt(
                f"the left {in_words(name[:-2])} is {1e3 * left:.0f} mm long and the right one "
                f"{1e3 * right:.0f} mm",
                f"lengths that differ by less than {_UNEQUAL:.0%}",
                "a label on the wrong place on one side",
                False,
            )


def _about_joints(person: Person, q: np.ndarray) -> Iterator[Doubt]:
    skeleton = person.skeleton
    for i, (joint, kind) in enumerate(zip(skeleton.joints, skeleton.joint_types, strict=True)):
        limit = next((most for name, most in _REACH.items() if joint.startswith(name)), None)
        if kind != "spherical" or limit is None or not len(q):
            continue
        w = np.abs(q[:, skeleton.q_starts[i] + 3])
        turned = float(np.median(2 * np.degrees(np.arccos(np.clip(w, 0, 1)))))
        if turned > limit:
            yield Doubt(
                f"the {in_words(joint)} is turned by {turned:.0f} degrees from standing straight",
                f"less than {limit:.0f} degrees",
                "left and right, or medial and lateral, labels exchanged on one side of the joint, "
                "or a label on another segment",
                True,
            )


def _segments(person: Person) -> Iterator[tuple[str, str, float]]:
    """Segments with mass and markers: name, row of the table, length [m]."""
    skeleton = person.skeleton
    for i, name in zip(skeleton.bodies, skeleton.body_names, strict=True):
        if not person.held[i] and name not in _VAGUE:
            yield name, skeleton.table_rows[i], float(person.lengths_m[i])


def words_of(doubts: Sequence[Doubt]) -> str:
    """Several doubts as one clause."""
    return "; ".join(f"{one.found} (expected {one.expected}; {one.cause})" for one in doubts)
