"""The stages in the order of the data: what each reads, what it writes, which options it sees."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import groupby
from typing import TYPE_CHECKING, Any, cast

from bsip_cli.files.regular import read_toml, shipped

if TYPE_CHECKING:  # artifacts needs pandas, and `bsip --help` must not wait for it
    from bsip_cli.schemas import Level

_SHORT_S = 0.1  # of a unit that takes next to no time


@dataclass(frozen=True)
class Stage:
    """One stage at one level.

    ``reads`` and ``writes`` are kinds of artifacts. A trial stage that reads a participant's
    artifact gets its own participant's; a participant stage that reads a trial's gets those of
    all trials; a cohort stage reads everybody's. What is in ``reads_if_there`` counts as an input
    where it exists, and is not missed where it does not. ``options`` are names of configuration
    entries: only they enter the provenance. ``module`` holds the ``function`` of a unit that does
    it. ``amends`` are kinds of its own level that earlier stages write and to which it adds rows.
    ``part`` distinguishes two steps of one name and level. ``reads_recordings``: these are
    input. ``costs_s``: of a unit among others.
    """

    name: str
    level: Level
    summary: str
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    module: str = ""
    reads_if_there: tuple[str, ...] = ()
    amends: tuple[str, ...] = ()
    part: str = ""
    reads_recordings: bool = False
    costs_s: float = _SHORT_S
    function: str = "run"

    @property
    def label(self) -> str:
        return f"{self.name} ({', '.join(filter(None, (self.level, self.part)))})"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every kind that it may read."""
        return (*self.reads, *self.reads_if_there)

    def run(self, unit: Any) -> None:
        """Do it for one unit; only now its imports come."""
        getattr(import_module(self.module), self.function)(unit)


_TABLE = read_toml(shipped("stages.toml"))


def _stage(package: str, *, step: str, does: str = "", **said: Any) -> Stage:
    """An entry of the table, which says what they mean; its module is in that package."""
    name, level, part = (*step.split(), "")[:3]
    module, function = (*does.split(), "", "")[:2]
    said = {
        key: tuple(x.replace("@scene", _TABLE["scene"]).split()) if isinstance(x, str) else x
        for key, x in said.items()
    }
    # joined: `code_hash` takes a text of it for an import of all that may stand there
    of_code = ".".join(("bsip_cli", package, module))
    said |= {"module": of_code, "function": function, "part": part}
    return Stage(name, cast("Level", level), _TABLE["summaries"].get(name, ""), **said)


STAGES = tuple(_stage("stages", **row) for row in _TABLE["stages"])
READERS = {(s.name, s.part): s for s in (_stage("commands", **row) for row in _TABLE["readers"])}
"""Commands that read as a stage does, by name and part."""

FINDINGS = ("choose", "diagnose", "laboratory", "extend", "report")
"""Stages whose sentences are results; those of the others are remarks on the way."""


def cost_s(stage: str, level: str, trials: int) -> float:
    """About how long a unit, of a person with so many trials, takes compared with others [s]."""
    unit = f"{stage} {level}"
    costs = (s.costs_s for s in STAGES if (s.name, s.level) == (stage, level))
    return max(costs, default=_SHORT_S) * (trials if unit == "diagnose participant" else 1)


def stages_named(name: str) -> tuple[Stage, ...]:
    """The stages behind one command, in order; ``run`` is all of them."""
    return STAGES if name == "run" else tuple(s for s in STAGES if s.name == name)


def by_level(stages: Iterable[Stage]) -> tuple[tuple[Stage, ...], tuple[Stage, ...]]:
    """Those about one participant or trial, and those about all."""
    stages = tuple(stages)
    of_all = tuple(stage for stage in stages if stage.level == "cohort")
    return tuple(stage for stage in stages if stage not in of_all), of_all


def in_turn(stages: Iterable[Stage]) -> Iterator[tuple[Stage, ...]]:
    """Stages of each participant, then those of all, and so on: what all show serves each."""
    for _, same in groupby(stages, key=lambda stage: stage.level == "cohort"):
        yield tuple(same)


def producer(kind: str) -> Stage:
    """The stage that writes a kind of artifact."""
    return next(stage for stage in STAGES if kind in stage.writes)


def upstream(
    stages: Iterable[Stage], kinds_of: Callable[[Stage], Iterable[str]]
) -> tuple[Stage, ...]:
    """Stages and all that make what they build on, which is kinds of artifacts, in order."""
    found: set[str] = set()
    waiting = [*stages]
    while waiting:
        stage = waiting.pop()
        if stage.label not in found:
            found.add(stage.label)
            waiting += map(producer, kinds_of(stage))
    return tuple(stage for stage in STAGES if stage.label in found)
