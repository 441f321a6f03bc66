"""The drawn people are physical and as varied as the options say."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import (
    HIP_FROM_ASIS,
    LUMBAR_FROM_ASIS,
    Inertia,
    combined,
    draw_person,
    mean_segments,
    nearest_physical,
    second_moments,
)
from tests.simulate.conftest import NOTHING_RICH, is_physical

LABELS = """
RTEM LTEM FHEAD C7 T10 XIPH IJ RSCAP RASIS LASIS RPSIS LPSIS RAC LAC RUA LUA RELB LELB
RFA LFA RWRR RWRU LWRR LWRU RHAND LHAND RKNEL RKNEM LKNEL LKNEM RMALL RMALM LMALL LMALM
RCAL LCAL RMT2 LMT2
"""


@pytest.mark.parametrize("seed", range(12))
def test_true_parameters_are_physical(seed):
    person = draw_person(np.random.default_rng(seed), Richness())
    assert all(is_physical(part) for part in person.inertias.values())
    segments = person.segment_inertias()
    assert tuple(segments) == SEGMENTS
    assert all(is_physical(part) for part in segments.values())
    total = sum(part.mass_kg for part in segments.values())
    assert total == pytest.approx(person.mass_kg, rel=1e-12)
    assert set(person.markers) == set(LABELS.split())


def test_people_differ_from_the_mean_person_unless_told_not_to():
    plain = Richness(inertia_variation=0.0)
    person = draw_person(np.random.default_rng(1), plain, "M")
    mean = mean_segments("M")
    total = sum(mean[kind].mass_percent * (2 if kind in PAIRED else 1) for kind in mean)
    share = 100.0 * person.inertias["thigh_l"].mass_kg / person.mass_kg
    assert share == pytest.approx(100.0 * mean["thigh"].mass_percent / total)
    varied = draw_person(np.random.default_rng(1), Richness(), "M")
    assert varied.inertias["thigh_l"].mass_kg != varied.inertias["thigh_r"].mass_kg


PAIRED = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")


def test_regressions_miss_the_true_hip_by_millimetres():
    misses = []
    for seed in range(30):
        person = draw_person(np.random.default_rng(seed), Richness(placement_error_m=0.0))
        right, left = (person.markers[m].position_m for m in ("RASIS", "LASIS"))
        predicted = (
            0.5 * (right + left) + np.array(HIP_FROM_ASIS[person.sex]) * person.widths_m["pelvis"]
        )
        misses.append(np.linalg.norm(predicted - person.joints_m["hip_r"]))
    assert 0.007 < np.mean(misses) < 0.016


def test_regressions_are_exact_without_joint_centre_offset():
    person = draw_person(np.random.default_rng(4), NOTHING_RICH)
    right, left = (person.markers[m].position_m for m in ("RASIS", "LASIS"))
    width = np.linalg.norm(right - left)
    lumbar = 0.5 * (right + left) + np.array(LUMBAR_FROM_ASIS[person.sex]) * width
    assert np.abs(lumbar).max() < 1e-12
    for axis in person.hinges.values():
        assert np.allclose(axis, [0.0, 0.0, 1.0])


def test_combined_inertia_of_two_points():
    ball = Inertia(2.0, np.zeros(3), np.zeros((3, 3)))
    pair = combined([(ball, np.array([0.0, 1.0, 0.0])), (ball, np.array([0.0, -1.0, 0.0]))])
    assert pair.mass_kg == 4.0
    assert np.allclose(pair.tensor_kgm2, np.diag([4.0, 0.0, 4.0]))


def test_the_printed_female_torso_is_repaired():
    r = np.array([[29, 22, 5], [22, 27, 0], [5, 0, 29]]) / 100.0
    printed = r**2
    printed[1, 2] = printed[2, 1] = -(0.05**2)
    assert np.linalg.eigvalsh(second_moments(printed)).min() < 0.0
    assert np.linalg.eigvalsh(second_moments(nearest_physical(printed))).min() > 0.0
