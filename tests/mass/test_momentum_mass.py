"""One stretch's mass: standing, bouncing, sitting, leaning, and what is not seen."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.measured_mass import measured_mass
from bsip_cli.recordings.momentum_mass import Interval, intervals_of, segment_motion
from tests.mass.body import RATE_HZ, markers, rise, told

MOST_PERCENT = 10.0


def mass_of(*trials: tuple[Interval, ...], **more):
    return measured_mass(
        {f"trial-{k}": each for k, each in enumerate(trials)}, MOST_PERCENT, **more
    )


@pytest.mark.parametrize("size_m", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("seconds", [0.7, 1.3, 7.0])
def test_standing_and_bouncing_tell_the_mass(size_m, seconds):
    found = mass_of(told(62.0, seconds, size_m))
    assert found.mass_kg == pytest.approx(62.0, rel=0.01)
    assert abs(found.mass_kg - 62.0) < 0.01 * found.half_width_percent * 62.0


@pytest.mark.parametrize("start", [100, 115, 130])
def test_the_mean_force_of_a_part_of_a_stride_is_not_taken_for_the_weight(start):
    path, acceleration = rise(3.0, 0.05)
    force = 62.0 * (GRAVITY_M_S2 + acceleration)
    measured = np.zeros(300, bool)
    measured[start : start + 40] = True
    (one,) = intervals_of(markers(path), force, measured, RATE_HZ)
    assert abs(force[measured].mean() / GRAVITY_M_S2 / 62.0 - 1) > 0.02
    assert one.mass_kg == pytest.approx(62.0, rel=0.01)


@pytest.mark.parametrize("segment", ["thigh_l", "upper_torso", "head"])
def test_a_moving_segment_widens_unless_it_moves_alike_at_both_ends(segment):
    """Over a whole period its error cancels, over half of it it does not."""
    t = np.arange(400) / RATE_HZ
    body = markers(np.zeros(400))
    body[segment][..., 2] += (0.1 * np.sin(2 * np.pi * t))[:, None]
    common = segment_motion(body, RATE_HZ).common
    whole, half = common[200] - common[100], common[150] - common[100]
    assert np.linalg.norm(half) > 20 * np.linalg.norm(whole) and np.linalg.norm(half) > 0.005


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_a_seat_tells_nothing(share):
    """The thighs lie; the seat bears part of the weight, steadily."""
    found = mass_of(told(62.0, 5.0, 0.0, share * 62.0 * GRAVITY_M_S2, ahead_m=0.8))
    assert not found.is_known and "upright" in found.reason


@pytest.mark.parametrize("pace_hz", [0.4, 0.8, 1.5])
def test_a_hand_on_a_rail_wanders_and_tells_nothing(pace_hz):
    t = np.arange(500) / RATE_HZ
    found = mass_of(told(62.0, 5.0, 0.0, 80.0 + 12.0 * np.sin(2 * np.pi * pace_hz * t)))
    assert not found.is_known and "something else bears" in found.reason


@pytest.mark.parametrize("start", [0, 150, 300])
def test_support_for_a_part_of_the_trial_goes_and_the_rest_tells(start):
    borne = np.zeros(1000)
    borne[start : start + 200] = 150.0
    found = mass_of(told(62.0, 10.0, 0.0, borne))
    assert found.mass_kg == pytest.approx(62.0, rel=0.01)


def test_nothing_on_the_plates_and_no_trunk_tell_nothing():
    assert told(0.0) == ()
    everywhere = np.ones(300, bool)
    force = np.full(300, 600.0)
    assert intervals_of({"foot_l": np.zeros((300, 2, 3))}, force, everywhere, RATE_HZ) == ()
    assert intervals_of(markers(np.zeros(300)), force, ~everywhere, RATE_HZ) == ()


def test_a_stretch_comes_back_from_a_file_and_without_a_load():
    (one, *_) = told(62.0)
    assert Interval.of(json.loads(json.dumps(one.record()))) == one
    assert one.without(10.0).mass_kg == pytest.approx(one.mass_kg - 10.0)
    assert one.without(10.0).own_sd == pytest.approx(one.own_sd * one.mass_kg / (one.mass_kg - 10))
