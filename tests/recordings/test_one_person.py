"""Trials of one session that show two bodies."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.one_person import other_bodies, sizes_of
from bsip_cli.recordings.read import open_recording

LABELS = [
    "LASI",
    "RASI",
    "LPSI",
    "RPSI",
    "LTHI",
    "LKNE",
    "LTIB",
    "LANK",
    "LHEE",
    "LTOE",
    "RTHI",
    "RKNE",
    "RTIB",
    "RANK",
    "RHEE",
    "RTOE",
]


def trial(times: float = 1.0, seed: int = 0, spread_m: float = 0.0):
    """Markers at places of their own, which skin shifts from trial to trial."""
    places = np.random.default_rng(1).normal(0.0, 0.3, (len(LABELS), 3))
    places += np.random.default_rng(seed).normal(0.0, spread_m, places.shape)
    return sizes_of(LABELS, np.tile(times * places, (5, 1, 1)))


@pytest.mark.parametrize("times", [0.9, 1.12])
def test_a_trial_of_another_person_is_named_with_both_lengths(times):
    trials = {"static": trial(times), "walk": trial(), "squat": trial()}
    said = other_bodies(trials)
    assert f"in static markers of one segment lie {100 * times:.0f} % as far apart" in said
    assert "as in walk" in said and " mm, not " in said


def test_skin_makes_no_other_person():
    assert other_bodies({f"t{k}": trial(1.0 + 0.01 * (k % 2), k, 2e-3) for k in range(6)}) == ""


def test_too_few_segments_show_nothing():
    few = dict([*trial(1.12).items()][:3])
    assert other_bodies({"static": few, "walk": trial()}) == ""


@pytest.mark.real
@pytest.mark.parametrize(
    ("files", "is_one"),
    [
        *((f"zoo_children/{child}-*.c3d", True) for child in ("HC031A", "HC039A")),
        *((f"{lab}/*.c3d", True) for lab in ("biobuddy_ech", "golf_french")),
        *((f"{lab}/*.trc", True) for lab in ("opencap_subject4", "hamner_other")),
        ("btk_pig/*.c3d", False),
        ("zoo_children/*-static.c3d", False),
    ],
)
def test_public_recordings_of_one_person_and_of_several(real_data, files, is_one):
    recordings = [open_recording(path).recording for path in sorted(real_data.glob(files))]
    sizes = {one.path.stem: sizes_of(one.labels, one.markers_m) for one in recordings}
    assert len(sizes) > 1 and (other_bodies(sizes) == "") == is_one
