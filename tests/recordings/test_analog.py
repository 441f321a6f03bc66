"""Samples at a limit, lost ones, spikes and copies, beside courses that are only calm."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.signal import butter, filtfilt

from bsip_cli.recordings import plate_reading as copies
from bsip_cli.recordings.analog import SampleCheck, check_samples, sample_findings, spike_samples
from bsip_cli.recordings.body_motion import SMOOTH_S
from tests.circumstances.sound import sound_session

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


def repeated(seen=slice(None), **forces):
    """Names of repeats; a force (n,), or that and its place (n,) along X; by some samples."""
    usable, trial, smooth = np.ones(len(TIME_S), bool)[seen], {}, {}
    for name, force in forces.items():
        load, place_m = force if isinstance(force, tuple) else (force, 0.0)
        wrench = np.zeros((len(TIME_S), 6))
        wrench[:, 2], wrench[:, 4] = load, -load * place_m
        averaged = gaussian_filter1d(wrench, SMOOTH_S * RATE_HZ, axis=0)
        trial[name], smooth[name] = (
            SimpleNamespace(
                usable=usable,
                parts=lambda values=values: values,
                matrix=lambda _: np.eye(6),
                floor_m=lambda: 0.0,
            )
            for values in (wrench[seen], averaged[seen])
        )
    return copies.repeated_plates([trial], [smooth])


def test_a_sum_is_known_by_most_samples_and_two_feet_are_no_copy():
    one, other = step(), quiet_then_moving()
    total = one + other
    damaged = one.copy()
    damaged[1200:1230] = 0.0  # lost on the plate, not on the virtual one
    assert repeated(a=damaged, b=other, c=total) == {"c": ("a", "b")}
    little = 0.01 * other  # a plate that bears hardly anything belongs to the sum all the same
    assert repeated(a=one, b=little, c=one + little) == {"c": ("a", "b")}
    assert repeated(a=one, b=damaged) == {"b": ("a",)}
    assert repeated(a=one, b=np.roll(one, 700)) == {}
    assert repeated(a=other, b=1.03 * other) == {}


def test_what_bears_load_at_the_same_place_is_one_plate():
    total = quiet_then_moving()
    one = total * (0.5 + 0.3 * np.sin(3 * TIME_S))
    other = total - one
    sway_m = 0.02 * np.sin(TIME_S)
    left, right = (one, 0.2 + sway_m), (other, -0.2 + sway_m)
    middle_m = (one * left[1] + other * right[1]) / total
    assert repeated(a=left, b=right) == {}
    assert repeated(a=left, b=(1.03 * one, 0.21 + sway_m)) == {"b": ("a",)}
    assert repeated(a=left, b=right, c=(1.03 * total, middle_m)) == {"c": ("a", "b")}
    assert repeated(a=left, b=right, c=(0.3 * total, middle_m)) == {}  # a foot between two others
    late = np.where(np.arange(len(other)) > len(other) // 2, other, 0.0)
    assert repeated(a=(other - late, sway_m), b=(late, sway_m)) == {}  # never loaded at once


@pytest.mark.parametrize("order", [2, 4])
def test_a_sum_in_running_is_known_though_its_columns_are_low_passed(order):
    """Forces and places, which are zero in flight, by 6 Hz each; feet come down 0.37 s apart."""
    phase = np.array([TIME_S / 0.74, TIME_S / 0.74 + 0.5]) % 1.0 / 0.35  # 0.26 s on the ground
    loads = 1700.0 * np.where(phase < 1.0, np.sin(np.pi * phase), 0.0)
    places_m = np.where(phase < 1.0, 0.15 - 0.3 * phase, 0.0)
    total, place_m = filtfilt(*butter(order, 6.0, fs=RATE_HZ), [loads.sum(0), places_m.sum(0)])
    feet = {name: (loads[k], places_m[k]) for k, name in enumerate("ab")}
    loaded = np.flatnonzero(loads.max(axis=0) > 850.0)
    assert repeated(loaded, **feet, c=(total, place_m)) == {"c": ("a", "b")}
    assert repeated(loaded, **feet) == {}


def touching_down(rate_hz: float = 1000.0) -> np.ndarray:
    """(n,) load of steps of a second, each after a second in the air; the plate's noise on it."""
    t = np.arange(round(6 * rate_hz)) / rate_hz
    stance = np.clip(np.sin(2 * np.pi * (t - 0.5) / 2.0), 0.0, None) ** 0.5
    return 800.0 * stance + np.random.default_rng(4).normal(0.0, 0.8, len(t))


def lost_of(load: np.ndarray, rate_hz: float = 1000.0) -> np.ndarray:
    channels = np.column_stack([0.1 * load, 0.05 * load, load])
    return check_samples(channels, channels, load, rate_hz).lost


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


VARIATIONS = [  # rate [Hz], channels, the converter's step [N] (0: none), length of the fault [s]
    (1000.0, 6, 0.0, 0.1),
    (2000.0, 6, 0.5, 0.2),
    (600.0, 8, 0.3, 0.31),
    (240.0, 8, 0.0, 0.5),
]


def walking(rate_hz: float, k: int, step: float, noise: float = 1.0, seed: int = 3) -> np.ndarray:
    """(n, k) channels under steps of a second, a third of it in the air; the load is borne by
    the last, or by the last four of eight as Kistler has it."""
    t = np.arange(round(6 * rate_hz)) / rate_hz
    phase = np.clip((t % 1.0) / 0.7, 0.0, 1.0)
    load = 1100.0 * np.sin(np.pi * phase) * (1.0 - 0.35 * np.sin(np.pi * phase) ** 4)
    share = np.full(k, 0.1)
    share[-upright(k) :] = 1.0 / upright(k)
    sway = 0.05 * np.sin(2.0 * t[:, None] + np.arange(k)) * (np.arange(k) < k - upright(k))
    channels = load[:, None] * (share + sway)
    channels += np.random.default_rng(seed).normal(0.0, noise, channels.shape)
    return step * np.round(channels / step) if step else channels


def upright(k: int) -> int:
    return 4 if k == 8 else 1


def checked(channels: np.ndarray, rate_hz: float) -> SampleCheck:
    load = channels[:, -upright(channels.shape[1]) :].sum(axis=1)
    return check_samples(channels, channels, load, rate_hz)


def set_to_zero(channels: np.ndarray) -> np.ndarray:
    load = channels[:, -upright(channels.shape[1]) :].sum(axis=1)
    return np.where(np.abs(load)[:, None] < 25.0, 0.0, channels)


FAULTS = {
    "all zero": lambda x, a, b: x[a:b] * 0.0,
    "all held": lambda x, a, b: np.tile(x[a], (b - a, 1)),
    "one held": lambda x, a, b: np.column_stack([np.full(b - a, x[a, 0]), x[a:b, 1:]]),
    "vertical zero": lambda x, a, b: np.column_stack([x[a:b, :-1], np.zeros(b - a)]),
    "vertical elsewhere": lambda x, a, b: np.column_stack(
        [x[a:b, :-1], np.full(b - a, x[a - 40, -1])]
    ),
    "written twice": lambda x, a, b: x[2 * a - b : a],
}


@pytest.mark.parametrize("rate_hz,k,step,length_s", VARIATIONS)
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("zeroed", [False, True])
def test_a_connector_lost_for_tenths_of_a_second(fault, zeroed, rate_hz, k, step, length_s):
    """In stance, or from there into the air; what is sound stays."""
    sound = walking(rate_hz, k, step)
    sound = set_to_zero(sound) if zeroed else sound
    assert checked(sound, rate_hz).usable().all()
    for start_s in (2.12, 3.35):
        a = round(start_s * rate_hz)
        b = a + round(length_s * rate_hz)
        damaged = sound.copy()
        damaged[a:b] = FAULTS[fault](sound, a, b)
        faulty = ~checked(damaged, rate_hz).usable()
        changed = a + np.flatnonzero((damaged[a:b] != sound[a:b]).any(axis=1))
        assert faulty[changed].mean() > 0.98
        air = (damaged == 0).all(axis=1)  # a zero in the air is as good as one that is lost
        assert not faulty[~air][np.flatnonzero(~air) < a - 4].any()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "noise,step",
    [(1.0, 0.0), (1.0, 0.5), (0.3, 1.0), (0.3, 3.0), (0.05, 1.0), (0.0, 1.0), (0.0, 0.0)],
)
@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 1000.0, 2000.0])
def test_sound_plates_repeat_no_value_too_often(rate_hz, noise, step, seed):
    """Fine, coarse and without noise; as they are, set to zero in the air, or smoothed."""
    channels = walking(rate_hz, 8 if seed % 2 else 6, step, noise, seed)
    smooth = uniform_filter1d(channels, max(3, round(0.02 * rate_hz)), axis=0)
    for course in (channels, set_to_zero(channels), set_to_zero(smooth)):
        assert checked(course, rate_hz).usable().all()


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.2, 1.0])
def test_a_pause_between_movements_is_not_stuck(noise):
    """A coarse converter in stance before and after squats, and a simulation that rests."""
    channels = np.zeros((len(TIME_S), 6))
    channels[:, 2] = quiet_then_moving() - NOISE[:, 2]
    channels[:, 4] = 20.0 * np.sin(2 * np.pi * 0.4 * np.clip(TIME_S, 1.0, None))
    for step in (0.0, 2.0) if noise == 0 else (2.0,):
        course = channels + noise * NOISE
        course = step * np.round(course / step) if step else course
        assert check_samples(course, course, course[:, 2], RATE_HZ).usable().all()


def test_what_is_lost_is_said_with_channel_and_time():
    channels = walking(1000.0, 6, 0.0)
    channels[2200:2350, 5] = 0.0
    channels[4100:4300, 1] = channels[4100, 1]
    found = sample_findings("2", checked(channels, 1000.0), 1000.0)
    (one,) = [f for f in found if f.check == "analog_stuck"]
    assert one.subject == "2"
    assert "channel 2 4.100 to 4.300 s; channel 6 2.200 to 2.350 s" in one.found


@pytest.mark.parametrize(("level", "said"), [(312.5, "stuck"), (0.0, "silent")])
def test_a_vertical_force_of_one_value_while_the_others_work(level, said):
    rng = np.random.default_rng(4)
    channels = rng.normal(0.0, 1.0, (2000, 6))
    channels[:, 3] += 40.0 * np.sin(np.arange(2000) / 150.0)
    channels[:, 2] = level
    found = check_samples(channels, channels / 0.01, channels[:, 2], 1000.0)
    assert found.silent_channels == ((2,) if said == "silent" else ())
    assert found.stuck[:, 2].all() == (said == "stuck") and not found.stuck[:, [0, 1, 3, 4]].any()


def test_a_calm_load_and_a_calm_plate_are_no_dead_channel():
    smooth = np.zeros((2000, 6))
    smooth[:, 2], smooth[:, 3] = 600.0, 40.0 * np.sin(np.arange(2000) / 150.0)
    unloaded = np.random.default_rng(5).integers(-1, 2, (2000, 6)).astype(float)
    unloaded[:, 2] = 3.0
    for channels in (smooth, unloaded):
        found = check_samples(channels, channels / 0.01, channels[:, 2], 1000.0)
        assert not found.stuck[:, 2].any() and found.silent_channels == ()


@pytest.mark.parametrize("per_frame", [1, 4, 10])
@pytest.mark.parametrize("weights", [0.1, 0.5])
def test_a_spike_of_one_sample_is_found_in_any_movement(per_frame, weights):
    rng = np.random.default_rng(7)
    found = []
    for laboratory in ("walkway", "side-by-side"):
        session = sound_session(laboratory, 0)
        for trial in session.trials:
            force = trial.sampled(100.0, per_frame).force_N[:, 0]
            force = force + rng.normal(0.0, 0.5, force.shape)
            for _ in range(5):
                k, channel = rng.integers(3, len(force) - 3), rng.integers(3)
                hit = force.copy()
                hit[k, channel] += weights * 9.81 * session.mass_kg * rng.choice([-1, 1])
                found.append(np.flatnonzero(spike_samples(hit, hit[:, 2])).tolist() == [k])
    # At the markers' rate a step may look like one.
    assert np.mean(found) >= (0.75 if per_frame == 1 else 0.95)


def test_a_foot_that_touches_down_is_no_spike():
    """300 Hz; as a plate of a public recording has it, an impact of one sample's length."""
    load = np.zeros(300)
    load[100:] = 600.0 + 50.0 * np.sin(np.arange(200) / 10.0)
    impact = np.zeros(300)
    impact[99:106] = [7.7, 35.8, 12.0, -8.2, -25.1, -30.0, -15.0]
    assert not spike_samples(np.column_stack([impact, load]), load).any()


def test_flight_on_a_plate_set_to_zero_is_not_lost():
    """Down in 50 ms and up in 10."""
    load = np.interp(np.arange(3000), [950, 1000, 2000, 2010], [700.0, 0.0, 0.0, 700.0])
    channels = np.column_stack([0 * load, 0 * load, load])
    assert not check_samples(channels, channels, load, RATE_HZ).lost.any()
    assert not spike_samples(channels, load).any()
