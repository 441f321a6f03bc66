"""All trials of a person together: agreement, disagreement, and who is no person."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.measured_mass import (
    differing_plates,
    differing_trials,
    least_mass,
    mass_finding,
    measured_mass,
    plate_gains,
)
from tests.mass.body import rise, told


def test_more_intervals_show_more():
    one, many = (measured_mass({"a": told(62.0, s, 0.08)}, 10.0) for s in (0.8, 12.0))
    assert many.half_width_percent < one.half_width_percent
    assert many.intervals == 6 and many.seconds == pytest.approx(11.8, abs=0.1)


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
