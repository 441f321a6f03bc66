"""Samples at an amplifier's limit, lost ones and copies, beside courses that are only calm."""

from types import SimpleNamespace

import numpy as np
import pytest

from bsip_cli.recordings import plate_source as copies
from bsip_cli.recordings.analog import check_samples, lost_samples

RATE_HZ = 1000.0
TIME_S = np.arange(4000) / RATE_HZ
NOISE = np.random.default_rng(812).normal(0.0, 1.0, (len(TIME_S), 6))


def quiet_then_moving():
    """Vertical force [N]: two seconds of stance, then squats."""
    moving = np.where(TIME_S > 2.0, np.sin(2 * np.pi * 0.7 * (TIME_S - 2.0)), 0.0)
    return 700.0 + 250.0 * moving + NOISE[:, 2]


def step():
    """Loaded for 0.6 s, with two peaks; else zeroed."""
    phase = (TIME_S - 1.0) / 0.6
    loaded = (phase > 0) & (phase < 1)
    course = 900.0 * np.sin(np.pi * phase) * (1.0 - 0.35 * np.sin(np.pi * phase) ** 4)
    return np.where(loaded, course + NOISE[:, 2], 0.0)


def clipped(vertical, calibration=None):
    """What is found where the channels are calibrated by a matrix, or as they are."""
    raw = NOISE.copy()
    raw[:, 2] = vertical
    channels = raw if calibration is None else raw @ calibration.T
    return check_samples(channels, raw, channels[:, 2], RATE_HZ).clipped


@pytest.mark.parametrize("course", [quiet_then_moving, step])
@pytest.mark.parametrize("share", [0.7, 0.85, 0.95])
def test_a_limit_is_seen_beside_stance_and_beside_an_unloaded_plate(course, share):
    vertical = course()
    limit = share * vertical.max()
    cut = clipped(np.minimum(vertical, limit))
    above = vertical > limit
    assert cut[above].mean() > 0.8  # but for single samples of noise at its border
    assert not cut[vertical < limit].any()


def test_a_limit_is_seen_through_a_calibration_matrix():
    mixed = np.eye(6) + 0.01 * np.arange(36).reshape(6, 6) / 36
    assert clipped(np.minimum(step(), 500.0), mixed).sum() > 100


@pytest.mark.parametrize(
    "calm",
    [
        quiet_then_moving(),
        step(),
        700.0 + 200.0 * np.sin(2 * np.pi * 0.5 * TIME_S),  # no noise: flat at its peaks
        np.round(700.0 + 200.0 * np.sin(2 * np.pi * 0.5 * TIME_S), 1),
        2.0 * np.round((700.0 + 0.2 * NOISE[:, 2]) / 2.0),  # a coarse converter, quiet stance
        np.where(TIME_S > 2.0, 700.0 + NOISE[:, 2], 0.0),
    ],
)
def test_what_is_only_calm_is_not_clipped(calm):
    assert not clipped(calm).any()


def repeated(monkeypatch, **forces):
    monkeypatch.setattr(copies, "lift_N", lambda source: source.force)
    usable = np.ones(len(TIME_S), bool)
    trial = {n: SimpleNamespace(force=f, usable=usable) for n, f in forces.items()}
    return copies.repeated_plates([trial])


def test_a_sum_is_known_by_most_samples_and_two_feet_are_no_copy(monkeypatch):
    one, other = step(), quiet_then_moving()
    total = one + other
    damaged = one.copy()
    damaged[1200:1230] = 0.0  # lost on the plate, not on the virtual one
    assert repeated(monkeypatch, a=damaged, b=other, c=total) == {"c": ("a", "b")}
    little = 0.01 * other  # a plate that bears hardly anything belongs to the sum all the same
    assert repeated(monkeypatch, a=one, b=little, c=one + little) == {"c": ("a", "b")}
    assert repeated(monkeypatch, a=one, b=damaged) == {"b": ("a",)}
    assert repeated(monkeypatch, a=one, b=np.roll(one, 700)) == {}
    assert repeated(monkeypatch, a=other, b=1.03 * other) == {}


def touching_down(rate_hz: float = 1000.0) -> np.ndarray:
    """(n,) load of steps of a second, each after a second in the air; the plate's noise on it."""
    t = np.arange(round(6 * rate_hz)) / rate_hz
    stance = np.clip(np.sin(2 * np.pi * (t - 0.5) / 2.0), 0.0, None) ** 0.5
    return 800.0 * stance + np.random.default_rng(4).normal(0.0, 0.8, len(t))


def lost_of(load: np.ndarray, rate_hz: float = 1000.0) -> np.ndarray:
    channels = np.column_stack([0.1 * load, 0.05 * load, load])
    return lost_samples(channels, load, rate_hz)


@pytest.mark.parametrize("first", [470, 1470])  # over a touch-down, over a lift-off
def test_lost_samples_over_a_touch_down(first):
    load = touching_down()
    damaged = load.copy()
    damaged[first : first + 60] = 0.0
    found = lost_of(damaged)
    assert found[first : first + 60].all() and found.sum() <= 62
    assert not lost_of(load).any()


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
def test_hops_whose_small_forces_are_set_to_zero_are_not_lost(rate_hz):
    """In the air for 80 ms, and down again to twice the weight in 8 ms."""
    t = np.arange(round(3 * rate_hz)) / rate_hz
    t = (t + 0.2) % 0.4
    load = np.interp(
        t, [0.0, 0.08, 0.088, 0.12, 0.25, 0.399], [0.0, 0.0, 1600.0, 1100.0, 1900.0, 0.0]
    )
    load += np.random.default_rng(4).normal(0.0, 1.0, len(t))
    load[load < 25.0] = 0.0
    assert not lost_of(load, rate_hz).any()
