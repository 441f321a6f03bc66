"""The reference pages in docs/, rendered from the code: commands, options, artifacts, faults.

``python -m bsip_cli.reference docs`` writes them; a test fails where they differ from the code.
"""

from __future__ import annotations

import csv
import re
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import click

from bsip_cli.cli import cli
from bsip_cli.config import Config
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.effect import Effect
from bsip_cli.files.regular import shipped
from bsip_cli.pipeline import STAGES, Stage
from bsip_cli.report.causes import EFFECT_WORDS, usual_words
from bsip_cli.schemas import SCHEMAS, Column, Schema

REGENERATE = "python -m bsip_cli.reference docs"
_COMMON = 3  # places that have the same column or option: it is explained once
_NOTE = "<!-- From bsip_cli/reference.py -->"


def pages() -> dict[str, str]:
    """File name to Markdown of every page."""
    return {
        "cli.md": cli_page(),
        "options.md": options_page(),
        "artifacts.md": artifacts_page(),
        "faults/index.md": faults_page(),
        **{f"faults/{effect.name}.md": fault_page(effect) for effect in CATALOGUE},
    }


def write_pages(folder: Path) -> None:
    """Into the folder, over those of before."""
    for name, text in pages().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


# --- Markdown ---------------------------------------------------------------------------------


def _page(title: str, parts: Iterable[str]) -> str:
    return "\n\n".join([_NOTE, f"# {title}", *parts]) + "\n"


def _code(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _runs(names: Sequence[str], order: Sequence[str]) -> str:
    """Names in their order; neighbours in both are given by the first and the last."""
    runs: list[list[str]] = []
    for name in names:
        follows = runs and order.index(name) == order.index(runs[-1][-1]) + 1
        runs = [*runs[:-1], [*runs[-1], name]] if follows else [*runs, [name]]
    return ", ".join(
        f"`{run[0]}` to `{run[-1]}`" if len(run) >= _COMMON else _code(run) for run in runs
    )


# --- commands ---------------------------------------------------------------------------------


def cli_page() -> str:
    """Every command with its own options; those of several are explained once."""
    lines = {
        name: [_explained(one) for one in command.params if isinstance(one, click.Option)]
        for name, command in cli.commands.items()
    }
    seen = Counter(line for each in lines.values() for line in each)
    common = [line for line, n in seen.items() if n > 1]
    parts = [_paragraphs(cli), "## Options of several commands", "\n".join(common)]
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, command in cli.commands.items():
        usage = " ".join(command.collect_usage_pieces(click.Context(command, info_name=name)))
        groups.setdefault((usage, *lines[name]), []).append(name)
    for (pieces, *options), names in groups.items():
        own = [line for line in options if line not in common]
        shared = [_name(line) for line in options if line in common]
        said_of = {name: _paragraphs(cli.commands[name]) for name in names}
        alone = said_of[names[0]] if len(names) == 1 else ""
        meaning = alone or "\n".join(f"- {name}: {text}" for name, text in said_of.items())
        parts += [f"## {', '.join(names)} {pieces.replace('[OPTIONS] ', '')}", meaning]
        parts += ["Options:"] if own and len(names) > 1 else []
        parts += ["\n".join(own)] if own else []
        said = f"{'And' if own else 'Options:'} {_runs(shared, [_name(line) for line in common])}."
        parts += [said] if shared else []
    return _page("The command line", parts)


def _name(line: str) -> str:
    return line.split("`")[1].split()[0].rstrip(",")


def _paragraphs(command: click.Command) -> str:
    return "\n\n".join(" ".join(text.split()) for text in (command.help or "").split("\n\n"))


def _explained(option: click.Option) -> str:
    """How it is spelt, what it means, and what is so without it."""
    kind, taken = option.type, ""
    if isinstance(kind, click.Choice):
        taken = f" {{{','.join(kind.choices)}}}"
    elif isinstance(kind, click.IntRange | click.FloatRange):
        low, high = ("" if bound is None else f"{bound:g}" for bound in (kind.min, kind.max))
        taken = f" {low}..{high}"
    elif not option.is_flag:
        taken = f" {option.metavar or kind.name.upper()}"
    default = f" Without it `{option.default}`." if option.show_default else ""
    without = " Required." if option.required else default
    return f"- `{', '.join(option.opts)}{taken}`: {option.help or ''}{without}"


# --- faults -----------------------------------------------------------------------------------

_RESULTS = Path(__file__).parents[1] / "docs" / "results"


def faults_page() -> str:
    """The faults by what follows from them, with what to do."""
    parts = [
        "What `bsip diagnose` can name, and what follows for the results. How sure: the [blind "
        "suite](../results.md#is-the-right-fault-named) hid most of them twice; named in 2 of 2 "
        "may still mean 34 %. Other answers: [how to read the report](../report.md)."
    ]
    families: dict[tuple[str, str], list[str]] = {}
    for effect in CATALOGUE:
        words = EFFECT_WORDS[effect.name]
        own = families.setdefault((words.family, words.sentence), [])
        own.append(f"- [{words.title}]({effect.name}.md)")
    for (family, sentence), lines in families.items():
        parts += [f"## {family.capitalize()}", sentence, "\n".join(lines)]
    return _page("The faults", parts)


def fault_page(effect: Effect) -> str:
    """What a fault is, how it shows, how large laboratories meet it, how sure bsip is, what to
    record."""
    words = EFFECT_WORDS[effect.name]
    lines = [
        f"- Looks like: {effect.looks}.",
        f"- Usual size: {usual_words(effect.name)}.",
        f"- How sure: {_found(effect.name)}.",
        f"- To confirm: {effect.remedy}.",
        f"- [What follows](index.md#{words.family})",
    ]
    what = " ".join((type(effect).__doc__ or "").split("\n\n")[0].split())
    return _page(f"{effect.name}: {words.title}", [what, "\n".join(lines)])


def _found(effect: str) -> str:
    """Of the blind suite's tables: cases, names, and intervals that hold the truth."""
    with (_RESULTS / "blind_effects.csv").open(encoding="utf-8", newline="") as file:
        row = {one["hidden"]: one for one in csv.DictReader(file)}.get(effect)
    if row is None:
        return "not known, never hidden in the suite"
    named, group = int(row["right name"]), int(row["right class"])
    said = f"named in {named} of {row['cases']}"
    said += f", in a group in {group}" if group else ""
    said += f", corrected before in {row['corrected']}" if row["corrected"] != "0" else ""
    with (_RESULTS / "blind_estimates.csv").open(encoding="utf-8", newline="") as file:
        held = [one["95 % CI holds it"] for one in csv.DictReader(file) if one["effect"] == effect]
    counts = [tuple(map(int, text.split(" of "))) for text in held]
    inside, intervals = (sum(column) for column in zip(*counts, strict=True)) if counts else (0, 0)
    return f"{said}; {inside} of {intervals} intervals right" if intervals else said


# --- options ----------------------------------------------------------------------------------


_LIMITS = {"minItems": "at least", "exclusiveMinimum": ">", "minimum": "≥"}
_LIMITS |= {"exclusiveMaximum": "<", "maximum": "≤"}


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
        lines = []
        for option in (one for one in options if one.section == section):
            limits = _limits(section, option.name)
            unit = option.unit.removeprefix("1")
            value = f"`{option.default}` {unit}".strip() + f" ({limits})" * bool(limits)
            lines.append(f"- `{option.name}` = {value}: {option.meaning}")
        names = [section] if section else [option.name for option in options if not option.section]
        readers = dict.fromkeys(s.name for s in STAGES if set(names) & set(s.options))
        parts += [f"## `[{section}]`" if section else "## At the top of the file"]
        parts += [f"Read by {', '.join(readers or ['the study layout'])}.", "\n".join(lines)]
    return _page("The options", parts)


def schema_of(section: str) -> dict[str, Any]:
    """The JSON schema of a section, or of the file."""
    whole = Config.model_json_schema()
    return whole["$defs"][section.capitalize()] if section else whole


def _limits(section: str, name: str) -> str:
    known = schema_of(section)["properties"][name]
    choices = known.get("items", known).get("enum", ())
    words = [" or ".join(f"`{value}`" for value in choices)] if choices else []
    return ", ".join([*words, *(f"{x} {known[key]}" for key, x in _LIMITS.items() if key in known)])


# --- artifacts --------------------------------------------------------------------------------


def artifacts_page() -> str:
    """Every stage with what it reads and writes, and every column of what is written."""
    seen = Counter(column for schema in SCHEMAS.values() for column in schema.columns)
    common = tuple(column for column, n in seen.items() if n >= _COMMON)
    written = {kind for stage in STAGES for kind in stage.writes}
    parts = [
        "Parquet files, one table each: OUT/sub-XX/sub-XX_KIND.parquet of a participant, "
        "sub-XX_ses-SES_task-TASK_run-N_KIND.parquet of a trial (ses- only with sessions), "
        "OUT/group/group_KIND.parquet of the cohort; KIND is the heading, where nothing else is "
        "given. A column's unit, frame and meaning stand in the file too, and as JSON under the "
        "key `bsip` what made it: kind, version, stage, versions of the libraries, SHA-256 of "
        "every input, options, warnings. `bsip info FILE` prints both. `*`: a family of columns.",
        "## Columns of many artifacts",
        "Where a table below ends with some of these, it has them too.",
        _columns(common),
    ]
    shown: dict[tuple[Column, ...], str] = {}
    for stage in STAGES:
        is_new = stage.summary not in parts
        parts += [f"## {stage.label}", *[stage.summary] * is_new, _facts(stage)]
        for kind in stage.writes:
            parts += _schema_parts(SCHEMAS[kind], SCHEMAS[kind].file, common, shown)
    parts += ["## Made by no stage"]
    for kind in [kind for kind in SCHEMAS if kind not in written]:
        file = "refusal-STAGE" if kind == "refusal" else SCHEMAS[kind].file
        parts += _schema_parts(SCHEMAS[kind], file, common, shown)
    return _page("The artifacts", parts)


def _facts(stage: Stage) -> str:
    facts = [("Reads", _links(stage.reads) or "the recording")]
    if stage.reads_if_there:
        facts.append(("if there", _links(stage.reads_if_there)))
    return "; ".join(f"{name}: {what}" for name, what in facts) + "."


def _links(kinds: Sequence[str]) -> str:
    return ", ".join(f"[{kind}](#{kind})" for kind in kinds)


def _schema_parts(
    schema: Schema, file: str, common: Sequence[Column], shown: dict[tuple[Column, ...], str]
) -> list[str]:
    """Heading, the file's KIND if it is another one, and columns; those that an earlier artifact
    has are not repeated."""
    sentence = f"{schema.meaning[0].upper()}{schema.meaning[1:]}."
    parts = [f"### {schema.kind}", f"{sentence} KIND is `{file}`." if file else sentence]
    if schema.columns in shown:
        earlier = shown[schema.columns]
        return [*parts, f"Columns as in [{earlier}](#{earlier})."]
    shown[schema.columns] = schema.kind
    own = [column for column in schema.columns if column not in common]
    shared = [column.name for column in schema.columns if column in common]
    parts += [_columns(own)] if own else []
    return [*parts, *([f"And {_runs(shared, [one.name for one in common])}."] if shared else [])]


def _columns(columns: Iterable[Column]) -> str:
    """A line per column; neighbours of one meaning share one."""
    lines = []
    for same, group in groupby(columns, key=lambda c: (c.type, c.frame, c.meaning)):
        kind, frame, meaning = same
        alike = tuple(group)
        units = " or ".join(dict.fromkeys(column.unit for column in alike))
        number = units if kind == "float" else f"{kind} {units}".removesuffix(" 1").strip()
        of = ", ".join(filter(None, [number, frame]))
        lines.append(f"- {_code(column.name for column in alike)} ({of}): {meaning}")
    return "\n".join(lines)


if __name__ == "__main__":
    write_pages(Path(sys.argv[1] if len(sys.argv) > 1 else "docs"))
