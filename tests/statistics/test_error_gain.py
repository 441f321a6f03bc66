"""Errors before and after, per block and over all, with their interval."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.statistics.choice import BlockErrors, block_errors, error_gain, pooled

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
