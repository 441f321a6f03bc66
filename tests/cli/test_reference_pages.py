"""docs/ says what the code says."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from bsip_cli.cli import cli
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.reference import REGENERATE, OptionText, option_texts, pages, write_pages
from bsip_cli.report.causes import EFFECT_WORDS, usual_words
from bsip_cli.schemas import SCHEMAS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", pages())
def test_page_is_up_to_date(name):
    file = DOCS / name
    written = file.read_text(encoding="utf-8") if file.exists() else ""
    assert written == pages()[name], f"the code has changed: run `{REGENERATE}`"


def test_command_writes_the_pages(tmp_path):
    write_pages(tmp_path)
    assert {str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*.md")} == set(pages())


def test_no_page_of_a_fault_is_left_over():
    assert {f"faults/{file.name}" for file in (DOCS / "faults").iterdir()} <= set(pages())


def spelled_out(line: str, order: Sequence[str]) -> list[str]:
    """The names in a line of a page, with all between the first and the last of "`a` to `c`"."""
    names: list[str] = []
    for part in re.findall(r"`([^`]+)`(?: to `([^`]+)`)?", line):
        first, last = (order.index(name) if name else None for name in part)
        names += [part[0]] if last is None else order[first : last + 1]
    return names


def first_names(section: str) -> list[str]:
    return re.findall(r"^- `([^ ,`]+)", section, flags=re.MULTILINE)


def test_every_command_with_its_options():
    first, *sections = pages()["cli.md"].split("\n## ")[1:]
    common = first_names(first)
    for name, command in cli.commands.items():
        (section,) = (
            one for one in sections if name in one.partition("\n")[0].replace(",", "").split()
        )
        shared = re.findall(r"^(?:And|Options:) `.*", section, flags=re.MULTILINE)
        said = [*first_names(section), *(o for line in shared for o in spelled_out(line, common))]
        options = [each.opts[0] for each in command.params if each.opts[0].startswith("-")]
        assert sorted(said) == sorted(options)


def test_every_column_of_every_artifact():
    page = pages()["artifacts.md"]
    explained = page.partition("## Columns of many artifacts")[2].partition("\n## ")[0]
    common = [one for line in explained.splitlines() if line[:3] == "- `" for one in in_code(line)]
    for kind, schema in SCHEMAS.items():
        section = page.partition(f"### {kind}\n")[2].partition("\n#")[0]
        if "Columns as in" in section:
            earlier = section.split("(#")[1].split(")")[0]
            assert SCHEMAS[earlier].columns == schema.columns
            continue
        own = [one for line in section.splitlines() if line[:3] == "- `" for one in in_code(line)]
        (*shared,) = (line for line in section.splitlines() if line.startswith("And `"))
        names = [*own, *(one for line in shared for one in spelled_out(line, common))]
        assert sorted(names) == sorted(column.name for column in schema.columns)


def in_code(line: str) -> list[str]:
    return line.partition(" (")[0].split("`")[1::2]


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_page_of_a_fault_has_all_that_it_should(effect):
    page = pages()[f"faults/{effect.name}.md"]
    labels = re.findall(r"^- ([\w ]+): \S", page, flags=re.MULTILINE)
    assert labels == ["Looks like", "Usual size", "How sure", "To confirm"]
    assert EFFECT_WORDS[effect.name].title in page
    assert all(text in page for text in (effect.looks, usual_words(effect.name), effect.remedy))


def test_how_sure_is_what_the_suite_found():
    assert "How sure: named in 2 of 2; 5 of 5 intervals right." in pages()["faults/sync_offset.md"]
    assert "How sure: not known" in pages()["faults/implement.md"]


def test_every_fault_stands_under_what_follows_from_it():
    sections = pages()["faults/index.md"].split("\n## ")[1:]
    for effect in CATALOGUE:
        (section,) = (one for one in sections if f"({effect.name}.md)" in one)
        words = EFFECT_WORDS[effect.name]
        assert section.lower().startswith(words.family) and words.sentence in section


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
