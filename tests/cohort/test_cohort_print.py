"""The renderers, and what the printed tables say."""

import csv
import io
import re
from math import nan

import pytest

from bsip_cli.artifacts import read_header
from bsip_cli.report.tables.build import IN_PRINT, NAMES, build_tables, show
from bsip_cli.report.tables.model import (
    Column,
    Row,
    Table,
    interval,
    mean_sd,
    number,
    p_value,
    to_csv,
    to_latex,
    to_markdown,
)
from bsip_cli.report.tables.model import escape_latex as latex
from bsip_cli.report.tables.model import escape_markdown as markdown
from bsip_cli.report.tables.published import comparison_name
from bsip_cli.statistics.cohort import Criteria

BESIDE = tuple(map(comparison_name, IN_PRINT))
NASTY = r"50% of A&B_1 #2 {x} ~y ^z $5 \end{table} a|b <b>*bold*</b> `c`"


def small_table(label: str = "a", unit: str = "kg") -> Table:
    columns = (
        Column(("name",), "Name", text=True),
        Column(("mean", "sd"), "M(SD)", mean_sd, in_row_unit=True),
        Column(("p",), "p", p_value),
        Column(("hidden",)),
    )
    first = {"name": label, "mean": 1 / 3, "sd": 0.25, "p": 0.0004, "hidden": 0.1 + 0.2}
    second = {"name": "b", "mean": -0.001, "sd": nan, "p": nan, "hidden": ""}
    rows = (Row(first, unit, "group 1", {"p": "*"}), Row(second, "N m", "group 2"))
    return Table("small", f"Title {label}", columns, rows, (f"Note {label}.",))


def test_csv_round_trip():
    table = small_table(NASTY + ' "quoted", and\na new line')
    rows = list(csv.DictReader(io.StringIO(to_csv(table))))
    assert rows[0]["name"] == table.rows[0].values["name"]
    assert float(rows[0]["mean_kg"]) == 1 / 3
    assert float(rows[0]["hidden"]) == 0.1 + 0.2
    assert (rows[0]["mean_Nm"], rows[1]["mean_kg"]) == ("", "")
    assert (rows[1]["sd_Nm"], rows[1]["p"], rows[1]["hidden"]) == ("", "", "")
    assert float(rows[1]["mean_Nm"]) == -0.001


def test_markdown_layout():
    assert to_markdown(small_table()) == (
        "**Title a**\n\n"
        "| Name    |      M(SD) |      p |\n"
        "| ------- | ---------: | -----: |\n"
        "| group 1 |            |        |\n"
        "| a       | 0.33(0.25) | <.001* |\n"
        "| group 2 |            |        |\n"
        "| b       |    0.00(-) |      - |\n"
        "\nNote a.\n"
    )


def test_latex_layout():
    text = to_latex(small_table())
    assert r"\begin{tabular}{lrr}" in text
    assert r"a & 0.33(0.25) & \textless{}.001* \\" in text
    assert r"\multicolumn{3}{l}{\textit{group 2}} \\" in text
    assert text.count(r"\begin{") == text.count(r"\end{")


def test_latex_escapes_every_sign():
    expected = (
        r"50\% of A\&B\_1 \#2 \{x\} \textasciitilde{}y \textasciicircum{}z \$5 "
        r"\textbackslash{}end\{table\} a\textbar{}b \textless{}b\textgreater{}*bold*"
        r"\textless{}/b\textgreater{} `c`"
    )
    assert latex(NASTY) == expected
    text = to_latex(small_table(NASTY))
    assert text.count(expected) == 3  # title, cell and note
    assert text.count(r"\end{table}") == 1


@pytest.mark.parametrize("label", ["* starred", "[bracket]"])
def test_latex_row_that_starts_with_an_argument(label):
    r"""After the \\ of the row before, a star or a bracket would be read as its argument."""
    assert "{}" + label in to_latex(small_table(label))


def test_minus_signs():
    assert latex("[-0.10, -.5] x-1 OM-RM - 2") == "[$-$0.10, $-$.5] x-1 OM-RM - 2"


def test_markdown_escapes_what_has_a_meaning():
    assert markdown("a|b <b>x</b> *bold* `c`") == r"a\|b &lt;b>x&lt;/b> \*bold* \`c\`"
    assert markdown(".018*") == ".018*"
    assert markdown("d_z p < .05") == "d_z p < .05"
    assert markdown("* significant") == r"\* significant"
    line = to_markdown(small_table("a|b")).splitlines()[5]
    assert len(re.findall(r"(?<!\\)\|", line)) == 4


@pytest.mark.parametrize(
    ("p", "printed"),
    [
        (0.0181, ".018"),
        (0.0004, "<.001"),
        (0.0005, ".001"),
        (0.9999, "1.000"),
        (nan, "-"),
        (0.0, "<.001"),
        (1.0, "1.000"),
    ],
)
def test_p_values(p, printed):
    assert p_value(p) == printed


def test_numbers():
    assert number(-0.004) == "0.00"
    assert number(-12.3461) == "-12.35"
    assert mean_sd(8.788, 1.1) == "8.79(1.10)"
    assert mean_sd(36123.4, 2799.6) == "36123(2800)"
    assert interval(-0.104, 0.01) == "[-0.10, 0.01]"
    assert interval(nan, nan) == "-"


def rows_of(text: str) -> list[list[str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_printed_table_1_is_the_csv_rounded(cohort):
    header, _, *rows = rows_of(cohort.text("table1_segment_mass"))
    table = cohort.table("table1_segment_mass")
    assert [row[0] for row in rows[:6]] == [
        "lower torso",
        "upper torso",
        "head",
        "left upper arm",
        "left forearm",
        "left hand",
    ]
    for cells, (_, numbers) in zip(rows, table.iterrows(), strict=True):
        printed = dict(zip(header, cells, strict=True))
        assert printed["OM M(SD)"] == f"{numbers.om_mean_kg:.2f}({numbers.om_sd_kg:.2f})"
        assert printed["t"].replace("-0.00", "0.00") == f"{numbers.t:.2f}".replace("-0.00", "0.00")
        assert printed["p"].endswith("*") == (numbers.p < 0.05)
        assert printed["data share"] == f"{numbers.mass_data_share:.2f}"


@pytest.mark.parametrize("ending", ["md", "tex"])
def test_every_table_says_what_is_published_and_what_is_added(cohort, ending):
    for name in NAMES:
        text = cohort.text(name, ending)
        assert "As published" in text
        assert "Added" in text
        assert "n = 8 participants" in text
    assert "not decided by the data alone" in cohort.text(NAMES[0], ending)
    for name in (NAMES[1], NAMES[2], NAMES[3], NAMES[4]):
        assert "fitted to these very data in 8 of 8 participants" in cohort.text(name, ending)


def test_post_hoc_marks_of_table_3(cohort):
    """The made-up RM sways more than FP and OM in AP, and nothing else differs."""
    for cells in rows_of(cohort.text("table3_posturography"))[2:]:
        assert cells[3].endswith("+*") == (cells[0] == "RMS AP [mm]")
        assert not cells[2].endswith("#")


def test_published_values_stand_beside_the_studys(cohort):
    """The study's numbers are those of its own table; exchanged cells stand where they belong."""
    rows = rows_of(cohort.text("table2_beside_hansen2017"))
    own = rows_of(cohort.text("table2_cop_rmse"))
    for (name, _, om, om_print, rm, rm_print, *_), mine in zip(rows[2:], own[2:], strict=True):
        assert [name, om, rm] == mine[:3]
        meant = {"AP": ("3.84(1.49)", "88.67(11.03)†"), "ML": ("12.69(4.82)†", "69.63(22.36)")}
        assert (om_print, rm_print) == meant[name]
    table = cohort.table("table1_beside_hansen2017").set_index("row")
    assert table.loc["left hand", "om_printed_mean"] == 0.95
    own_mass = cohort.table("table1_segment_mass").set_index("segment")
    assert table.loc["left hand", "om_mean"] == own_mass.loc["hand_l", "om_mean_kg"]
    walking = cohort.table("table4_beside_hansen2017").set_index("row").loc["COP error, walking"]
    four = cohort.table("table4_cross_validation").set_index(["quantity", "task"])
    assert walking["rm_mean"] == four.loc[("cop_error", "walking"), "rm_mean_mm"]
    assert walking["chen_2011_printed_mean"] == 12.08
    sway = cohort.table("table3_beside_hansen2017").set_index("row")
    three = cohort.table("table3_posturography").set_index("variable")
    assert sway.loc["RMS AP", "fp_mean"] == three.loc["rms_ap_origin", "fp_mean_m"]


def test_latex_beside_print_is_plain(cohort):
    """A dagger is no letter that every LaTeX knows."""
    for name in BESIDE:
        assert cohort.text(name, "tex").isascii()
    assert r"88.67(11.03)\dag{}" in cohort.text(BESIDE[1], "tex")


def test_no_absent_number_is_printed_as_nan(cohort):
    for ending in ("md", "tex", "csv"):
        for name in NAMES:
            assert not re.search(r"\bnan\b", cohort.text(name, ending))


def test_render_and_show_give_the_written_texts(cohort):
    facts = read_header(cohort.out / "group" / "group_values.parquet")["provenance"]["facts"]
    tables = build_tables(cohort.group("comparisons"), Criteria(0.05, 10.0), facts["fitted_on"])
    texts = {table.name: to_markdown(table) for table in tables}
    assert texts == {name: cohort.text(name) for name in (*NAMES, *BESIDE)}
    assert show(cohort.out) == "\n\n".join(texts[name] for name in NAMES)
