"""OM only where it is better than both others by more than its standard error."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.statistics.choice import PAIRS, Difference, between, chosen, within
from bsip_cli.statistics.methods import OM, RM, RM_MASS


def choice(rm_mass: list[float], om: list[float], is_rare: bool = False) -> str:
    """From errors over RM's, trial by trial."""
    logs = {RM: np.zeros(len(om)), RM_MASS: np.log(rm_mass), OM: np.log(om)}
    return chosen({(a, b): between(logs[a] - logs[b]) for a, b in PAIRS}, is_rare)


@pytest.mark.parametrize(
    ("rm_mass", "om", "use"),
    [
        ([0.9, 0.88, 0.91], [0.7, 0.68, 0.71], OM),
        ([0.9, 0.88, 0.91], [1.1, 1.2, 1.15], RM_MASS),
        ([0.7, 0.68, 0.71], [0.8, 0.79, 0.81], RM_MASS),  # OM gains nothing over one number
        ([1.1, 1.2, 1.15], [1.1, 1.2, 1.15], RM),
        ([0.9, 1.2, 0.95], [0.8, 1.3, 0.85], RM),  # within noise
        ([0.7, 0.7, 0.7], [0.6, 1.1, 0.5], RM_MASS),  # OM is better, but not surely
        ([1.0, 1.0, 1.0], [0.995, 0.995, 0.995], RM),  # what nobody would notice
        ([0.7], [0.5], RM),  # one trial, of which nothing but its mean is known
    ],
)
def test_choice(rm_mass, om, use):
    assert choice(rm_mass, om) == use


def test_a_rare_body_is_never_used():
    assert choice([0.9, 0.88, 0.91], [0.5, 0.51, 0.5], is_rare=True) == RM_MASS
    assert choice([1.0, 1.1, 0.95], [0.5, 0.51, 0.5], is_rare=True) == RM


def test_two_trials_that_agree_by_chance_are_widened():
    """One of 1000 means of two lies outside as often as of twenty."""
    rng = np.random.default_rng(3)
    for n in (2, 3, 20):
        found = [between(rng.normal(size=n)) for _ in range(4000)]
        assert abs(np.mean([one.log < -one.error for one in found]) - 0.159) < 0.02


def residuals(rng: np.random.Generator, size: float) -> np.ndarray:
    """(N, 3) slow errors."""
    return size * lfilter([1], [1, -0.9], rng.normal(size=(1500, 3)), axis=0)


def test_one_trial_is_judged_by_its_independent_samples():
    """As often wrong as one standard error allows; 1,500 independent frames would be so in 40 %."""
    rng = np.random.default_rng(2)

    def judged(size):
        found = residuals(rng, size)
        found[700:800] = np.nan
        return found

    found = [within(judged(1.0), judged(1.0)) for _ in range(400)]
    assert 0.10 < np.mean([one.log < -one.error for one in found]) < 0.22
    better = within(judged(0.5), judged(1.0))
    assert better.is_better() and abs(better.ratio - 0.5) < 0.1


def test_gaps_of_a_component_do_not_count():
    rng = np.random.default_rng(2)
    first, second = residuals(rng, 0.5), residuals(rng, 1.0)
    first[:900, 2] = second[:900, 2] = np.nan
    one = within(first, second)
    rms = [np.sqrt(np.nanmean(r**2, axis=0)) for r in (first, second)]
    assert one.log == pytest.approx(np.log(rms[0] / rms[1]).mean())


def test_nothing_known_is_not_better():
    assert not Difference(-1.0, np.nan).is_better()
