"""A change of level in autocorrelated signals that also follow known columns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.motion.marker_events import find_level_change

N = 200


def signal(seed: int, correlation: float, spread: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    white = rng.normal(0, spread * np.sqrt(1 - correlation**2), (N + 300, 3))
    return lfilter([1.0], [1.0, -correlation], white, axis=0)[300:]


def columns_of(seed: int) -> np.ndarray:
    t = np.arange(N) / N
    phase = np.random.default_rng(seed).uniform(0, 6, 2)
    return np.stack([np.sin(9 * t + phase[0]), np.sin(23 * t + phase[1])], axis=1)


@pytest.mark.parametrize("correlation", [0.0, 0.7, 0.9])
def test_a_step_is_found_where_it_is_and_as_large(correlation):
    y = signal(1, correlation) + columns_of(1) @ np.array([[9, 0, 2], [0, -7, 1]])
    step = np.array([6.0, -4.0, 3.0])
    y[120:] += step
    found = find_level_change(y, columns_of(1), 10.0, 10)
    assert abs(found.at - 120) <= 1
    assert np.linalg.norm(found.step - step) < 4 * np.sqrt(3) * found.step_sd
    assert found.z > 6
    assert found.spread == pytest.approx(1.0, rel=0.35)


@pytest.mark.parametrize("correlation", [0.0, 0.7, 0.9])
def test_correlated_noise_without_a_step_is_no_step(correlation):
    z = [
        find_level_change(signal(seed, correlation), columns_of(seed), 10.0, 10).z
        for seed in range(60)
    ]
    assert max(z) < 6  # over some 180 places in each of 60 signals


def test_the_statistic_at_one_place_is_that_of_a_normal_vector():
    z = [find_level_change(signal(s, 0.0), columns_of(s), 10.0, 10, at=90).z for s in range(400)]
    assert np.mean(np.array(z) ** 2) == pytest.approx(3.0, rel=0.15)


def test_what_the_columns_can_explain_is_no_step():
    columns = np.concatenate([columns_of(3), np.tanh(np.arange(N) - 100.0)[:, None]], axis=1)
    y = signal(3, 0.5) + columns @ np.array([[0, 0, 0], [3, 1, 0], [5, 0, 2]])
    assert find_level_change(y, columns, 10.0, 10).z < 6
    assert find_level_change(y, columns[:, :2], 10.0, 10).z > 10


def test_a_small_step_of_a_column_explains_no_large_one_beyond_the_prior():
    columns = 0.05 * (np.arange(N) >= 100)[:, None] + 1e-4 * columns_of(4)[:, :1]
    y = signal(4, 0.3)
    y[100:] += [8.0, 0.0, 0.0]
    assert find_level_change(y, columns, 1e4, 10).z < 6
    assert find_level_change(y, columns, 20.0, 10).z > 7


def test_too_few_samples():
    assert find_level_change(signal(5, 0.0)[:9], columns_of(5)[:9], 10.0, 3) is None
