"""How tall the markers make a person, against what is stated."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.c3d import open_c3d
from bsip_cli.recordings.scene import Stature, crossed_limbs, stature

LABELS = ("LFHD", "RFHD", "C7", "LASI", "RASI", "LHEE", "LTOE", "RHEE", "RTOE")
PARTS = np.array([0.985, 0.985, 0.88, 0.62, 0.62, 0.03, 0.03, 0.03, 0.03])
CHILDREN = ("HC002D", "HC030A", "HC031A", "HC032A", "HC033A", "HC038A", "HC039A")


def standing(tall_m: float, frames: int = 100) -> np.ndarray:
    places = np.zeros((frames, len(LABELS), 3))
    places[..., 2] = PARTS * tall_m
    places[:, 5:, 0] = [-0.12, 0.12, -0.12, 0.12]
    return places


def told(tall_m: float, labels=LABELS, places=None) -> Stature:
    return stature(labels, standing(tall_m) if places is None else places)


@pytest.mark.parametrize("ratio", [0.86, 0.88, 1.13, 1.16])
def test_a_stated_height_that_is_not_the_markers_is_said_with_both_numbers(ratio):
    found, expected, action = told(1.70).against(1.70 * ratio)
    assert f"{1.70 * ratio:.2f} m" in found and f"{told(1.70).height_m:.2f} m" in found
    assert "11 %" in expected and "height_m" in action


@pytest.mark.parametrize("ratio", [0.93, 0.985, 1.0, 1.02, 1.07])
def test_what_markers_cannot_tell_is_not_said(ratio):
    found = told(1.70)
    assert found.against(found.height_m * ratio) is None


def test_toes_that_hang_in_the_air_make_nobody_taller():
    places = standing(1.70)
    places[20:90, :, 2] += 0.3
    places[20:90, [6, 8], 2] -= 0.15
    assert told(1.70, places=places).height_m == pytest.approx(told(1.70).height_m, rel=0.01)


def test_a_breastbone_alone_tells_no_height():
    labels = ("C3XX", "C4XX", "STRN", *LABELS[3:])
    assert told(1.70, labels).part == "lower_torso"
    assert told(1.70, (*labels[:3], "A1XX", "A2XX", *labels[5:])) is None


def test_who_never_stands_on_a_flat_foot_has_no_height():
    places = standing(1.70)
    places[:, [6, 8], 2] += 0.2 * (np.arange(100) % 2)[:, None]
    places[:, [5, 7], 2] += 0.2 * (1 - np.arange(100) % 2)[:, None]
    assert told(1.70, places=places) is None


def test_of_several_trials_the_head_counts_and_the_usual_one():
    low, *heads = (Stature(1.3, "lower_torso"), *(Stature(h, "head") for h in (1.7, 1.71, 2.0)))
    assert Stature.of_all([low, None, *heads]) == Stature(1.71, "head")
    assert Stature.of_all([None]) is None


@pytest.mark.real
@pytest.mark.parametrize("child", CHILDREN)
def test_children_are_as_tall_as_stated_and_no_sixth_taller(real_data, child):
    recording = open_c3d(real_data / "zoo_children" / f"{child}-static.c3d").recording
    stated_m = recording.stated.height_m
    found = stature(recording.labels, recording.markers_m)
    assert found.part == "head" and found.against(stated_m) is None
    assert found.against(1.16 * stated_m) and found.against(0.86 * stated_m)


def test_ankles_exchanged_in_walking_move_with_the_other_knee():
    signs = {"l": 1.0, "r": -1.0}.items()
    time_s = np.linspace(0.0, 3.0, 150)
    swing = 0.3 * np.sin(2 * np.pi * time_s)
    still = np.zeros_like(swing)
    knees = {s: np.stack([0.5 * k * swing, 0.1 * k + still, 0.5 + still], axis=1) for s, k in signs}
    ankles = {s: np.stack([k * swing, 0.1 * k + still, 0.1 + still], axis=1) for s, k in signs}
    labels = ["LKNE", "RKNE", "LANK", "RANK"]
    markers = np.stack([knees["l"], knees["r"], ankles["l"], ankles["r"]], axis=1)
    assert crossed_limbs(labels, markers) == []
    assert crossed_limbs(labels, markers[:, [0, 1, 3, 2]]) == ["shanks"]
    assert crossed_limbs(labels, markers[:, [1, 0, 3, 2]]) == []
    markers[:, 3] = np.nan
    assert crossed_limbs(labels, markers) == []
