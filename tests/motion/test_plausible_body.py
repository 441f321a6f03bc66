"""Skeletons that are no person's are said, and refused where nobody can be so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.motion.inverse_kinematics import neutral
from bsip_cli.motion.plausible_body import doubts_about
from bsip_cli.stated import BMI_KG_M2, odd_pair
from tests.body.standing_person import standing


@pytest.fixture(scope="module")
def person():
    return standing().person


def _doubts(person, q=None, height_m=None, mass_kg=70.0):
    q = np.array([neutral(person)]) if q is None else q
    return doubts_about(person, q, "M", height_m, mass_kg)


def _longer(person, factors: dict[str, float]):
    names = person.skeleton.segments
    factor = np.array([factors.get(name, 1.0) for name in names])
    return replace(person, lengths_m=person.lengths_m * factor)


def test_a_person_is_one(person):
    assert _doubts(person) == []


@pytest.mark.parametrize(
    ("factors", "words", "is_gross"),
    [
        ({"foot_l": 1.6}, "left foot is", False),
        ({"foot_l": 0.63}, "right one", False),
        ({"shank_r": 0.8}, "right one", False),
        ({"thigh_r": 2.3}, "right thigh is", True),
        ({"forearm_l": 0.7}, "left forearm is", False),
    ],
)
def test_lengths(person, factors, words, is_gross):
    found = _doubts(_longer(person, factors), height_m=1.77)
    assert any(words in one.found for one in found)
    assert any(one.is_gross for one in found) == is_gross


@pytest.mark.parametrize(
    ("height_m", "said", "is_gross"),
    [(1.77, 0, False), (1.45, 1, False), (1.0, 1, True), (3.0, 1, True)],
)
def test_stature(person, height_m, said, is_gross):
    found = [
        one for one in _doubts(person, height_m=height_m, mass_kg=np.nan) if "tall" in one.found
    ]
    assert len(found) == said and any(one.is_gross for one in found) == is_gross


def test_body_mass_index_has_the_range_of_the_table(person):
    """What participants.tsv takes without a word is not doubted later, and the other way round."""
    low, high = BMI_KG_M2
    for index, is_odd in ((low - 0.1, 1), (low + 0.1, 0), (high - 0.1, 0), (high + 0.1, 1)):
        mass_kg = index * 1.77**2
        found = _doubts(person, height_m=1.77, mass_kg=mass_kg)
        assert len([one for one in found if "index" in one.found]) == is_odd
        assert (odd_pair(mass_kg, 1.77) != "") == bool(is_odd)
    assert _doubts(person, mass_kg=np.nan) == []


@pytest.mark.parametrize(
    ("joint", "degrees", "said"),
    [("waist", 179, True), ("waist", 60, False), ("hip_l", 120, False), ("ankle_r", 150, True)],
)
def test_joints(person, joint, degrees, said):
    q = np.array([neutral(person)] * 3)
    i = person.skeleton.joints.index(joint)
    start = person.skeleton.q_starts[i]
    q[:, start : start + 4] = Rotation.from_euler("y", degrees, degrees=True).as_quat()
    found = _doubts(person, q)
    assert [one.is_gross for one in found] == [True] * said
