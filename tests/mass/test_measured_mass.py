"""Mass from the plates of a body that moves up and down, and a stated mass that is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.measured_mass import (
    Comparison,
    MeasuredMass,
    differing_plates,
    differing_trials,
    least_mass,
    mass_finding,
    measured_mass,
    plate_gains,
    unknown,
)
from bsip_cli.recordings.momentum_mass import Interval, intervals_of, segment_motion

RATE_HZ = 100.0
HEIGHTS_M = {
    "lower_torso": 1.0,
    "upper_torso": 1.35,
    "head": 1.65,
    "thigh_l": 0.7,
    "thigh_r": 0.7,
    "shank_l": 0.35,
    "shank_r": 0.35,
}


def markers(rise_m: np.ndarray, ahead_of_shanks_m: float = 0.0) -> dict[str, np.ndarray]:
    """Two markers on each segment, all raised alike, (n, 2, 3)."""
    found = {}
    for name, height in HEIGHTS_M.items():
        points = np.zeros((len(rise_m), 2, 3))
        points[..., 0] = 0.0 if name.startswith("shank") else ahead_of_shanks_m
        points[:, 1, 1] = 0.1
        points[..., 2] = height + rise_m[:, None]
        found[name] = points
    return found


def rise(seconds: float, size_m: float, period_s: float = 1.1) -> tuple[np.ndarray, np.ndarray]:
    """A bounce (n,) and its acceleration [m/s2] (n,)."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w = 2 * np.pi / period_s
    return size_m * np.cos(w * t), -size_m * w**2 * np.cos(w * t)


def told(
    mass_kg: float,
    seconds: float = 4.0,
    size_m: float = 0.0,
    borne_N: np.ndarray | float = 0.0,
    ahead_m: float = 0.0,
    late_s: float = 0.0,
) -> tuple[Interval, ...]:
    """Stretches of a trial in which something else bears ``borne_N``, its forces ``late_s``."""
    path, acceleration = rise(seconds, size_m)
    t = np.arange(len(path)) / RATE_HZ
    force = mass_kg * (GRAVITY_M_S2 + np.interp(t - late_s, t, acceleration)) - borne_N
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(force))
    everywhere = np.ones(len(force), bool)
    return intervals_of(markers(path, ahead_m), force + noise, everywhere, RATE_HZ)


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


@pytest.mark.parametrize("late_s", [-0.03, 0.012, 0.025, 0.04])
@pytest.mark.parametrize("seconds", [2.2, 6.5])
def test_late_forces_tell_the_mass_all_the_same(late_s, seconds):
    found = mass_of(told(62.0, seconds, 0.1, late_s=late_s))
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


def test_more_intervals_show_more():
    one, many = (measured_mass({"a": told(62.0, s, 0.08)}, 10.0) for s in (0.8, 12.0))
    assert many.half_width_percent < one.half_width_percent
    assert len(told(62.0, 12.0, 0.08)) == 6 and many.seconds == pytest.approx(11.8, abs=0.1)


def test_trials_that_agree_are_one():
    found = measured_mass({"a": told(62.0), "b": told(62.1), "c": told(61.9, 4.0, 0.1)}, 10.0)
    assert found.mass_kg == pytest.approx(62.0, abs=0.2) and not found.remark


@pytest.mark.parametrize("other_kg", [40.0, 57.0, 70.0])
def test_trials_that_disagree_show_nothing_but_for_a_static_one(other_kg):
    trials = {"static": told(62.0), "walk": told(other_kg)}
    found = measured_mass(trials, 10.0)
    assert not found.is_known and "trials show from" in found.reason
    found = measured_mass(trials, 10.0, static={"static"})
    assert found.mass_kg == pytest.approx(62.0, abs=0.1)
    assert "the static trial counts" in found.words()


@pytest.mark.parametrize(("other_kg", "is_said"), [(62.0, False), (66.0, False), (84.0, True)])
def test_a_trial_with_another_mass_is_named_with_both(other_kg, is_said):
    trials = {"static": told(other_kg), "walk": told(62.0), "squat": told(62.0)}
    said = differing_trials(trials, 15.0)
    assert bool(said) == is_said
    assert not is_said or said.startswith("the plates show 84.0 kg in static, and 62.0 kg in walk")


def test_a_trial_that_shows_nothing_does_not_spoil_the_others():
    found = measured_mass({"sitting": told(62.0, ahead_m=0.8), "standing": told(62.0)}, 10.0)
    assert found.mass_kg == pytest.approx(62.0, abs=0.1)


def test_what_bears_now_and_then_leaves_the_least_mass():
    borne_N = np.where(np.arange(len(rise(8.0, 0.05)[1])) % 90 < 30, 150.0, 0.0)
    intervals = told(100.0, 8.0, 0.05, borne_N)
    assert not measured_mass({"squat": intervals}, 50.0).is_known
    least = least_mass(intervals, 50.0)
    assert 80.0 < least.mass_kg <= min(one.mass_kg for one in intervals)
    assert least.words().endswith(", or more")
    assert not least_mass((), 50.0).is_known


@pytest.mark.parametrize(
    ("mass_kg", "height_m", "known"),
    [(31.0, 1.70, False), (250.0, 1.70, False), (27.0, 1.33, True), (62.0, 1.70, True)],
)
def test_the_body_mass_index_is_a_persons(mass_kg, height_m, known):
    assert measured_mass({"a": told(mass_kg)}, 10.0, height_m).is_known == known


def test_an_interval_that_is_too_wide_is_no_mass():
    found = measured_mass({"a": told(62.0, 0.8, 0.1)}, 0.5)
    assert not found.is_known and "only" in found.reason


def test_no_trial_with_forces_is_said():
    assert "no trial" in measured_mass({}, 10.0).reason


@pytest.mark.parametrize(
    ("mass_kg", "unit"),
    [(70 / 4.44822, "pounds-force"), (70 / 9.80665, "kilogram-force"), (30, "")],
)
def test_a_mass_that_is_nobodys_is_said_with_the_likely_unit(mass_kg, unit):
    finding = mass_finding(measured_mass({"a": told(mass_kg)}, 10.0, 1.70), None, "")
    assert finding.level == "warning" and "a person of 1.70 m has 35 to 173" in finding.found
    assert unit in finding.found and ("likely" in finding.found) == bool(unit)


@pytest.mark.parametrize(
    ("masses_kg", "stated_kg", "gains"),
    [
        ((124.0, 62.0), 62.0, {"1": 2.0}),
        ((62.0, 49.6), 62.5, {"2": 0.8}),
        ((62.0, 31.0, 62.3), None, {"2": 0.5}),
        ((124.0, 62.0), None, {}),  # one against one
        ((124.0,), 62.0, {}),
        ((62.0, 61.0), 136.0, {}),  # pounds are stated
        ((124.0, 62.0), 75.0, {}),  # the two others do not agree
        ((62.0, 66.0), 62.0, {}),  # too little for a wrong gain: a load, a rail
    ],
)
def test_a_gain_is_taken_off_where_two_others_agree(masses_kg, stated_kg, gains):
    plates = {str(k + 1): {"walk": told(kg)} for k, kg in enumerate(masses_kg)}
    found = plate_gains(plates, stated_kg, 10.0, 2.0, 15.0)
    assert found == pytest.approx(gains, rel=0.015)


def test_a_plate_that_shows_different_masses_in_different_trials_has_no_gain():
    plates = {"1": {"walk": told(124.0), "walk2": told(90.0)}, "2": {"walk": told(62.0)}}
    assert plate_gains(plates, 62.0, 10.0, 2.0, 15.0) == {}


@pytest.mark.parametrize(
    ("masses_kg", "stated_kg", "odd"),
    [
        ((62.0, 61.0), None, []),
        ((62.0, 31.0), None, ["1", "2"]),
        ((62.0, 31.0), 61.0, ["2"]),
        ((31.0, 31.0), 62.0, []),  # all alike: that is said of the stated mass
        ((62.0, 74.0, 62.0), 62.0, ["2"]),
    ],
)
def test_a_plate_that_shows_another_mass_than_the_others_is_named(masses_kg, stated_kg, odd):
    plates = {str(k + 1): told(kg) for k, kg in enumerate(masses_kg)}
    findings = differing_plates(plates, stated_kg, 15.0)
    assert [one.subject for one in findings] == odd
    for one in findings:
        mass_kg = masses_kg[int(one.subject) - 1]
        assert one.level == "warning" and f"shows {mass_kg:.1f} kg" in one.found


def compared(stated_kg: float, plates_kg: float, load_kg: float = 0.0, height_m=1.74):
    told = MeasuredMass(plates_kg, 0.006, 3.0)
    return Comparison(stated_kg, load_kg, told, 2.0, 15.0, height_m)


@pytest.mark.parametrize(
    ("stated_kg", "plates_kg", "likely"),
    [
        (110.9, 50.3, "pounds"),
        (165.3, 75.0, "pounds"),
        (11.0, 70.0, "stones"),
        (16.2, 103.0, "stones"),
        (353.0, 36.0, "newton"),
        (300.0, 30.6, "newton"),
        (57.0, 75.0, "75 with two digits exchanged"),
        (91.5, 19.5, "19.5 with two digits exchanged"),
        (68.2, 86.3, "86.2 with two digits exchanged"),
        (174.0, 70.0, "the height in cm"),
        (34.0, 75.0, "2.2046 once too often"),
    ],
)
def test_the_likely_mistake_is_named(stated_kg, plates_kg, likely):
    comparison = compared(stated_kg, plates_kg)
    finding = mass_finding(comparison.measured, comparison, "participants.tsv")
    assert comparison.is_gross and finding.level == "warning"
    assert likely in finding.found
    assert f"{stated_kg:g} kg" in finding.found and f"{plates_kg:.2f} kg" in finding.found


@pytest.mark.parametrize(
    ("stated_kg", "plates_kg", "unit"),
    [
        (60.0, 75.0, ""),
        (90.0, 60.0, ""),
        (70.0, 140.0, ""),
        (50.3, 50.3 / 2.0, ""),
        (50.3, 50.3 / 4.44822, "pounds-force"),
        (50.3, 50.3 / 9.80665, "kilogram-force"),
    ],
)
def test_what_is_no_known_mistake_is_said_without_a_guess(stated_kg, plates_kg, unit):
    """But for the unit of the forces, which alone may be too small."""
    comparison = compared(stated_kg, plates_kg)
    assert comparison.is_gross and comparison.likely() == ""
    sentence = comparison.sentence("participants.tsv")
    assert ("the forces are likely to be in" in sentence) == bool(unit) and unit in sentence
    assert ("second person or a load" in sentence) != bool(unit)


@pytest.mark.parametrize(("stated_kg", "times"), [(70.0, 9.80665), (27.7, 9.80665), (62.0, 1000.0)])
@pytest.mark.parametrize("height_m", [1.33, None])
def test_forces_that_nobody_of_this_stature_makes_are_wrong_and_not_the_stated_mass(
    stated_kg, times, height_m
):
    comparison = compared(stated_kg, times * stated_kg, height_m=height_m)
    is_nobody = height_m is not None or times * stated_kg > 400.0
    assert comparison.is_of_the_forces == is_nobody
    sentence = comparison.sentence("participants.tsv")
    assert (f"forces of another unit or gain, {times:.3g} times as large" in sentence) == is_nobody
    assert ("kilograms that were divided by 9.81" in sentence) != is_nobody


@pytest.mark.parametrize(
    ("stated_kg", "level"), [(70.0, "info"), (71.0, "info"), (66.0, "warning"), (78.0, "warning")]
)
def test_a_small_difference_stays_what_it_was(stated_kg, level):
    comparison = compared(stated_kg, 70.0)
    assert not comparison.is_gross
    finding = mass_finding(comparison.measured, comparison, "participants.tsv")
    assert finding.level == level and finding.check == "plate_mass"


def test_a_known_load_is_no_disagreement():
    assert compared(50.0, 70.0, load_kg=20.0).is_small
    assert "pounds" in compared(110.2, 70.0, load_kg=20.0).likely()


def test_what_the_plates_do_not_tell_is_not_compared():
    finding = mass_finding(unknown("nobody stood on them"), None, "")
    assert finding.level == "info" and "nobody stood on them" in finding.found
