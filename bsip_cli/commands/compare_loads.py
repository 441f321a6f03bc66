"""The command ``bsip compare-loads``: recordings with a known load against those without."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import click
import pandas as pd

from bsip_cli.artifacts import remove
from bsip_cli.errors import BadDataError, BsipError, UsageError, printable
from bsip_cli.pipeline import Stage
from bsip_cli.report.tables.formats import to_markdown
from bsip_cli.report.tables.model import Column, Row, Table
from bsip_cli.report.words import number, segment_label
from bsip_cli.running.runner import Outcome, held_alone, lacking
from bsip_cli.running.session import follow, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import loads_record
from bsip_cli.stages.load_comparison import ALL, LOADED, TWO, compared
from bsip_cli.study.study import Trial
from bsip_cli.study.trials import listed

# Not a stage of the pipeline, but it reads and writes as one.
_READER = Stage(
    "compare-loads",
    "participant",
    "Recordings with a known load against those without.",
    reads=("wrench", "skeleton", "marker-positions", "kinematics", "regression"),
    writes=("load-comparison",),
    options=("skeleton", "loads", "roles", "prior", "identify"),
    module="bsip_cli.stages.load_comparison",
)
_OPTIONS = ("--with", "--without")


def compare_loads(
    root: Path, out: Path, participant: str, config_file: Path | None, names: tuple[str, str]
) -> int:
    """Compare one participant's recordings, print the tables and return the exit code.

    ``names``: what --with and --without were given, tasks or names of recordings joined by commas;
    empty where the declared loads decide.
    """
    opened = open_study(root, out, (participant,), config_file)
    people = opened.study.participants
    units = [Unit(_READER, opened.study, out, opened.config, person) for person in people]
    code = follow("compare-loads", opened.refusals, _compare(units, names), len(units), out)
    for unit in units if code == 0 else ():
        for table in _tables(unit):
            click.echo(to_markdown(table))
    return code


def _compare(units: list[Unit], names: tuple[str, str]) -> Generator[Outcome, None, None]:
    for unit in units:
        waiting = lacking(unit)
        if waiting is not None:
            yield replace(waiting, exit_code=waiting.exit_code or BadDataError.exit_code)
            continue
        without_loads = unit.config_of_all.model_copy(update={"loads": ()})
        loads_off = Unit(_READER, unit.study, unit.out, without_loads, unit.participant)
        loads_off.messages = unit.messages  # what is said of its recordings is said of both
        try:
            with held_alone(unit.out / unit.name):
                compared(unit, loads_off, _sets(unit, names))
        except BsipError as error:
            remove(unit.path("load-comparison"))  # an older one would pass for this one
            unit.warn(str(error))
            said = tuple(unit.messages)
            yield Outcome(_READER.name, unit.name, "refused", said, error.exit_code)
        else:
            yield Outcome(_READER.name, unit.name, "done", tuple(unit.messages))


# --- which recordings -------------------------------------------------------------------------


def _sets(unit: Unit, names: tuple[str, str]) -> tuple[list[Trial], list[Trial]]:
    """The recordings with and without: those named, or of the others that move, by what they carry.

    Raises
    ------
    UsageError
        No load is declared that tells them apart, a name fits no recording or both sets, or the
        recordings of one set carry different loads.
    """
    ready = unit.trials("kinematics", "wrench")
    moving = [trial for trial in ready if trial.role != "static"]
    named = [_named(unit, *each) for each in zip(_OPTIONS, names, strict=True)]
    free = [trial for trial in moving if trial not in named[0] + named[1]]
    heavy = named[0] or [trial for trial in free if unit.loads(trial)]
    plain = named[1] or [trial for trial in free if not unit.loads(trial)]
    for option, trials in zip(_OPTIONS, (heavy, plain), strict=True):
        _check_set(unit, option, trials, ready)
    _check_apart(unit, heavy, plain)
    return heavy, plain


def _named(unit: Unit, option: str, given: str) -> list[Trial]:
    """The recordings of these tasks, or of these names: squat, or squat_run-2."""
    assert unit.participant is not None
    trials, found = unit.participant.trials, []
    for name in given.split(",") if given else ():
        fits = [t for t in trials if name in (t.task, t.stem, t.stem.split("_task-")[1])]
        if not fits:
            raise UsageError(
                f"{option}: there is no {printable(name)}",
                file=unit.name,
                expected=f"some of {', '.join(dict.fromkeys(t.task for t in trials))}, or a "
                "recording as in squat_run-2",
                remedy=f"name recordings of {unit.name}",
            )
        found += [trial for trial in fits if trial not in found]
    return found


def _check_set(unit: Unit, option: str, trials: list[Trial], ready: Sequence[Trial]) -> None:
    """There are recordings, all with motion and forces, and all carry the same."""
    if not trials:
        raise UsageError(
            f"no recording {option.removeprefix('--')} a declared load has motion and forces",
            file=unit.name,
            expected="[[loads]] in study.toml, and recordings with and without them",
            remedy=f"declare the load there, or name recordings with {option}",
        )
    gone = [trial.stem for trial in trials if trial not in ready]
    if gone:
        raise UsageError(
            f"{listed(gone)}: no motion or forces, or refused",
            file=unit.name,
            expected="results of `bsip ingest`, `scale` and `ik`",
            remedy="run them first and read what they say, or name other recordings",
        )
    other = [trial for trial in trials if _carried(unit, trial) != _carried(unit, trials[0])]
    if other:
        raise UsageError(
            f"{trials[0].stem} and {other[0].stem} do not carry the same declared loads",
            file=unit.name,
            expected="the same in all recordings of a set",
            remedy=f"name those of one load with {option}",
        )


def _check_apart(unit: Unit, heavy: list[Trial], plain: list[Trial]) -> None:
    """No recording is in both sets, and a declared load tells them apart."""
    twice = [trial.stem for trial in heavy if trial in plain]
    if twice:
        raise UsageError(
            f"{listed(twice)} in --with and in --without",
            file=unit.name,
            expected="every recording in one of them",
            remedy="name recordings as in squat_run-2 where a task has both",
        )
    if _carried(unit, heavy[0]) == _carried(unit, plain[0]):
        raise UsageError(
            f"{heavy[0].stem} and {plain[0].stem} carry the same declared load, or none",
            file=unit.name,
            expected="a load in [[loads]] of study.toml that is carried in one set only",
            remedy="declare it, with `tasks` or `runs` of the recordings that carry it",
        )


def _carried(unit: Unit, trial: Trial) -> list[dict]:
    """Segment, mass and position of each load, in any order."""
    return sorted(loads_record(unit, trial), key=str)


# --- what is printed --------------------------------------------------------------------------


def _tables(unit: Unit) -> Iterator[Table]:
    rows, facts = unit.read("load-comparison"), unit.facts("load-comparison")
    sets = " and ".join(f"{how} ({listed(facts[how])})" for how in ("with", "without"))
    loaded = rows[rows["analysis"] == LOADED]
    if len(loaded):
        yield Table(
            LOADED,
            f"{unit.name}: what was added, if nothing else changed between recordings {sets}.",
            (*_FIRST, _DIFFERENCE, _DECLARED),
            tuple(map(_row, loaded.to_dict("records"))),
            (
                "Difference: with less without, and its 95 % interval. m: mass; mc: first moment "
                "and I: inertia about the segment's joint; c: centre of what was added, from the "
                "segment's origin, in the segment's frame (X anterior, Y up, Z right).",
                *_not_shown(loaded),
            ),
        )
    masses = rows[(rows["analysis"] == TWO) & (rows["quantity"] == "m")]
    yield Table(
        TWO,
        f"{unit.name}: two identifications ({facts['estimator']}), all segments free.",
        (*_FIRST, _DIFFERENCE, _DECLARED, _EXPECTED),
        tuple(map(_row, masses.to_dict("records"))),
        (
            "To be expected: the forces hardly show how segments that a joint connects share a "
            "mass; so much of the declared load should be found, within the interval.",
            f"First moments and tensors of all segments: {unit.path('load-comparison')}",
        ),
    )


def _not_shown(loaded: pd.DataFrame) -> Iterator[str]:
    """Where a load cannot be told from none."""
    masses = loaded[loaded["quantity"] == "m"]
    none = masses[(masses["ci_low"] <= 0) & (masses["ci_high"] >= 0)]
    for segment in none["segment"]:
        yield (
            f"On the {segment_label(segment)} these recordings show no load: the mass may be zero. "
            "Longer ones that move the segment more have narrower intervals."
        )


def _row(values: dict) -> Row:
    digits = 0 if values["unit"] == "m" else _DIGITS
    factor = 1000.0 if values["unit"] == "m" else 1.0
    numbers = ("difference", "ci_low", "ci_high", "declared", "expected")
    cells = {name: number(factor * values[name], digits) for name in numbers}
    unit = "mm" if values["unit"] == "m" else values["unit"]
    segment = values["segment"]
    name = "whole body" if segment == ALL else segment_label(segment)
    return Row({"segment": name, "quantity": values["quantity"], "unit": unit, **cells})


_DIGITS = 3
_FIRST = (
    Column(("segment",), "Segment", text=True),
    Column(("quantity",), "Quantity", text=True),
    Column(("unit",), "Unit", text=True),
)
_DIFFERENCE = Column(("difference", "ci_low", "ci_high"), "Difference", "{} ({} to {})".format)
_DECLARED = Column(("declared",), "Declared")
_EXPECTED = Column(("expected",), "To be expected")
