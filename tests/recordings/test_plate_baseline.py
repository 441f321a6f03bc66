"""FORCE_PLATFORM:ZERO: a baseline that is lost, or somebody who stands there from the first."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.plate_wrench import lost_baseline

N, ZERO = 400, slice(0, 50)


def without(lift_N: np.ndarray):
    said = lost_baseline(lift_N, "1", np.ones(N, bool), ZERO)
    return lift_N if said is None else lift_N - lift_N[ZERO].mean(), said


def step(first_N: float, then_N: float) -> np.ndarray:
    ramp = np.clip((np.arange(N) - 100.0) / 50.0, 0.0, 1.0)
    return first_N + (then_N - first_N) * ramp


@pytest.mark.parametrize(("first_N", "then_N"), [(-250.0, 0.0), (-700.0, -350.0), (-700.0, 4.0)])
def test_who_steps_off_a_plate_of_the_other_sign_was_no_baseline(first_N, then_N):
    lift, said = without(step(first_N, then_N))
    assert said is None
    np.testing.assert_array_equal(lift, step(first_N, then_N))


@pytest.mark.parametrize(("level_N", "load_N"), [(-2880.0, 800.0), (-300.0, 600.0)])
def test_a_pull_that_no_person_makes_is_subtracted(level_N, load_N):
    lift, said = without(step(level_N, level_N + load_N))
    assert said.level == "corrected"
    np.testing.assert_allclose(lift, step(0.0, load_N))
