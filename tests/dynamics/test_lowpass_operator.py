import numpy as np
import pytest

from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to, valid_intervals


def holed(count, seed):
    rng = np.random.default_rng(seed)
    valid = np.ones(count, dtype=bool)
    for start in rng.integers(0, count, 6):
        valid[start : start + rng.integers(1, 30)] = False
    return valid


@pytest.mark.parametrize(
    ("valid", "spans"),
    [
        ([0, 1, 1, 0, 1], [(1, 3), (4, 5)]),
        ([1, 1, 0, 1], [(0, 2), (3, 4)]),
        ([1, 1], [(0, 2)]),
        ([0] * 5, []),
        ([], []),
    ],
)
def test_runs_of_true(valid, spans):
    assert valid_intervals(np.array(valid)) == spans


def test_nothing_valid_has_no_output():
    operator, frames = lowpass_operator(np.zeros(50, dtype=bool), 100.0, 8.0, 3)
    assert operator.shape == (0, 50)
    assert len(frames) == 0


@pytest.mark.parametrize("stride", [1, 4, 7])
def test_rows_sum_to_one(stride):
    operator, frames = lowpass_operator(holed(500, 1), 100.0, 8.0, stride)
    np.testing.assert_allclose(operator.sum(axis=1), 1.0, rtol=1e-13)
    assert operator.shape == (len(frames), 500)
    assert np.all(np.diff(frames) > 0)


@pytest.mark.parametrize("stride", [1, 5])
def test_never_crosses_a_gap(stride):
    valid = holed(500, 2)
    operator, frames = lowpass_operator(valid, 100.0, 3.0, stride)
    spans = valid_intervals(valid)
    assert valid[frames].all()
    for row, frame in zip(operator.toarray(), frames, strict=True):
        start, stop = next(s for s in spans if s[0] <= frame < s[1])
        touched = np.flatnonzero(row)
        assert touched.min() >= start
        assert touched.max() < stop
        assert row[frame] == row.max()


def test_what_stands_in_the_gaps_does_not_matter():
    valid = holed(300, 3)
    signal = np.random.default_rng(4).normal(size=300)
    operator, _ = lowpass_operator(valid, 100.0, 6.0)
    wild = np.where(valid, signal, 1e9)
    np.testing.assert_array_equal(operator @ wild, operator @ signal)


def test_every_interval_has_an_output():
    valid = np.array([1, 0, 1, 1, 0, 0, 1, 1, 1, 1, 1, 1, 1], dtype=bool)
    _, frames = lowpass_operator(valid, 100.0, 5.0, stride=5)
    assert [sum(a <= f < b for f in frames) for a, b in valid_intervals(valid)] == [1, 1, 1]


@pytest.mark.parametrize(("rate_hz", "cutoff_hz"), [(100.0, 8.0), (250.0, 10.0), (100.0, 3.0)])
def test_half_of_the_power_is_left_at_the_cutoff(rate_hz, cutoff_hz):
    times = np.arange(2000) / rate_hz
    operator, _ = lowpass_operator(np.ones(2000, dtype=bool), rate_hz, cutoff_hz)
    middle = slice(500, 1500)

    def power(frequency_hz):
        tone = np.exp(2j * np.pi * frequency_hz * times)
        return np.mean(np.abs(operator @ tone)[middle] ** 2)

    assert power(cutoff_hz) == pytest.approx(0.5, abs=0.002)
    assert power(0.1 * cutoff_hz) > 0.99
    assert power(3 * cutoff_hz) < 0.005


def test_no_phase_and_no_bend_of_a_line():
    times = np.arange(600) / 100.0
    operator, frames = lowpass_operator(np.ones(600, dtype=bool), 100.0, 6.0)
    inner = slice(50, 550)
    np.testing.assert_allclose((operator @ times)[inner], times[frames][inner], atol=1e-12)


def test_decimation_keeps_every_nth_row_of_the_full_operator():
    valid = np.ones(300, dtype=bool)
    valid[120:140] = False
    full, _ = lowpass_operator(valid, 100.0, 8.0)
    some, frames = lowpass_operator(valid, 100.0, 8.0, stride=5)
    rows = np.flatnonzero(valid)
    at = np.searchsorted(rows, frames)
    np.testing.assert_allclose(some.toarray(), full.toarray()[at], atol=1e-15)
    assert some.shape[0] == 24 + 32
    assert set(np.diff(frames[frames < 120])) == {5}


@pytest.mark.parametrize("seconds", [2, 5, 8, 14, 60])
@pytest.mark.parametrize(("rate_hz", "stride"), [(30, 1), (50, 1), (100, 2), (120, 2), (250, 5)])
def test_the_rounding_of_times_decides_no_stride(rate_hz, stride, seconds):
    times = np.arange(seconds * rate_hz) / rate_hz
    assert stride_to(1.0 / float(np.median(np.diff(times))), 50.0) == stride
