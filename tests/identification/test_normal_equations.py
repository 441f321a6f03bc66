import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.dynamics.ground_wrench import wrench_regressor
from bsip_cli.dynamics.lowpass import lowpass_operator
from bsip_cli.identification.problem import Recording, accumulate, residual_series
from tests.identification.synthetic_identification import RATE_HZ, motion, recording, world

CUTOFF_HZ = 8.0
REFERENCE = np.array([0.2, -0.1, 0.0])
STRIDE = int(RATE_HZ / (2.5 * CUTOFF_HZ))


def moved(wrench):
    out = wrench.copy()
    out[:, 3:] -= np.cross(REFERENCE, wrench[:, :3])
    return out


def dense(one):
    """Filtered rows (n, 6, 150) and wrench (n, 6), all at once."""
    operator, _ = lowpass_operator(one.use, RATE_HZ, CUTOFF_HZ, STRIDE)
    model = world().model
    Y = wrench_regressor(model, one.q, one.v, one.a, REFERENCE)
    rows = (operator @ Y.reshape(len(Y), -1)).reshape(-1, 6, 150)
    return rows, operator @ moved(np.where(one.use[:, None], one.wrench, 0.0))


@pytest.fixture(scope="module")
def recordings():
    """Two trials with gaps; the second longer than a block; garbage in the unused frames."""
    rng = np.random.default_rng(1)
    trials = []
    for duration, seed in ((4.0, 2), (14.0, 3)):
        one = recording(duration, seed)
        use = one.use.copy()
        for start in rng.integers(0, len(use), 4):
            use[start : start + 37] = False
        noisy = one.wrench + rng.normal(0, 5, one.wrench.shape)
        trials.append(replace(one, wrench=np.where(use[:, None], noisy, 1e6), use=use))
    return trials


def assert_same(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_blocks_sum_to_the_dense_equations(recordings):
    found = accumulate(world().model, recordings, CUTOFF_HZ, REFERENCE)
    parts = [dense(one) for one in recordings]
    rows = np.concatenate([part[0] for part in parts])
    measured = np.concatenate([part[1] for part in parts])
    assert found.samples == len(rows) > 200  # more than one block
    for c in range(6):
        assert_same(found.information[c], rows[:, c].T @ rows[:, c])
        assert_same(found.right[c], rows[:, c].T @ measured[:, c])
    np.testing.assert_allclose(found.squares, (measured**2).sum(axis=0), rtol=1e-12)
    used = sum(one.use.sum() for one in recordings)
    assert found.duration_s == pytest.approx(used / RATE_HZ)


def test_weights_per_component(recordings):
    equations = accumulate(world().model, recordings[:1], CUTOFF_HZ, REFERENCE)
    rows, measured = dense(recordings[0])
    weights = np.array([1.0, 0.5, 0.25, 2.0, 3.0, 0.0])
    information, right = equations.weighted(weights)
    weighted = (rows * np.sqrt(weights)[:, None]).reshape(-1, 150)
    assert_same(information, weighted.T @ weighted)
    assert_same(right, weighted.T @ (measured * np.sqrt(weights)).ravel())


def test_weights_per_frame(recordings):
    """A frame's weight multiplies its share of every sum."""

    def weights_at(level):
        return np.outer(1 / level, np.arange(1.0, 7.0))

    one = replace(recordings[0], noise_level=np.linspace(1.0, 4.0, len(recordings[0].use)))
    rows, measured = dense(one)
    frames = lowpass_operator(one.use, RATE_HZ, CUTOFF_HZ, STRIDE)[1]
    weights = weights_at(one.noise_level[frames])
    found = accumulate(world().model, [one], CUTOFF_HZ, REFERENCE, weights_at)
    for c in range(6):
        assert_same(found.information[c], rows[:, c].T @ (weights[:, c, None] * rows[:, c]))
    np.testing.assert_allclose(found.squares, (weights * measured**2).sum(axis=0), rtol=1e-12)


def test_residuals_from_the_sums_and_from_the_series_agree(recordings):
    equations = accumulate(world().model, recordings, CUTOFF_HZ, REFERENCE)
    phi = world().prior.phi
    series = residual_series(world().model, recordings, CUTOFF_HZ, REFERENCE, phi)
    residuals = [residual for residual, _ in series]
    assert [len(one) for one in residuals] == [len(dense(one)[0]) for one in recordings]
    rows, measured = dense(recordings[0])
    np.testing.assert_allclose(residuals[0], measured - rows @ phi, atol=1e-8)
    rms = np.sqrt((np.concatenate(residuals) ** 2).mean(axis=0))
    np.testing.assert_allclose(equations.residual_rms(phi), rms, rtol=1e-6)


def test_a_trial_without_a_usable_frame_adds_nothing(recordings):
    unused = replace(recordings[0], use=np.zeros(len(recordings[0].use), dtype=bool))
    with_it = accumulate(world().model, [unused, recordings[0]], CUTOFF_HZ, REFERENCE)
    alone = accumulate(world().model, recordings[:1], CUTOFF_HZ, REFERENCE)
    np.testing.assert_array_equal(with_it.information, alone.information)
    assert with_it.samples == alone.samples
    phi = world().phi_true
    assert residual_series(world().model, [unused], CUTOFF_HZ, REFERENCE, phi) == []


def test_memory_does_not_grow_with_the_trial():
    """Both trials fill two blocks (200 outputs, 10 s each); one has four times the frames."""
    q, v, a = motion(14.0, 3)
    peaks = []
    for times in (2, 8):
        frames = len(q) * times
        one = Recording(
            *(np.tile(x, (times, 1)) for x in (q, v, a)),
            np.zeros((frames, 6)),
            np.ones(frames, dtype=bool),
            RATE_HZ,
            np.ones(frames),
        )
        tracemalloc.start()
        accumulate(world().model, [one], CUTOFF_HZ, REFERENCE)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]
    assert peaks[1] < 60e6
