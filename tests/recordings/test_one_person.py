"""Trials of one session that show two bodies."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.one_person import other_bodies, sizes_of

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
