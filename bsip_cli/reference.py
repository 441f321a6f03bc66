"""The reference pages in docs/, rendered from the code: commands, options, artifacts.

``python -m bsip_cli.reference docs`` writes them; a test fails where they differ from the code.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import click
from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic.fields import FieldInfo

from bsip_cli.cli import cli
from bsip_cli.commands.published import shown
from bsip_cli.config import Config, Section, shipped
from bsip_cli.pipeline import STAGES, Stage, producer
from bsip_cli.schemas import SCHEMAS, Level, Schema

REGENERATE = "python -m bsip_cli.reference docs"
_NOTE = f"<!-- Made by `{REGENERATE}`; change the code instead. -->"


def pages() -> dict[str, str]:
    """File name to Markdown of every page."""
    return {
        "cli.md": cli_page(),
        "options.md": options_page(),
        "artifacts.md": artifacts_page(),
        "published.md": published_page(),
    }


def write_pages(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (folder / name).write_text(text, encoding="utf-8")


# --- Markdown ---------------------------------------------------------------------------------


def _page(title: str, parts: Iterable[str]) -> str:
    return "\n\n".join([_NOTE, f"# {title}", *parts]) + "\n"


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [
        header,
        ["---"] * len(header),
        *([cell.replace("|", "\\|") for cell in r] for r in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _code(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


# --- commands ---------------------------------------------------------------------------------


def cli_page() -> str:
    """Every command; those with the same arguments share one table of them."""
    groups: dict[str, list[str]] = {}
    for name, command in cli.commands.items():
        groups.setdefault(_arguments(command), []).append(name)
    parts = [_paragraphs(cli)]
    for arguments, names in groups.items():
        usages = [f"bsip {name} {_usage(cli.commands[name])}" for name in names]
        meanings = [(f"`bsip {name}`", _in_a_cell(cli.commands[name])) for name in names]
        parts += [f"## {', '.join(names)}", "```\n" + "\n".join(usages) + "\n```"]
        parts += [_table(("command", "what it does"), meanings), *filter(None, [arguments])]
    return _page("The command line", parts)


def _paragraphs(command: click.Command) -> str:
    return "\n\n".join(" ".join(text.split()) for text in (command.help or "").split("\n\n"))


def _in_a_cell(command: click.Command) -> str:
    return _paragraphs(command).replace("\n\n", " ")


def _usage(command: click.Command) -> str:
    context = click.Context(command, info_name=command.name)
    return " ".join(command.collect_usage_pieces(context))


def _arguments(command: click.Command) -> str:
    options = [each for each in command.params if isinstance(each, click.Option)]
    rows = [(f"`{_spelling(option)}`", _default(option), option.help or "") for option in options]
    return _table(("option", "default", "meaning"), rows) if rows else ""


def _spelling(option: click.Option) -> str:
    names, kind = ", ".join(option.opts), option.type
    if option.is_flag:
        return names
    if isinstance(kind, click.Choice):
        return f"{names} {{{','.join(kind.choices)}}}"
    if isinstance(kind, click.IntRange | click.FloatRange):
        low, high = ("" if bound is None else f"{bound:g}" for bound in (kind.min, kind.max))
        return f"{names} {low}..{high}"
    return f"{names} {option.metavar or kind.name.upper()}"


def _default(option: click.Option) -> str:
    if option.required:
        return "required"
    return f"`{option.default}`" if option.show_default else ""


# --- published values -------------------------------------------------------------------------


def published_page() -> str:
    """The papers' tables, and what in them cannot be as printed."""
    about = (
        "Tables of the three papers that the method comes from, and what their own numbers "
        "contradict: differences of means against the middles of their intervals, t against the "
        "interval, p against t, F against means and standard deviations, Cohen's d against every "
        "usual definition, sums, marks, captions, units. Every printed number stands for all "
        "that round to it; a reading is given where one change alone makes the numbers agree. "
        "`bsip published audit` prints the same."
    )
    parts = [f"## What cannot be as printed\n\n{chr(10).join(shown('audit', None))}"]
    parts.append(f"## As printed\n\n{chr(10).join(shown('show', None))}")
    return _page("Published values", [about, *parts])


# --- options ----------------------------------------------------------------------------------


_SIGNS = ((Gt, "gt", ">"), (Ge, "ge", "≥"), (Lt, "lt", "<"), (Le, "le", "≤"))


@dataclass(frozen=True)
class OptionText:
    """One option as configs/default.toml has it."""

    section: str
    name: str
    default: str
    comment: str

    @property
    def unit(self) -> str:
        """What stands in square brackets in the comment."""
        found = re.search(r"\[([^\]]+)\]", self.comment)
        return found[1] if found else ""

    @property
    def meaning(self) -> str:
        return re.sub(r"\s*\[[^\]]+\]", "", self.comment, count=1)


def option_texts() -> tuple[OptionText, ...]:
    """The options in the order of configs/default.toml, each with the comment above it."""
    options, comment, section = [], [], ""
    for line in shipped("default.toml").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            comment.append(line[1:].strip())
            continue
        if line.startswith("["):
            section = line.strip("[]")
        elif "=" in line:
            name, value = (part.strip() for part in line.split("=", 1))
            options.append(OptionText(section, name, value, " ".join(comment)))
        comment = []
    return tuple(options)


def options_page() -> str:
    """Every option with its unit, default, limits and comment."""
    options = option_texts()
    parts = [
        "Options stand in the study's `study.toml`, or in a file given with `--config`; what a "
        "file does not name keeps its default. Names in `[brackets]` are sections of the file."
    ]
    for section in dict.fromkeys(option.section for option in options):
        rows = [_option_row(option) for option in options if option.section == section]
        names = [section] if section else [option.name for option in options if not option.section]
        readers = [stage.label for stage in STAGES if set(names) & set(stage.options)]
        parts += [f"## `[{section}]`" if section else "## At the top of the file"]
        parts += [f"Read by {', '.join(readers or ['the study layout'])}."]
        parts += [_table(("option", "default", "unit", "allowed", "meaning"), rows)]
    return _page("The options", parts)


def _option_row(option: OptionText) -> tuple[str, ...]:
    limits = _limits(field_of(option.section, option.name))
    return (f"`{option.name}`", f"`{option.default}`", option.unit, limits, option.meaning)


def field_of(section: str, name: str) -> FieldInfo:
    """The definition that checks an option."""
    model: type[Section] = Config
    if section:
        model = Config.model_fields[section].annotation  # type: ignore[assignment]
    return model.model_fields[name]


def _limits(field: FieldInfo) -> str:
    words = _choices(field.annotation)
    for rule in field.metadata:
        if isinstance(rule, MinLen):
            words.append(f"at least {rule.min_length}")
        for kind, attribute, sign in _SIGNS:
            if isinstance(rule, kind):
                words.append(f"{sign} {getattr(rule, attribute)}")
    return ", ".join(words)


def _choices(annotation: Any) -> list[str]:
    if get_origin(annotation) is Literal:
        return [" or ".join(f"`{value}`" for value in get_args(annotation))]
    return [choice for part in get_args(annotation) for choice in _choices(part)]


# --- artifacts --------------------------------------------------------------------------------

_PLACES: dict[Level, str] = {
    "trial": "OUT/sub-XX/sub-XX_task-TASK_run-N_{kind}.parquet",
    "participant": "OUT/sub-XX/sub-XX_{kind}.parquet",
    "cohort": "OUT/group/group_{kind}.parquet",
}


def artifacts_page() -> str:
    """Every stage with what it reads and writes, and every column of what is written."""
    parts = [
        "Parquet files, one table each. A column's unit, frame and meaning stand in the file too, "
        "and beside them, as JSON under the key `bsip`: the kind and version of the table, the "
        "stage and versions that made it, the SHA-256 of every input (of the group's artifacts one "
        'for each participant, over the lines "name hash" of all that was read), the options the '
        "stage read, its warnings. `*` in a column's name stands for a family of columns. Of a "
        "session's trial, names begin with sub-XX_ses-SES_task-TASK."
    ]
    for stage in STAGES:
        parts += _stage_parts(stage)
    written = {kind for stage in STAGES for kind in stage.writes}
    parts += ["## Beside them"]
    places = {"refusal": "OUT/sub-XX/…_refusal-STAGE.parquet"}
    for kind in [kind for kind in SCHEMAS if kind not in written]:
        place = places.get(kind) or _PLACES[SCHEMAS[kind].level].format(kind=kind)
        parts += _schema_parts(SCHEMAS[kind], place)
    return _page("The artifacts", parts)


def _stage_parts(stage: Stage) -> list[str]:
    reads = [f"[{kind}](#{kind}) ({producer(kind).name})" for kind in stage.reads]
    more = [f"[{kind}](#{kind}) ({producer(kind).name})" for kind in stage.reads_if_there]
    facts = [
        f"- reads: {', '.join(reads) or 'the recording'}",
        *([f"- reads where they are there: {', '.join(more)}"] if more else []),
        f"- writes: {', '.join(f'[{kind}](#{kind})' for kind in stage.writes)}",
        f"- options: {_code(stage.options)}",
    ]
    parts = [f"## Stage {stage.label}", stage.summary, "\n".join(facts)]
    for kind in stage.writes:
        parts += _schema_parts(
            SCHEMAS[kind], _PLACES[SCHEMAS[kind].level].format(kind=SCHEMAS[kind].file_name)
        )
    return parts


def _schema_parts(schema: Schema, place: str) -> list[str]:
    rows = [(f"`{c.name}`", c.type, c.unit, c.frame, c.meaning) for c in schema.columns]
    sentence = (
        f"{schema.meaning[0].upper()}{schema.meaning[1:]}. `{place}`, version {schema.version}."
    )
    return [
        f"### {schema.kind}",
        sentence,
        _table(("column", "type", "unit", "frame", "meaning"), rows),
    ]


if __name__ == "__main__":
    write_pages(Path(sys.argv[1] if len(sys.argv) > 1 else "docs"))
