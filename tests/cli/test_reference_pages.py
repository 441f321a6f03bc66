"""docs/ says what the code says."""

from __future__ import annotations

from pathlib import Path

import pytest

from bsip_cli.cli import cli
from bsip_cli.reference import REGENERATE, OptionText, option_texts, pages, write_pages
from bsip_cli.schemas import SCHEMAS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", pages())
def test_page_is_up_to_date(name):
    file = DOCS / name
    written = file.read_text(encoding="utf-8") if file.exists() else ""
    assert written == pages()[name], f"the code has changed: run `{REGENERATE}`"


def test_command_writes_the_pages(tmp_path):
    write_pages(tmp_path / "docs")
    assert {file.name for file in (tmp_path / "docs").iterdir()} == set(pages())


def test_every_command_with_its_options():
    page = pages()["cli.md"]
    for name, command in cli.commands.items():
        assert f"bsip {name} [OPTIONS]" in page
        assert all(each.opts[0] in page for each in command.params if each.opts[0][0] == "-")


def test_every_column_of_every_artifact():
    page = pages()["artifacts.md"]
    for kind, schema in SCHEMAS.items():
        section = page.partition(f"### {kind}\n")[2].partition("\n#")[0]
        names = [line.split("`")[1] for line in section.splitlines() if line.startswith("| `")]
        assert names == [column.name for column in schema.columns]


def test_option_with_unit_limits_and_reason():
    page = pages()["options.md"]
    assert (
        "| `cop_min_force_percent_bw` | `30.0` | % body weight | > 0, < 100 | The centre of "
        "pressure is computed while the vertical force is above this: it is a quotient" in page
    )
    assert '| `method` | `"spline"` |  | `spline` or `butterworth` |' in page


def test_comments_belong_to_the_option_below():
    """The head of the file explains none; a comment of two lines is one text."""
    first = option_texts()[0]
    assert first.name == "marker_set"
    assert first.comment.startswith("Which markers mean what")
    assert first.comment.endswith("bsip says which).")


def test_unit_is_taken_out_of_the_comment():
    option = OptionText("ingest", "max_gap_s", "0.2", "Gaps up to this are filled [s]. Why.")
    assert (option.unit, option.meaning) == ("s", "Gaps up to this are filled. Why.")
