"""Segment inertia by the tables: masses, repairs, editions, and how far people stray from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.anthropometry import load_table, mean_length_m, regress, stature_m, strays_of
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.people import Inertia, combined, mean_segments
from tests.blind import second_world
from tests.body.standing_person import standing


@pytest.mark.parametrize("sex", ["M", "F", "other"])
@pytest.mark.parametrize("mass_kg", [48.3, 95.0])
def test_segments_are_physical_and_their_masses_sum_to_the_stated_mass(sex, mass_kg):
    inertias = regress(standing(sex).person, sex, mass_kg).inertias
    assert sum(body.mass_kg for body in inertias) == pytest.approx(mass_kg, rel=1e-12)
    assert all(body.is_physical() for body in inertias)
    for body in inertias:
        principal = np.sort(np.linalg.eigvalsh(body.tensor_kgm2))
        assert principal[0] > 0
        assert principal[0] + principal[1] > principal[2]


@pytest.mark.parametrize(("sex", "noted"), [("M", set()), ("F", {"upper_torso"})])
def test_only_the_female_torso_is_repaired_by_less_than_a_tenth(sex, noted):
    person = standing(sex).person
    result = regress(person, sex, 70.0)
    named = {s for s, note in zip(person.skeleton.segments, result.notes, strict=True) if note}
    assert named == noted
    assert all("nearest possible" in note for note in result.notes if note)
    for at in map(person.skeleton.index, noted):
        body, row = result.inertias[at], load_table("dumas2007")[sex, "torso"]
        printed = body.mass_kg * person.lengths_m[at] ** 2 * row.gyration
        assert 0 < np.linalg.norm(body.tensor_kgm2 - printed) < 0.1 * np.linalg.norm(printed)


@pytest.mark.parametrize("sex", ["M", "F"])
def test_left_is_right_mirrored(sex):
    person = standing(sex).person
    skeleton = person.skeleton
    lengths = person.lengths_m.copy()
    for name in SEGMENTS:
        if name.endswith("_l"):
            lengths[skeleton.index(name)] = lengths[skeleton.index(f"{name[:-1]}r")]
    inertias = regress(replace(person, lengths_m=lengths), sex, 70.0).inertias
    mirror = np.diag([1.0, 1.0, -1.0])
    pairs = [name for name in SEGMENTS if name.endswith("_l")]
    assert len(pairs) == 6
    for name in pairs:
        left = inertias[skeleton.index(name)]
        right = inertias[skeleton.index(f"{name[:-1]}r")]
        assert left.mass_kg == pytest.approx(right.mass_kg, rel=1e-14)
        np.testing.assert_allclose(left.com_m, mirror @ right.com_m, rtol=1e-14)
        assert abs(right.com_m[2]) > 0
        np.testing.assert_allclose(left.tensor_kgm2, mirror @ right.tensor_kgm2 @ mirror)


def test_one_row_by_hand():
    """Male thigh: 12.3 % of 100.2; centre -4.1, -42.9, 3.3; radii 29 15 30; 7, 2i, 7i."""
    person = standing("M").person
    at = person.skeleton.index("thigh_l")
    lengths = person.lengths_m.copy()
    lengths[at] = 0.44
    thigh = regress(replace(person, lengths_m=lengths), "M", 70.0).inertias[at]
    mass = 70.0 * 12.3 / 100.2  # 6.7 + 33.3 + 14.2 + 2 (2.4 + 1.7 + 0.6 + 12.3 + 4.8 + 1.2)
    assert thigh.mass_kg == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(thigh.com_m, [-0.01804, -0.18876, -0.01452], rtol=1e-12)
    by_hand = mass * np.array(
        [
            [0.1276**2, 0.0308**2, 0.0088**2],  # xz and yz change their sign on the left
            [0.0308**2, 0.066**2, 0.0308**2],
            [0.0088**2, 0.0308**2, 0.132**2],
        ]
    )
    np.testing.assert_allclose(thigh.tensor_kgm2, by_hand, rtol=1e-12)


def test_the_foots_row_goes_with_its_own_length():
    """Centre of mass 69.9 mm ahead of the ankle; with the other edition's length it is 24 % less.

    The calibrated length is the distance from heel to toe marker, not to the metatarsal heads.
    """
    person = standing("M").person
    at = person.skeleton.index("foot_r")
    mean = mean_length_m("M", "foot", None)
    assert mean == 0.183
    lengths = person.lengths_m.copy()
    lengths[at] = mean
    foot = regress(replace(person, lengths_m=lengths), "M", 70.0).inertias[at]
    assert foot.com_m[0] == pytest.approx(0.382 * 0.183, rel=1e-12)
    np.testing.assert_allclose(
        np.diag(foot.tensor_kgm2) / foot.mass_kg,
        (0.183 * np.array([0.17, 0.37, 0.36])) ** 2,
        rtol=1e-12,
    )


def test_the_head_is_the_corrigendums():
    row = load_table("dumas2007")["M", "head"]
    np.testing.assert_allclose(row.com, [0.02, 0.536, 0.001])
    assert row.mean_length_m == 0.278


@pytest.mark.parametrize("sex", ["M", "F", "other"])
def test_stature_and_mean_lengths_are_inverse(sex):
    lengths = {name: mean_length_m(sex, name, 1.90) for name in ("torso", "thigh", "shank")}
    assert stature_m(sex, lengths) == pytest.approx(1.90, rel=1e-12)


def test_other_sexes_lie_halfway():
    """Masses, centres, tensors and mean lengths; the one impossible tensor is mended after that."""
    person = standing("M").person
    man, woman, other = (regress(person, sex, 70.0).inertias for sex in ("M", "F", "other"))
    for one, two, mean in zip(man, woman, other, strict=True):
        middle = (one.mass_kg + two.mass_kg) / 2
        assert mean.mass_kg == pytest.approx(middle, rel=0.01)  # the tables sum to nearly 100 %
        np.testing.assert_allclose(mean.com_m, (one.com_m + two.com_m) / 2, atol=1e-12)
    rows = load_table("dumas2007")
    thigh = [rows[sex, "thigh"] for sex in ("M", "F", "other")]
    np.testing.assert_allclose(thigh[2].gyration, (thigh[0].gyration + thigh[1].gyration) / 2)
    assert mean_length_m("other", "thigh", None) == pytest.approx(
        (mean_length_m("M", "thigh", None) + mean_length_m("F", "thigh", None)) / 2
    )


@pytest.mark.parametrize(("sex", "leaning_2007_deg"), [("M", 40), ("F", 42)])
def test_the_torso_of_2015_stands_upright_and_further_ahead(sex, leaning_2007_deg):
    old, new = (load_table(name)[sex, "torso"] for name in ("dumas2007", "dumas2015"))
    leaning = []
    for row in (old, new):
        along = np.linalg.eigh(row.gyration)[1][:, 0]  # of the smallest moment
        leaning.append(np.rad2deg(np.arccos(abs(along[1]))))
    assert leaning[0] == pytest.approx(leaning_2007_deg, abs=1)
    assert leaning[1] < 6
    assert new.mass_fraction == pytest.approx(old.mass_fraction)
    assert new.mean_length_m == pytest.approx(old.mean_length_m)
    ahead = new.com[0] * new.mean_length_m - old.com[0] * old.mean_length_m
    assert 0.015 < ahead < 0.020


@pytest.mark.parametrize("sex", ["M", "F"])
def test_the_torso_of_2015_is_the_sum_of_its_parts(sex):
    mean = mean_segments(sex)  # the simulator's own copy of the numbers, united by its own code
    parts, origins = [], [np.zeros(3), np.array([0.0, -mean["thorax"].length_m, 0.0])]
    for name in ("thorax", "abdomen"):
        row, share = mean[name], mean[name].mass_percent / 100
        parts.append(Inertia(share, row.length_m * row.com, share * row.length_m**2 * row.tensor))
    whole = combined(list(zip(parts, origins, strict=True)))
    row = load_table("dumas2015")[sex, "torso"]
    assert row.mass_fraction == pytest.approx(whole.mass_kg)
    np.testing.assert_allclose(row.com * row.mean_length_m, whole.com_m, atol=1e-12)
    np.testing.assert_allclose(
        row.mass_fraction * row.mean_length_m**2 * row.gyration, whole.tensor_kgm2, rtol=1e-9
    )


def test_the_table_of_2015_differs_in_the_torso_alone():
    old, new = load_table("dumas2007"), load_table("dumas2015")
    differ = {key for key in old if not np.array_equal(old[key].gyration, new[key].gyration)}
    assert differ == {("M", "torso"), ("F", "torso"), ("other", "torso")}


ROWS = ("pelvis", "torso", "head", "arm", "forearm", "hand", "thigh", "shank", "foot")
AVERAGE = 24.1  # body-mass index mass_strays the sample


def mass_strays(sex: str, mass_kg: float, stature_m: float) -> dict[str, float]:
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
    assert com[ROWS.index("arm"), 1] == pytest.approx(np.hypot(1.0, 10.9 / 2**0.5))
    assert np.nanmax(com) < 8


def test_the_sample_s_mean_person_has_what_people_and_tables_stray_by():
    tables = 14.1 / 2**0.5
    assert mass_strays("M", 73.0, 1.741)["thigh"] == pytest.approx(np.hypot(7.0, tables), rel=1e-3)


@pytest.mark.parametrize("sex", ["M", "F"])
def test_the_other_table_s_masses_are_those_of_de_leva(sex):
    """Over the mean of both, in %; the trunk's in sum."""
    lines = (Path(second_world.__file__).parent / "de_leva.csv").read_text("utf-8").splitlines()
    cells = [line.split(",") for line in lines[1:]]
    leva = {row[1]: float(row[2]) for row in cells if row[0] == sex}
    trunk = sum(leva[f"{part}_trunk"] for part in ("upper", "middle", "lower"))
    leva |= {"arm": leva["upper_arm"], "torso": trunk, "pelvis": trunk}
    dumas = {row: 100 * load_table("dumas2007")[sex, row].mass_fraction for row in ROWS}
    dumas |= dict.fromkeys(("torso", "pelvis"), dumas["torso"] + dumas["pelvis"])
    mass, along = strays_of(sex, 73.0, 1.741, ROWS).other.T
    for row, percent in zip(ROWS, mass, strict=True):
        a, b = dumas[row], leva[row]
        assert percent == pytest.approx(200 * (b - a) / (a + b), abs=0.1)
    assert along[ROWS.index("thigh")] > 0 > along[ROWS.index("shank")]  # 41 and 44 % of the way


def test_the_other_sex_lies_between():
    man, woman, other = (mass_strays(sex, 73.0, 1.741) for sex in ("M", "F", "other"))
    for row in ROWS:
        assert min(man[row], woman[row]) <= other[row] <= max(man[row], woman[row])


def test_heavy_people_stray_further_and_are_named():
    strays = strays_of("M", 110.0, 1.75, ROWS)
    assert "body-mass index 36 kg/m2" in strays.outside
    average = strays_of("M", AVERAGE * 1.75**2, 1.75, ROWS)
    assert np.all(strays.mass > average.mass)
    assert strays.mass[ROWS.index("head")] > 2 * average.mass[ROWS.index("head")]


def test_a_child_s_head_is_that_of_no_adult():
    small, tall, adult = (strays_of("M", m, h, ROWS) for m, h in [(21, 1.16), (40, 1.5), (65, 1.7)])
    head = ROWS.index("head")
    assert small.mass[head] > 150 > tall.mass[head] > 40 > adult.mass[head]
    assert "1.16 m tall" in small.outside and "1.50 m tall" in tall.outside
    assert adult.outside == ""


@pytest.mark.parametrize(
    ("sex", "mass_kg", "stature_m", "said"),
    [
        ("F", 45.0, 1.68, "body-mass index 16 kg/m2"),
        ("F", 52.0, 1.52, ""),
        ("M", 52.0, 1.52, "1.52 m tall"),
    ],
)
def test_who_is_outside_the_sample_is_named(sex, mass_kg, stature_m, said):
    outside = strays_of(sex, mass_kg, stature_m, ROWS).outside
    assert said in outside and bool(said) == bool(outside)
