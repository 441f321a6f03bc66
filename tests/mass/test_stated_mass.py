"""A stated mass that is grossly wrong is said with both numbers and what it is likely to be."""

from __future__ import annotations

import pytest

from bsip_cli.recordings.measured_mass import Comparison, MeasuredMass, mass_finding, unknown


def compared(stated_kg: float, plates_kg: float, load_kg: float = 0.0, height_m=1.74):
    told = MeasuredMass(plates_kg, 0.006, 3.0, 2)
    return Comparison(stated_kg, load_kg, told, 2.0, 15.0, height_m)


@pytest.mark.parametrize(
    ("stated_kg", "plates_kg", "likely"),
    [
        (110.9, 50.3, "pounds"),
        (165.3, 75.0, "pounds"),
        (397.0, 180.0, "pounds"),
        (11.0, 70.0, "stones"),
        (13.4, 85.0, "stones"),
        (16.2, 103.0, "stones"),
        (353.0, 36.0, "newton"),
        (392.3, 40.0, "newton"),
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


@pytest.mark.parametrize(("stated_kg", "plates_kg"), [(60.0, 75.0), (90.0, 60.0), (70.0, 140.0)])
def test_what_is_no_known_mistake_is_said_without_a_guess(stated_kg, plates_kg):
    comparison = compared(stated_kg, plates_kg)
    assert comparison.is_gross and not comparison.likely()
    assert "second person or a load" in comparison.sentence("participants.tsv")


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


@pytest.mark.parametrize(
    ("newton", "unit"), [(4.44822, "pounds-force"), (9.80665, "kilogram-force"), (2.0, "")]
)
def test_forces_in_another_unit_than_newton(newton, unit):
    """The stated mass is right, and the plates' is too small by the unit."""
    said = compared(50.3, 50.3 / newton)
    assert said.likely() == "" and said.is_gross
    sentence = said.sentence("participants.tsv")
    assert ("the forces are likely to be in" in sentence) == bool(unit) and unit in sentence
