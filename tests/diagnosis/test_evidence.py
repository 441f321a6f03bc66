"""In the evidence's coordinates a null is white noise of variance 1, and an effect is not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.diagnosis.evidence import evidence_of, filter_of

RATE_HZ, SECONDS = 100.0, 60


def drawn(seed):
    """Residual (N, 6) of autocorrelated noise that is twice as large in fast frames, and of
    nuisances (N, 6, m); the frames' noise level (N,)."""
    rng = np.random.default_rng(seed)
    count = int(RATE_HZ * SECONDS)
    level = 1.0 + (np.sin(np.arange(count) / 400) > 0)
    noise = lfilter([1.0], [1.0, -0.97], rng.normal(size=(count, 6)), axis=0)
    slow = lfilter([1.0], [1.0, -0.99], rng.normal(size=(count, 6, 5)), axis=0)
    return noise * level[:, None] + slow @ rng.normal(size=5), slow, level


def evidence(seed, residual=0.0):
    null, nuisances, level = drawn(seed)
    valid = np.ones(len(level), dtype=bool)
    valid[2000:2300] = False
    filter_ = filter_of(valid, RATE_HZ, 8.0, np.zeros(3))
    return evidence_of(null + residual, nuisances, level, filter_)


@pytest.mark.parametrize("seed", range(4))
def test_a_null_is_white(seed):
    found = evidence(seed)
    series = found.residual.reshape(-1, 6)
    assert np.std(series) == pytest.approx(1.0, abs=0.1)
    for component in series.T:
        neighbours = np.corrcoef(component[1:], component[:-1])[0, 1]
        assert abs(neighbours) < 4 / np.sqrt(len(component))
    assert np.abs(np.corrcoef(series.T) - np.eye(6)).max() < 0.15


def test_signatures_of_nothing_score_as_chance_has_it():
    """The score of a random signature is a standard normal."""
    rng = np.random.default_rng(8)
    signatures = lfilter([1.0], [1.0, -0.98], rng.normal(size=(6000, 6, 200)), axis=0)
    scores = []
    for seed in range(3):
        found = evidence(seed)
        white = found.white(signatures)
        scores.append(white.T @ found.residual / np.linalg.norm(white, axis=0))
    assert np.std(scores) == pytest.approx(1.0, abs=0.12)


def test_an_effect_stands_out_and_a_nuisance_does_not():
    t = np.arange(6000) / RATE_HZ
    effect = np.sin(2 * np.pi * 1.3 * t)[:, None] * np.array([0, 0, 1.0, 0, 0, 0]) * 4.0
    found = evidence(1, effect)
    white = found.white(effect[..., None])[:, 0]
    assert white @ found.residual / np.linalg.norm(white) > 6
    assert white @ found.residual / (white @ white) == pytest.approx(1.0, abs=0.4)
    nuisance = drawn(1)[1][..., :1]
    white = found.white(nuisance)[:, 0]
    assert abs(white @ found.residual / np.linalg.norm(white)) < 4


def test_outside_the_valid_frames_nothing_counts():
    null, nuisances, level = drawn(2)
    spoilt = null.copy()
    spoilt[2000:2300] = 1e6
    valid = np.ones(len(level), dtype=bool)
    valid[2000:2300] = False
    filter_ = filter_of(valid, RATE_HZ, 8.0, np.zeros(3))
    first, second = (evidence_of(x, nuisances, level, filter_) for x in (null, spoilt))
    np.testing.assert_array_equal(first.residual, second.residual)
