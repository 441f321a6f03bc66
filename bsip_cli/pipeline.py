"""The stages in the order of the data: what each reads, what it writes, which options it sees."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # artifacts needs pandas, and `bsip --help` must not wait for it
    from bsip_cli.schemas import Level


@dataclass(frozen=True)
class Stage:
    """One stage at one level.

    ``reads`` and ``writes`` are kinds of artifacts. A trial stage that reads a participant's
    artifact gets its own participant's; a participant stage that reads a trial's gets those of
    all trials; a cohort stage reads everybody's. What is in ``reads_if_there`` counts as an input
    where it exists, and is not missed where it does not. ``options`` are names of configuration
    entries: only they enter the provenance. ``module`` holds a function ``run(unit)``. ``amends``
    are kinds of its own level that earlier stages write and to which it adds rows. ``part`` tells
    apart two steps of one name and level. ``reads_recordings``: these themselves are input.
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

    @property
    def label(self) -> str:
        return f"{self.name} ({', '.join(filter(None, (self.level, self.part)))})"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every kind that it may read."""
        return (*self.reads, *self.reads_if_there)


_SUMMARIES = {
    "ingest": "Read recordings: markers and ground wrench in SI units, gaps filled, "
    "contacts found.",
    "scale": "Build the person's skeleton: lengths, joint centres, markers on their segments.",
    "ik": "Joint coordinates, velocities and accelerations from the markers.",
    "regress": "Inertial parameters from an anthropometric table (RM).",
    "identify": "Inertial parameters that explain the measured ground forces (OM).",
    "reconstruct": "Ground wrench and centre of pressure from the motion, "
    "beside the measured ones.",
    "laboratory": "The faults of plates, clock and vertical, "
    "by all persons recorded there together.",
    "diagnose": "What the simulation gets wrong: its cause, how large, how sure.",
    "extend": "The model extended by what the diagnosis named, and what that gains.",
    "joints": "Net forces, moments and powers at the joints, with standard deviations.",
    "choose": "Which parameters to use, by the errors in movements that OM never saw.",
    "stats": "Tests and summaries over all participants.",
    "tables": "The papers' tables as CSV, Markdown and LaTeX.",
    "report": "An HTML report per participant and one for the cohort.",
}
_SCENE = "markers kinematics marker-events wrench plates skeleton marker-positions"


def _stage(place: str, reads_recordings: bool = False, **names: str) -> Stage:
    """A stage by ``name level module part``; names of kinds and options by spaces."""
    name, level, module, part = (*place.split(), "")[:4]
    lists: Any = {key: tuple(text.split()) for key, text in names.items()}
    made: Any = {"level": level, "part": part, "reads_recordings": reads_recordings} | lists
    return Stage(name, summary=_SUMMARIES[name], module="bsip_cli.stages." + module, **made)


STAGES = (
    _stage(
        "ingest participant survey session",
        writes="readings",
        options="ingest",
        reads_recordings=True,
    ),
    _stage(
        "ingest trial ingest",
        reads="readings",
        writes="markers wrench plates contacts quality",
        options="marker_set loads ingest",
        reads_recordings=True,
    ),
    _stage(
        "scale participant scale",
        reads="markers wrench",
        writes="skeleton marker-positions person",
        options="marker_set skeleton loads roles ingest scale ik",
    ),
    _stage(
        "ik trial ik",
        reads="markers skeleton marker-positions",
        writes="kinematics marker-residuals marker-events",
        options="skeleton ik smoothing",
    ),
    _stage(
        "regress participant regress",
        reads="skeleton marker-positions person",
        writes="regression",
        options="skeleton scale regress prior",
    ),
    _stage(
        "identify participant identify",
        reads="kinematics wrench skeleton marker-positions regression",
        writes="bsip covariance base-parameters excitation identification used-blocks",
        options="skeleton loads roles prior identify",
    ),
    _stage(
        "reconstruct trial reconstruct",
        reads="kinematics wrench plates skeleton marker-positions person bsip used-blocks",
        writes="reconstruction fit correlation-difference posturography",
        options="skeleton loads reconstruct",
    ),
    _stage(
        "laboratory participant laboratory_information",
        reads=f"{_SCENE} person regression identification",
        writes="laboratory-information",
        options="skeleton loads roles ik prior diagnosis reconstruct",
    ),
    _stage(
        "laboratory cohort laboratory",
        reads="laboratory-information",
        writes="laboratory laboratory-sums",
        options="diagnosis laboratory",
    ),
    _stage(
        "diagnose participant diagnose",
        reads=f"{_SCENE} person regression identification",
        reads_if_there="laboratory-information laboratory-sums laboratory",
        writes="overall-diagnosis overall-error-budget detection",
        options="skeleton loads roles ik prior diagnosis reconstruct",
    ),
    _stage(
        "diagnose trial diagnose_trial",
        reads="overall-diagnosis overall-error-budget",
        writes="diagnosis error-budget",
    ),
    _stage(
        "extend participant extend",
        reads=f"overall-diagnosis {_SCENE} regression bsip identification used-blocks",
        writes="extended-bsip bsip-change extended-skeleton",
        options="skeleton loads ik prior identify",
    ),
    _stage(
        "extend trial extend_trial",
        reads=f"overall-diagnosis {_SCENE} person bsip used-blocks extended-bsip",
        writes="gain corrected-wrench",
        amends="reconstruction fit",
        options="skeleton loads ik reconstruct",
    ),
    _stage(
        "extend participant extend_gain gain",
        reads="gain",
        writes="overall-gain",
    ),
    _stage(
        "joints trial joints",
        reads="markers kinematics marker-events wrench plates contacts skeleton marker-positions "
        "person bsip covariance identification overall-diagnosis extended-bsip",
        writes="joint-moments joint-peaks",
        options="skeleton loads ik joints",
    ),
    _stage(
        "choose participant choose",
        reads="identification used-blocks fit reconstruction",
        writes="choice",
        options="roles",
    ),
    _stage(
        "stats cohort stats",
        reads="bsip fit posturography correlation-difference",
        writes="values comparisons",
        options="roles stats",
    ),
    _stage(
        "tables cohort tables",
        reads="values comparisons",
        writes="tables-files",
        options="stats",
    ),
    _stage(
        "report participant report",
        reads="quality skeleton marker-positions person kinematics marker-residuals marker-events "
        "bsip excitation identification reconstruction fit",
        reads_if_there="overall-diagnosis overall-error-budget detection overall-gain bsip-change "
        "choice joint-moments joint-peaks",
        writes="report-files",
        options="skeleton loads roles",
    ),
    _stage(
        "report cohort group_report",
        reads="values comparisons person identification tables-files",
        reads_if_there="overall-diagnosis choice laboratory report-files",
        writes="group-report-files",
        options="stats",
    ),
)


FINDINGS = ("choose", "diagnose", "laboratory", "extend", "report")
"""Stages whose sentences are results; those of the others are remarks on the way."""


_SHORT_S = 0.1
_COSTS_S = {
    "ingest participant": 5.0,
    "ingest trial": 0.3,
    "scale participant": 5.0,
    "ik trial": 0.3,
    "identify participant": 1.7,
    "reconstruct trial": 0.2,
    "laboratory participant": 5.0,
    "laboratory cohort": 3.2,
    "diagnose participant": 6.0,  # per trial
    "joints trial": 0.4,
    "stats cohort": 2.3,
    "report participant": 5.0,
    "report cohort": 3.5,
}
"""About the geometric means of CPU seconds of fresh runs of a person of the sample, a child (gait),
squats and jumps (OpenCap) and golf swings, which weigh the units in the bar of a run: the time left
is right within a factor of two in each. All other units take next to no time."""


def cost_s(stage: str, level: str, trials: int) -> float:
    """About how long a unit, of a person with so many trials, takes compared with others [s]."""
    unit = f"{stage} {level}"
    return _COSTS_S.get(unit, _SHORT_S) * (trials if unit == "diagnose participant" else 1)


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
