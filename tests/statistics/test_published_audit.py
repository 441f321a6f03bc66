"""The audit finds what was planted in invented tables, nothing in sound ones, and what is known of
the papers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed_study import (
    N,
    drawn_table,
    group_row,
    group_table,
    paired_row,
    paired_table,
    paper,
    sway_tables,
)
from scipy import stats

from bsip_cli.errors import UsageError
from bsip_cli.statistics.published.audit import audit
from bsip_cli.statistics.published.group_audit import f_of_groups
from bsip_cli.statistics.published.paper import Claim, PrintedTable, Row, load_paper, names
from bsip_cli.statistics.published.printed import Cell, Interval, image, rounded_from
from bsip_cli.statistics.published.readings import as_meant
from bsip_cli.statistics.published.sway_audit import unit_of_length


def found(table: PrintedTable, **more) -> list[tuple[str, str]]:
    """Row and kind of every slip but the definition of d, which is no slip of one row."""
    return [
        (one.row, one.what)
        for one in audit(paper(table, **more))
        if one.what != "definition of Cohen's d"
    ]


def with_row(table: PrintedTable, number: int, **changes) -> PrintedTable:
    rows = list(table.rows)
    rows[number] = replace(rows[number], **changes)
    return replace(table, rows=tuple(rows))


# --- rounding ---------------------------------------------------------------------------------


def test_a_printed_number_stands_for_all_that_round_to_it():
    assert rounded_from("-2.50") == Interval(-2.505, -2.495)
    assert rounded_from(".018").meets(Interval(0.0176, 0.0176))
    assert not rounded_from("4").meets(Interval(4.6, 5.0))
    with pytest.raises(ValueError, match="seven"):
        Cell.of("seven")


def test_an_image_holds_what_any_of_the_numbers_makes():
    rng = np.random.default_rng(3)
    a, b = Interval(1.0, 2.0), Interval(-3.0, -2.5)
    whole = image(lambda x, y: x / y, a, b)
    drawn = rng.uniform(a.low, a.high, 200) / rng.uniform(b.low, b.high, 200)
    assert whole.low <= drawn.min()
    assert drawn.max() <= whole.high


# --- sound tables -----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_in_a_sound_table(seed):
    assert found(drawn_table(seed)) == []


@pytest.mark.parametrize("seed", range(8))
def test_f_of_rounded_groups_holds_scipys(seed):
    rng = np.random.default_rng(seed)
    groups = [rng.normal(mean, 1.0, N) for mean in (3.0, 3.2, 3.9)]
    row = group_row("x", dict(zip("ABC", groups, strict=True)))
    cells = row.cells.values()
    whole = f_of_groups([c.mean for c in cells], [c.sd for c in cells], N)
    assert whole.low <= stats.f_oneway(*groups).statistic <= whole.high
    assert whole.high < 1.3 * whole.low + 0.1
    assert found(group_table(row)) == []


def test_equal_means_may_have_no_f_at_all():
    assert f_of_groups([rounded_from("0.09")] * 3, [rounded_from("0.05")] * 3, N).low == 0.0


# --- planted slips ----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_exchanged_cells_are_found_and_put_back(seed):
    sound = drawn_table(seed)
    rng = np.random.default_rng(100 + seed)
    (i, j), (a, b) = rng.choice(4, 2, replace=False), rng.choice(["A", "B"], 2)
    first, second = sound.rows[i].cells[a], sound.rows[j].cells[b]
    wrong = with_row(sound, i, cells={**sound.rows[i].cells, a: second})
    wrong = with_row(wrong, j, cells={**wrong.rows[j].cells, b: first})
    assert as_meant(wrong).rows == sound.rows
    slips = audit(paper(wrong))
    readings = {one.reading for one in slips if one.what == "means and interval"}
    assert len(readings) == 1
    assert readings.pop().endswith("are exchanged")
    assert {one.row for one in slips if one.what == "means and interval"} == {
        sound.rows[i].name,
        sound.rows[j].name,
    }


def test_an_interval_of_other_cells_is_told_by_its_difference():
    rng = np.random.default_rng(5)
    samples = {
        name: rng.normal(mean, 1.0, N) for name, mean in zip("abcd", (3, 9, 21, 45), strict=True)
    }
    rows = [paired_row(name, x, x + rng.normal(0.8, 0.3, N)) for name, x in samples.items()]
    other = paired_row("a", samples["c"], samples["b"])
    wrong = with_row(paired_table(*rows), 0, ci_text=other.ci_text, tests=other.tests)
    (slip,) = [one for one in audit(paper(wrong)) if one.what == "means and interval"]
    assert slip.row == "a"
    assert "c A" in slip.reading
    assert "b A" in slip.reading
    assert as_meant(wrong) == wrong


@pytest.mark.parametrize(
    ("test", "text", "what"),
    [("t", "-1.11", "t"), ("p", ".444", "p"), ("d", "3.33", "Cohen's d")],
)
def test_a_wrong_statistic_is_found_in_its_row(test, text, what):
    sound = drawn_table(1)
    wrong = with_row(sound, 2, tests={**sound.rows[2].tests, test: text})
    assert ("row 2", what) in found(wrong)
    assert {row for row, _ in found(wrong)} == {"row 2"}


def test_a_missing_star_is_found():
    sound = drawn_table(1)
    p = sound.rows[1].tests["p"]
    wrong = with_row(sound, 1, tests={**sound.rows[1].tests, "p": p.removesuffix("*")})
    assert p.endswith("*")
    assert found(wrong) == [("row 1", "star")]


def test_the_definition_of_d_is_told():
    (slip,) = audit(paper(drawn_table(2)))
    assert slip.printed == "(B - A) / pooled SD of the two columns in 4 of 4 rows"


def test_captions_are_held_against_the_table():
    sound = drawn_table(2)
    right, wrong = Claim("caption", "different"), Claim("caption", "equal")
    assert found(replace(sound, claims=(right,))) == []
    ((rows, what),) = found(replace(sound, claims=(wrong,)))
    assert what == "the caption"
    assert rows == "all rows"
    assert found(replace(sound, claims=(Claim("text", "smaller", method="A"),))) == []
    assert found(replace(sound, claims=(Claim("text", "smaller", method="B"),))) != []


def test_parts_that_are_no_whole_are_found():
    table = replace(drawn_table(2), adds_up_to_body_mass=True)
    total = sum(row.cells["A"].mean.middle for row in table.rows)
    slips = found(table, body_mass_kg=Cell.of(f"{total:.2f}(3.00)"))
    assert slips == [("sum of all rows", "body mass")]  # B's sum is another


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "mm"), (10.0, "cm"), (1000.0, "m")])
def test_the_unit_of_lengths_is_told_by_the_errors_of_the_same_paths(scale, unit):
    errors, sway = sway_tables(scale=scale)
    one = paper(errors, sway, sequence_s=rounded_from("100"))
    assert unit_of_length(one, sway) == unit
    slips = [s for s in audit(one) if s.table == 3]
    assert {s.reading for s in slips} == (set() if unit == "mm" else {f"the unit is {unit}"})


def test_a_length_that_is_no_speed_times_time_is_found():
    errors, sway = sway_tables(seconds=7.0)
    slips = [s for s in audit(paper(errors, sway, sequence_s=rounded_from("100"))) if s.table == 3]
    assert [(s.row, s.what) for s in slips] == [("sway_length / mean_velocity", "duration")]


def test_a_distance_from_an_origin_is_no_sway():
    errors, sway = sway_tables(from_ml_origin=3000.0)
    assert ("rms_ml", "origin") in [(s.row, s.what) for s in audit(paper(errors, sway))]


def test_a_mean_of_few_is_not_far_below_their_maximum():
    cells = {"mean": Cell.of("0.30"), "max": Cell.of("6.00")}
    table = PrintedTable("x", 1, "", "summary", ("mean", "max"), (Row("a", "", "", cells, {}),))
    assert found(replace(table, values=15)) == [("a", "mean")]
    assert found(replace(table, values=25)) == []


# --- the papers -------------------------------------------------------------------------------


def test_every_paper_can_be_read_and_audited():
    assert set(names()) == {"hansen2014", "hansen2017", "robert2017"}
    for name in names():
        one = load_paper(name)
        assert one.tables
        audit(one)
    with pytest.raises(UsageError, match="hansen2017"):
        load_paper("hansen2071")


def test_what_is_known_of_hansen_2017():
    slips = audit(load_paper("hansen2017"))
    by_what = {(s.table, s.row, s.what): s for s in slips}
    assert "upper torso OM" in by_what[1, "upper torso", "means and interval"].reading
    assert "head RM" in by_what[1, "upper torso", "means and interval"].reading
    assert "(RM - OM) / pooled SD" in by_what[1, "all rows", "definition of Cohen's d"].printed
    assert (1, "all rows", "the caption") in by_what
    for row in ("AP", "ML"):
        reading = by_what[2, row, "means and interval"].reading
        assert "AP RM" in reading
        assert "ML OM" in reading
    assert (2, "AP", "p") in by_what
    assert by_what[3, "RMS AP RM", "unit"].reading == "the unit is m"
    assert (3, "RMS ML", "origin") in by_what
    true = as_meant(load_paper("hansen2017").table(2))
    assert true.row("AP").cells["RM"].text == "88.67(11.03)"
    assert true.row("ML").cells["OM"].text == "12.69(4.82)"
