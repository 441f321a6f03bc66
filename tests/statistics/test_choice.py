"""OM only where it is better than both others by more than its standard error; what a correction
gains, with its interval."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.statistics.choice import (
    PAIRS,
    BlockErrors,
    Difference,
    between,
    block_errors,
    chosen,
    error_gain,
    pooled,
    within,
)
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


# --- errors before and after, per block and over all ----------------------------------------------


N, BLOCK = 4000, 100
BLOCKS = np.arange(N) // BLOCK


def signals(after_scale: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    measured = rng.normal(size=N)
    return measured, measured + 2 * rng.normal(size=N), measured + after_scale * rng.normal(size=N)


def gain_of(errors: BlockErrors):
    return error_gain(errors, np.random.default_rng(1))


def test_errors_are_those_of_all_samples():
    measured, before, after = signals(1.0)
    gain = gain_of(block_errors(measured, before, after, BLOCKS))
    assert gain.rmse_before == pytest.approx(np.sqrt(np.mean((before - measured) ** 2)))
    assert gain.rmse_after == pytest.approx(np.sqrt(np.mean((after - measured) ** 2)))
    assert gain.percent == pytest.approx(100 * (1 - gain.rmse_after / gain.rmse_before))


def test_interval_covers_the_true_gain_as_often_as_it_says():
    covered = [
        gain.ci_low < 50 < gain.ci_high
        for gain in (gain_of(block_errors(*signals(1.0, k), BLOCKS)) for k in range(200))
    ]
    assert 0.90 <= np.mean(covered) <= 0.99


def test_a_loss_is_negative():
    gain = gain_of(block_errors(*signals(3.0), BLOCKS))
    assert gain.percent == pytest.approx(-50, abs=6)
    assert gain.ci_high < 0


def test_samples_without_a_signal_do_not_count():
    """No centre of pressure in flight."""
    measured, before, after = signals(1.0)
    known = BLOCKS % 4 > 0
    before = np.where(known, before, np.nan)
    errors = block_errors(measured, before, after, BLOCKS)
    assert errors.samples.tolist() == [BLOCK] * (3 * N // (4 * BLOCK))
    expected = block_errors(measured[known], before[known], after[known], BLOCKS[known])
    assert gain_of(errors) == gain_of(expected)


def test_nothing_to_compare():
    nothing = np.zeros(0)
    gain = gain_of(block_errors(nothing, nothing, nothing, nothing.astype(int)))
    assert np.isnan([gain.rmse_before, gain.percent, gain.ci_low]).all()


def test_one_block_has_no_interval():
    measured, before, after = signals(1.0)
    gain = gain_of(block_errors(measured, before, after, np.zeros(N, dtype=int)))
    assert np.isfinite(gain.percent)
    assert np.isnan([gain.ci_low, gain.ci_high]).all()


def test_trials_are_pooled_block_by_block():
    measured, before, after = signals(1.0)
    whole = block_errors(measured, before, after, BLOCKS)
    half = N // 2
    parts = [
        block_errors(measured[part], before[part], after[part], BLOCKS[part])
        for part in (slice(0, half), slice(half, N))
    ]
    assert gain_of(pooled(parts)) == gain_of(whole)
