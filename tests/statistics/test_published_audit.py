"""The audit finds what was planted in invented tables, nothing in sound ones, and what is known of
the papers."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy import stats

from benchmarks.printed_paper import (
    Cell,
    Claim,
    Interval,
    PrintedTable,
    Row,
    as_meant,
    image,
    load_paper,
    rounded_from,
)
from benchmarks.published_audit import audit, audit_csv, f_of_groups, unit_of_length
from bsip_cli.statistics import published
from tests.statistics.printed_study import (
    N,
    cohens_d,
    drawn_table,
    group_row,
    group_table,
    paired_row,
    paired_table,
    paper,
    sway_tables,
)


def found(table: PrintedTable, **more) -> list[tuple[str, str]]:
    """Row and kind of every slip; remarks contradict nothing."""
    return [(one.row, one.what) for one in audit(paper(table, **more)) if not one.is_remark]


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


def edge_row(**changes: str) -> PrintedTable:
    """One sound row at the edge of what rounding allows."""
    cells = {"A": Cell.of("5.00(0.40)"), "B": Cell.of("5.00(0.40)")}
    tests = {"t": "-0.00", "p": "1.000", "d": "0.00"} | changes
    ci_text = tests.pop("ci", "[-0.20, 0.20]")
    row = Row("edge", "", "kg", cells, tests, ci_text=ci_text)
    return paired_table(row)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"t": "0.00", "p": ".998"},
        {"ci": "[0.00, 0.00]", "t": "1.97", "p": ".074"},
        {"ci": "[-0.01, 0.00]", "t": "-1.97", "p": ".074"},
        {"ci": "[-0.20, 0.20]", "t": "0.00", "p": "1.000"},
    ],
)
def test_what_rounding_allows_is_no_slip(changes):
    assert found(edge_row(**changes)) == []


@pytest.mark.parametrize("star", ["", "*"])
def test_a_p_that_may_lie_on_either_side_of_alpha_may_have_a_star_or_not(star):
    assert ("edge", "star") not in found(edge_row(t="2.20", p=f".050{star}"))
    assert ("edge", "p") not in found(edge_row(t="2.20", p=f".050{star}"))


def test_standard_deviations_of_nothing_leave_d_open():
    cells = {"A": Cell.of("5.00(0.00)"), "B": Cell.of("5.02(0.00)")}
    tests = {"t": "-19.24", "p": ".000*", "d": "19.24"}
    row = Row("edge", "", "kg", cells, tests, ci_text="[-0.02, -0.02]")
    assert found(paired_table(row)) == []
    groups = {name: Cell.of("1.00(0.00)") for name in "ABC"}
    table = group_table(Row("x", "", "mm", groups, {"F": "88.00", "p": "0.00"}))
    assert found(table) == []


sd = partial(np.std, ddof=1)


@pytest.mark.parametrize(
    ("formula", "d"),
    [
        ("(B - A) / pooled SD of the two columns", cohens_d),
        ("(A - B) / mean of the two SDs", lambda x, y: 2 * (x - y).mean() / (sd(x) + sd(y))),
        ("(B - A) / SD of A", lambda x, y: (y - x).mean() / sd(x)),
        ("(A - B) / SD of the differences", lambda x, y: (x - y).mean() / sd(x - y)),
    ],
)
def test_the_definition_of_d_is_told(formula, d):
    rng = np.random.default_rng(11)
    rows = []
    for k in range(6):
        x = rng.normal(10.0, 1.0 + k, N)
        y = x * (1.6 + 0.3 * k) + rng.normal(1.0, 1.0, N)
        row = paired_row(f"row {k}", x, y)
        rows.append(replace(row, tests={**row.tests, "d": f"{d(x, y):.2f}"}))
    table = paired_table(*rows)
    assert found(table) == []
    remarks = [one.printed for one in audit(paper(table))]
    assert remarks == ([] if "differences" in formula else [f"{formula} in 6 of 6 rows"])


def test_a_d_of_no_known_definition_is_told_once():
    table = drawn_table(2)
    rows = (replace(row, tests={**row.tests, "d": "77.77"}) for row in table.rows)
    assert found(replace(table, rows=tuple(rows))) == [("all rows", "Cohen's d")]


def test_equal_cells_make_no_claim_false():
    cells = {"A": Cell.of("0.09"), "B": Cell.of("0.09")}
    row = Row("x", "", "", cells, {})
    claim = Claim("text", "smaller", method="A")
    assert found(PrintedTable("x", 4, "", "described", ("A", "B"), (row,), claims=(claim,))) == []


def test_several_exchanges_that_would_do_are_no_reading():
    sound = drawn_table(3)
    first, second = sound.rows[0], sound.rows[1]
    twin = replace(second, name="twin", cells=second.cells, ci_text=second.ci_text)
    wrong = with_row(
        paired_table(first, second, twin), 0, cells={**first.cells, "A": second.cells["A"]}
    )
    wrong = with_row(wrong, 1, cells={**second.cells, "A": first.cells["A"]})
    wrong = with_row(wrong, 2, cells={**second.cells, "A": first.cells["A"]})
    assert as_meant(wrong) == wrong


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
    ("test", "text", "what"), [("t", "-1.11", "t"), ("p", ".444", "p"), ("d", "3.33", "Cohen's d")]
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
    if unit == "mm":
        assert slips == []
    else:
        assert slips
        assert all(s.reading.startswith(f"the unit is {unit}, unless an offset") for s in slips)


def test_signs_are_held_against_the_legend():
    rng = np.random.default_rng(2)
    row = group_row("x", {name: rng.normal(3.0, 1.0, N) for name in "ABC"})
    marked = {
        **row.cells,
        "B": Cell.of(row.cells["B"].text + "*"),
        "C": Cell.of(row.cells["C"].text + "*+"),
    }
    table = replace(
        group_table(replace(row, cells=marked)), marks={"*": ("A", "C"), "+": ("B", "C")}
    )
    assert found(table) == [("x B", "marks")]
    assert ("x C", "marks") in found(replace(table, marks={"*": ("A", "B", "C")}))
    assert ("all rows", "marks") in found(replace(table, marks={**table.marks, "#": ("A", "B")}))


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


def test_what_ships_is_what_the_audit_finds():
    assert set(published.names()) == {"hansen2014", "hansen2017", "robert2017"}
    assert (published.FOLDER / "audit.csv").read_text(encoding="utf-8") == audit_csv()
    for name in published.names():
        audited, shipped = load_paper(name), published.load_paper(name)
        for table, other in zip(audited.tables, shipped.tables, strict=True):
            meant = {row.name: cells_in(row) for row in as_meant(table).rows}
            assert {row.name: cells_in(row) for row in other.as_meant().rows} == meant
            assert other.fits_unit == unit_of_length(audited, table)


def cells_in(row) -> dict[str, str]:
    return {method: cell.text for method, cell in row.cells.items()}


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
    assert by_what[3, "RMS AP RM", "unit"].reading.startswith("the unit is m, unless")
    assert (3, "RMS ML", "origin") in by_what
    assert by_what[3, "RMS AP OM", "marks"].reading == "one * for +"
    true = as_meant(load_paper("hansen2017").table(2))
    assert true.row("AP").cells["RM"].text == "88.67(11.03)"
    assert true.row("ML").cells["OM"].text == "12.69(4.82)"
