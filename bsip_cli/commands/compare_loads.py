"""The command ``bsip compare-loads``: recordings with a known load against those without."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd

from bsip_cli.artifacts import held_alone, remove
from bsip_cli.body.inertia import PARAMETERS, UNITS, from_phi, readable_jacobian
from bsip_cli.body.person import Person
from bsip_cli.errors import BadDataError, BsipError, UsageError, printable
from bsip_cli.identification.difference import change_of_segments, difference
from bsip_cli.identification.prior import Prior
from bsip_cli.identification.problem import Problem
from bsip_cli.pipeline import READERS
from bsip_cli.report.tables.model import TEXTS, Column, Row, Table, to_markdown
from bsip_cli.report.words import listing, number, segment_label
from bsip_cli.running.runner import attempt
from bsip_cli.running.session import follow, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages import identification_problem
from bsip_cli.stages.frames import load_phi, loads_record, person_of
from bsip_cli.statistics.samples import Z95
from bsip_cli.study.study import Trial
from bsip_cli.study.trials import listed

_READER = READERS["compare-loads", ""]
_OPTIONS = ("--with", "--without")
_TEXTS = TEXTS["compare_loads"]
_Line = tuple[str | float, ...]
TWO, LOADED, ALL = "two identifications", "loaded segments", "all"


def compare_loads(
    study: Path, out: Path, participant: str, config_file: Path | None, heavy: str, plain: str
) -> int:
    """Compare one participant's recordings, print the tables and return the exit code.

    ``heavy`` and ``plain``: what --with and --without were given, tasks or names of recordings
    joined by commas; empty where the declared loads decide.
    """
    opened = open_study(study, out, (participant,), config_file)
    people = opened.study.participants
    units = [Unit(_READER, opened.study, out, opened.config, person) for person in people]
    running = (attempt(unit, partial(_compared, unit, (heavy, plain))) for unit in units)
    code = follow("compare-loads", opened.refusals, running, len(units), out)
    for unit in units if code == 0 else ():
        for table in _tables(unit):
            click.echo(to_markdown(table))
    return code


def _compared(unit: Unit, names: tuple[str, str]) -> tuple[()]:
    """Write the table; all that is said of it is a message of the unit."""
    try:
        with held_alone(unit.out / unit.name):
            _write(unit, _sets(unit, names))
    except BsipError:
        remove(unit.path("load-comparison"))  # an older one would pass for this one
        raise
    return ()


# --- which recordings -------------------------------------------------------------------------


def _sets(unit: Unit, names: tuple[str, str]) -> tuple[list[Trial], list[Trial]]:
    """Recordings with and without: those named, or of the others that move, by what they carry."""
    ready = unit.trials("kinematics", "wrench")
    moving = [trial for trial in ready if trial.role != "static"]
    named = [_named(unit, *each) for each in zip(_OPTIONS, names, strict=True)]
    free = [trial for trial in moving if trial not in named[0] + named[1]]
    heavy = named[0] or [trial for trial in free if unit.loads(trial)]
    plain = named[1] or [trial for trial in free if not unit.loads(trial)]
    for option, trials in zip(_OPTIONS, (heavy, plain), strict=True):
        _check_set(unit, option, trials, ready)
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
    return heavy, plain


def _named(unit: Unit, option: str, given: str) -> list[Trial]:
    trials, found = unit.person.trials, []
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


def _carried(unit: Unit, trial: Trial) -> list[dict[str, object]]:
    return sorted(loads_record(unit, trial), key=str)


# --- what is printed --------------------------------------------------------------------------


def _tables(unit: Unit) -> Iterator[Table]:
    rows, facts = unit.read("load-comparison"), unit.facts("load-comparison")
    path = unit.path("load-comparison")
    sets = " and ".join(f"{how} ({listed(facts[how])})" for how in ("with", "without"))
    loaded = rows[rows["analysis"] == LOADED]
    if len(loaded):
        may_be_none = (loaded["ci_low"] <= 0) & (loaded["ci_high"] >= 0)
        masses = loaded[(loaded["quantity"] == "m") & may_be_none]
        unsure = masses["segment"].map(segment_label)
        yield Table(
            LOADED,
            f"{unit.name}: what was added, if nothing else changed between recordings {sets}.",
            (*_FIRST, _DIFFERENCE, _DECLARED),
            tuple(map(_row, loaded.to_dict("records"))),
            (_TEXTS["difference"], *(_TEXTS["none"].format(segment=name) for name in unsure)),
        )
    masses = rows[(rows["analysis"] == TWO) & (rows["quantity"] == "m")]
    yield Table(
        TWO,
        f"{unit.name}: two identifications ({facts['estimator']}), all segments free.",
        (*_FIRST, _DIFFERENCE, _DECLARED, _EXPECTED),
        tuple(map(_row, masses.to_dict("records"))),
        (_TEXTS["expected"], f"First moments and tensors of all segments: {path}"),
    )


def _row(values: Mapping[Any, Any]) -> Row:
    unit, segment = values["unit"], values["segment"]
    factor, digits, unit = (1000.0, 0, "mm") if unit == "m" else (1.0, 3, unit)
    numbers = ("difference", "ci_low", "ci_high", "declared", "expected")
    cells = {name: number(factor * values[name], digits) for name in numbers}
    name = "whole body" if segment == ALL else segment_label(segment)
    return Row({"segment": name, "quantity": values["quantity"], "unit": unit, **cells})


_NAMES = ("segment", "quantity", "unit")
_FIRST = tuple(Column((name,), name.capitalize(), text=True) for name in _NAMES)
_DIFFERENCE = Column(("difference", "ci_low", "ci_high"), "Difference", "{} ({} to {})".format)
_DECLARED = Column(("declared",), "Declared")
_EXPECTED = Column(("expected",), "To be expected")


# --- what the parameters gain by the load ---------------------------------------------------------

_SHORTEST_S = 0.5


def _write(unit: Unit, sets: tuple[Sequence[Trial], Sequence[Trial]]) -> None:
    """Identify from the trials with and from those without, and write the table."""
    without_loads = unit.config_of_all.model_copy(update={"loads": ()})  # they stay in the forces
    loads_off = replace(unit, config=without_loads)  # what it says, the unit says
    person = person_of(unit)
    skeleton = person.skeleton
    declared = load_phi(unit, person, sets[0][0]) - load_phi(unit, person, sets[1][0])
    bodies = [k for k, own in enumerate(declared.reshape(-1, 10)) if own.any()]
    loaded = [skeleton.bodies[k] for k in bodies]
    unseen = [i for i in loaded if person.without_data()[i]]
    if unseen:
        raise BadDataError(
            f"a load lies on {_names(person, unseen)}, whose motion no markers show",
            file=unit.name,
            expected="a load on a segment with markers",
            remedy="record with markers there, or put the load on another segment",
        )
    prior = identification_problem.prior_from(unit, unit.read("regression"), person)
    heavy, plain = (_problem(loads_off, person, prior, trials) for trials in sets)
    estimator = unit.config.identify.estimators[0]
    a, b = (identification_problem.estimate_by(estimator, problem) for problem in (plain, heavy))
    change = difference(a, b, prior.root @ prior.root.T)
    one = _Block(TWO, change.phi, change.covariance, declared, change.resolution @ declared)
    rows = [one.total(), *one.rows(skeleton.body_names)]
    if any(skeleton.parents[i] in loaded for i in loaded):
        unit.say(
            f"loads on {_names(person, loaded)}, of which a joint connects some: the "
            "forces do not show how these share the mass, so there is only the difference of two "
            "identifications"
        )
    else:
        part = (10 * np.array(bodies)[:, None] + np.arange(10)).ravel()
        own = change_of_segments(plain, heavy, bodies)
        both = _Block(LOADED, own.phi, own.covariance, declared[part], declared[part])
        names = [skeleton.segments[i] for i in loaded]
        rows += [*both.rows(names), *both.centres(names, person.origin_in_joint_m[loaded])]
    stems = ([trial.stem for trial in trials] for trials in sets)
    facts = {**dict(zip(("with", "without"), stems, strict=True)), "estimator": estimator}
    table = pd.DataFrame(rows, columns=column_names("load-comparison"))
    unit.write("load-comparison", table, facts)


def _names(person: Person, segments: Sequence[int]) -> str:
    return listing([f"the {segment_label(person.skeleton.segments[i])}" for i in segments])


def _problem(unit: Unit, person: Person, prior: Prior, trials: Sequence[Trial]) -> Problem:
    recordings, _ = identification_problem.recordings_of(unit, person, trials)
    seconds = identification_problem.duration_s(recordings)
    if seconds < _SHORTEST_S:
        raise BadDataError(
            f"{listing([trial.stem for trial in trials])}: {seconds:.2f} s of motion with every "
            "contact on a plate",
            file=unit.name,
            expected=f"at least {_SHORTEST_S:g} s",
            remedy="name other trials with --with and --without",
        )
    problem, _ = identification_problem.problem_of(unit, person, prior, recordings)
    return problem


@dataclass(frozen=True, eq=False)
class _Block:
    """Changes (10 k,) of k segments with covariance, against what is declared and to be
    expected."""

    analysis: str
    phi: np.ndarray
    covariance: np.ndarray
    declared: np.ndarray
    expected: np.ndarray

    def _row(
        self, of: tuple[str, str, str], value: float, variance: float, declared: float, other: float
    ) -> _Line:
        half = Z95 * np.sqrt(variance)
        return self.analysis, *of, value, value - half, value + half, declared, other

    def rows(self, segments: Sequence[str]) -> Iterator[_Line]:
        """Ten of each segment."""
        numbers = (self.phi, np.diag(self.covariance), self.declared, self.expected)
        for k, known in enumerate(zip(*numbers, strict=True)):
            yield self._row((segments[k // 10], PARAMETERS[k % 10], UNITS[k % 10]), *known)

    def total(self) -> _Line:
        """The masses' sum."""
        known = float(self.declared[::10].sum()), float(self.expected[::10].sum())
        spread = self.covariance[::10, ::10].sum()
        return self._row((ALL, "m", "kg"), float(self.phi[::10].sum()), spread, *known)

    def centres(self, segments: Sequence[str], origins_m: np.ndarray) -> Iterator[_Line]:
        """Three of each segment; none of one whose mass may be zero (95 %), which has no centre."""
        for k, segment in enumerate(segments):
            own = slice(10 * k, 10 * k + 10)
            phi, covariance, declared = self.phi[own], self.covariance[own, own], self.declared[own]
            if abs(phi[0]) <= Z95 * np.sqrt(covariance[0, 0]) or declared[0] == 0:
                continue
            jacobian = readable_jacobian(phi)[1:4]
            spread = np.diag(jacobian @ covariance @ jacobian.T)
            found, known = (from_phi(x).com_m - origins_m[k] for x in (phi, declared))
            for j, quantity in enumerate(("cx", "cy", "cz")):
                yield self._row((segment, quantity, "m"), found[j], spread[j], known[j], known[j])
