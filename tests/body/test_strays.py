"""How far people stray from the table, by segment, and whom it does not hold for."""

import numpy as np
import pytest

from bsip_cli.body.anthropometry import strays_of

ROWS = ("pelvis", "torso", "head", "arm", "forearm", "hand", "thigh", "shank", "foot")
AVERAGE = 24.1  # body-mass index of the sample


def of(sex: str, mass_kg: float, stature_m: float) -> dict[str, float]:
    return dict(zip(ROWS, strays_of(sex, mass_kg, stature_m, ROWS).mass, strict=True))


@pytest.mark.parametrize("sex", ["M", "F", "other"])
def test_every_segment_has_spreads_as_published_regressions_leave(sex):
    strays = strays_of(sex, AVERAGE * 1.7**2, 1.7, ROWS)
    assert strays.outside == ""
    assert np.all((strays.mass > 5) & (strays.mass < 25))
    assert np.all((strays.moments > 10) & (strays.moments < 40))


def test_centres_are_told_along_limbs_alone():
    com = strays_of("M", 75.0, 1.78, ROWS).com
    told = np.argwhere(np.isfinite(com))
    along = {ROWS[i]: int(axis) for i, axis in told}
    assert along == dict.fromkeys(ROWS[2:], 1) | {"foot": 0}
    assert np.nanmax(com) < 4


def test_the_sample_s_mean_person_has_what_people_and_tables_stray_by():
    assert of("M", 73.0, 1.741)["thigh"] == pytest.approx(np.hypot(7.0, 9.9), rel=1e-3)


def test_the_other_sex_lies_between():
    man, woman, other = (of(sex, 73.0, 1.741) for sex in ("M", "F", "other"))
    for row in ROWS:
        assert min(man[row], woman[row]) <= other[row] <= max(man[row], woman[row])


def test_heavy_people_stray_further_and_are_named():
    strays = strays_of("M", 110.0, 1.75, ROWS)
    assert "body-mass index 36 kg/m2" in strays.outside
    average = strays_of("M", AVERAGE * 1.75**2, 1.75, ROWS)
    assert np.all(strays.mass > average.mass)
    assert strays.mass[ROWS.index("head")] > 2 * average.mass[ROWS.index("head")]


def test_thin_people_are_named():
    assert "body-mass index 16 kg/m2" in strays_of("F", 45.0, 1.68, ROWS).outside


def test_a_child_s_head_is_that_of_no_adult():
    small, tall, adult = (strays_of("M", m, h, ROWS) for m, h in [(21, 1.16), (40, 1.5), (65, 1.7)])
    head = ROWS.index("head")
    assert small.mass[head] > 150 > tall.mass[head] > 40 > adult.mass[head]
    assert "1.16 m tall" in small.outside and "1.50 m tall" in tall.outside
    assert adult.outside == ""


def test_a_woman_may_be_smaller_than_a_man():
    assert strays_of("F", 52.0, 1.52, ROWS).outside == ""
    assert strays_of("M", 52.0, 1.52, ROWS).outside
