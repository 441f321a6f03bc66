"""docs/ says what the code says."""

from __future__ import annotations

from pathlib import Path

import pytest

from bsip_cli.cli import cli
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.reference import REGENERATE, OptionText, option_texts, pages, write_pages
from bsip_cli.report.effect_words import EFFECT_WORDS
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
    sections = pages()["cli.md"].split("\n## ")
    for name, command in cli.commands.items():
        (section,) = (
            one for one in sections if name in one.partition("\n")[0].replace(",", "").split()
        )
        assert all(each.opts[0] in section for each in command.params if each.opts[0][0] == "-")


def test_every_column_of_every_artifact():
    page = pages()["artifacts.md"]
    for kind, schema in SCHEMAS.items():
        section = page.partition(f"### {kind}\n")[2].partition("\n#")[0]
        if "Columns as in" in section:
            earlier = section.split("(#")[1].split(")")[0]
            assert SCHEMAS[earlier].columns == schema.columns
            continue
        lines = [one for one in section.splitlines() if one.startswith(("- `", "And `"))]
        names = [name for one in lines for name in one.partition(" (")[0].split("`")[1::2]]
        assert sorted(names) == sorted(column.name for column in schema.columns)


def test_common_columns_are_explained():
    page = pages()["artifacts.md"]
    explained = page.partition("## Columns of many artifacts")[2].partition("\n## ")[0]
    for line in page.splitlines():
        if line.startswith("And `"):
            assert all(f"`{name}`" in explained for name in line.split("`")[1::2])


def test_every_fault_with_its_chance_of_being_found():
    page = pages()["faults.md"]
    for effect in CATALOGUE:
        section = page.partition(f"## {effect.name}: ")[2].partition("\n## ")[0]
        assert effect.looks in section and effect.remedy in section
    assert "- Sure: named in 2 of 2, 5 of 5 intervals." in page


def test_every_fault_with_what_to_do():
    advice = pages()["faults.md"].partition("\n## What to do\n")[2]
    for effect in CATALOGUE:
        (line,) = (one for one in advice.splitlines() if f"`{effect.name}`" in one)
        assert EFFECT_WORDS[effect.name].consequence in line


def test_option_with_unit_limits_and_reason():
    page = pages()["options.md"]
    assert (
        "- `cop_min_force_percent_bw` = `30.0` % body weight (> 0, < 100): The centre of pressure "
        "is computed while the vertical force is above this: it is a quotient" in page
    )
    assert '- `method` = `"spline"` (`spline` or `butterworth`): ' in page


def test_comments_belong_to_the_option_below():
    """The head of the file explains none; a comment of two lines is one text."""
    first = option_texts()[0]
    assert first.name == "marker_set"
    assert first.comment.startswith("Which markers mean what")
    assert first.comment.endswith("bsip says which.")


def test_unit_is_taken_out_of_the_comment():
    option = OptionText("ingest", "max_gap_s", "0.2", "Gaps up to this are filled [s]. Why.")
    assert (option.unit, option.meaning) == ("s", "Gaps up to this are filled. Why.")
