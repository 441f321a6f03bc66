"""All that the cohort's report reads, and the causes that several people share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from bsip_cli.effects.effect import Number, digits_of, readable_unit, with_unit
from bsip_cli.report.blocks import Light
from bsip_cli.report.causes import Candidate, Cause, candidates_of, causes_of
from bsip_cli.report.errors import MARKERS
from bsip_cli.report.records import HowMade, Refusal
from bsip_cli.report.words import COMPONENTS, TEXTS, listing, number, say, task_of
from bsip_cli.statistics.methods import ALTERNATIVES, METHODS, OM, RM
from bsip_cli.statistics.samples import p_of_one_size

if TYPE_CHECKING:
    from bsip_cli.report.tables.model import Table

SHOWN = {
    "person": ("calibration_trial", "sex", "mass_kg", "plate_mass_kg", "height_m", "marker_rms_m"),
    "identification": ("duration_s", "condition_number", "decided"),
}
"""Columns of a participant's artifacts that are shown."""

ReadValues = Callable[[str, str], pd.DataFrame]  # table and variable to their rows of ``values``


@dataclass(frozen=True, eq=False)
class Ratios:
    """Mean errors of the participants, of whom those of OM and RM are known and not zero.

    of_component : per component of which there is any, a table with a row per participant (the same
    in all) and a column per method; held_out : over held-out data, or, where nobody has any, over
    all.
    """

    of_component: dict[str, pd.DataFrame]
    held_out: bool

    def over_rm(self, component: str, method: str) -> np.ndarray:
        """(p,) of a method over RM's, NaN where not known."""
        errors = self.of_component[component]
        return (errors[method] / errors[RM]).to_numpy()

    def over_best_other(self, component: str) -> np.ndarray:
        """(p,) of OM over those of the better of RM and RM+mass."""
        errors = self.of_component[component]
        return (errors[OM] / errors[list(ALTERNATIVES)].min(axis="columns")).to_numpy()


def ratios_of(read: ReadValues) -> Ratios:
    """Participants in the order of their ids, each with a ratio in some component."""
    for held_out in (True, False):
        found = {name: _mean_errors(read, name, held_out) for name in COMPONENTS}
        known = {name: errors for name, errors in found.items() if len(errors)}
        people = sorted(set().union(*(errors.index for errors in known.values())))
        if people:
            return Ratios({name: one.reindex(people) for name, one in known.items()}, held_out)
    return Ratios({}, held_out=False)


def _mean_errors(read: ReadValues, component: str, held_out: bool) -> pd.DataFrame:
    """A row per participant with errors of OM and RM: means over the runs with all methods."""
    rows = pd.concat([read("table4", component), read("table5", f"{component}_rmse")])
    if held_out:
        rows = rows[rows["data"] == "held_out"]
    wide = rows.pivot(index=["participant", "trial"], columns="method", values="value")
    known = [method for method in METHODS if method in wide]
    means = wide[known].dropna().groupby(level="participant").mean().reindex(columns=METHODS)
    return means[(means[[OM, RM]] > 0.0).all(axis="columns")]


@dataclass(frozen=True)
class Member:
    """One participant of the study; what is shown of person and identification, what a
    diagnosis found, and of the person's page, if there, which parameters to use, the errors with
    them and the light."""

    id: str
    facts: Mapping[str, Any] | None
    identification: Mapping[str, Any] | None
    has_report: bool
    refusals: tuple[Refusal, ...]
    searched: Searched | None = None
    use: str = ""
    errors: Mapping[str, float] | None = None
    light: Light | None = None

    def yardstick(self, name: str) -> float:
        """In the unit of the yardstick; NaN where it is not known."""
        if name == MARKERS:
            return np.nan if self.facts is None else 1e3 * float(self.facts["marker_rms_m"])
        return (self.errors or {}).get(name, np.nan)

    def link(self) -> str:
        return f"../{self.id}/report.html" if self.has_report else ""


@dataclass(frozen=True, eq=False)
class CohortRecord:
    """Attributes: ``ratios`` of the errors of the methods; ``missing`` sentences on who is in no
    table; ``table_files`` relative to OUT; ``defaults`` every option's shipped value; ``laboratory``
    the table of that kind, if there."""

    members: tuple[Member, ...]
    ratios: Ratios
    tables: tuple[Table, ...]
    table_files: tuple[str, ...]
    missing: tuple[str, ...]
    made: HowMade
    defaults: Mapping[str, Any]
    laboratory: pd.DataFrame | None = None


# --- causes that several people's recordings share ------------------------------------------------

SHARED = TEXTS["shared_causes"]
_MOST_NAMED = 12  # participants in one sentence
_MOST_SAID = 8  # causes
_DIFFER = 0.05  # p-value from which on sizes may be the same


@dataclass(frozen=True)
class Searched:
    """What was found of one participant; stems of the ``trials`` that were searched, and whether
    anything can be said at all."""

    id: str
    causes: tuple[Cause, ...]
    trials: tuple[str, ...]
    was_searched: bool


def searched(participant: str, diagnosis: pd.DataFrame, facts: Mapping[str, Any]) -> Searched:
    """From a person's artifact ``diagnosis``, which is empty where no trial could be searched, and
    its facts."""
    causes, trials = causes_of(candidates_of(diagnosis)), tuple(facts.get("trials", ()))
    return Searched(participant, causes, trials, not diagnosis.empty)


def shared_causes(people: Sequence[Searched]) -> tuple[str, ...]:
    """A sentence for each cause that more than one person has, be it as one of several that look
    alike; what most people have comes first. The laboratory's faults are in its own part."""
    found: dict[str, dict[str, list[Candidate]]] = {}  # by the cause's label and the person
    named: set[tuple[str, str]] = set()  # who has it, and not perhaps another
    for person in people:
        for cause in person.causes:
            for one in (x for x in cause if not x.is_of_all):
                found.setdefault(one.label, {}).setdefault(person.id, []).append(one)
                if len(cause) == 1:
                    named.add((one.label, person.id))
    shared = sorted(((x, of) for x, of in found.items() if len(of) > 1), key=lambda x: -len(x[1]))
    said = tuple(
        _in_words(label, of, [x for x in of if (label, x) not in named], people)
        for label, of in shared[:_MOST_SAID]
    )
    left = len(shared) - len(said)
    return (*said, f"And {left} more, see the participants' reports.") if left else said


def _in_words(
    label: str,
    of: Mapping[str, Sequence[Candidate]],
    unsure: Sequence[str],
    people: Sequence[Searched],
) -> str:
    """``of``: who has it, and what of each; ``unsure``: for whom it may be another cause."""
    # how many could have shown it: a recording of the same task was searched; of quiet stance,
    # which is no search, everybody counts
    every = [one for some in of.values() for one in some]
    tasks = {task_of(trial) for one in every for trial in one.trials}
    of_each = {p.id: {task_of(t) for t in p.trials} for p in people if p.was_searched}
    asked = len(of_each)
    if not tasks.isdisjoint(set().union(*of_each.values())):
        asked = sum(not tasks.isdisjoint(own) or p in of for p, own in of_each.items())
    known = [one.main_number() for one in every]
    return say(
        "shared",
        label=label,
        of=len(of),
        asked=asked,
        who=named_people([*of]),
        sizes=_sizes([n for n in known if n is not None]) if None not in known else "",
        unsure=len(unsure),
        which="all of them" if len(unsure) == len(of) else named_people(unsure),
    )


def _sizes(known: Sequence[Number]) -> str:
    """From the least to the largest, and whether they may be one; empty where they are of several
    parameters."""
    if len({n.name for n in known}) > 1:
        return ""
    factor, unit = readable_unit(known[0].name, known[0].unit)
    values = factor * np.array([n.value for n in known])
    widths = factor * np.array([n.high - n.low for n in known])
    are_known = bool(np.all(np.isfinite(widths) & (widths > 0)))
    digits = digits_of(float(np.median(widths)) if are_known else float(values.max()))
    ends = dict.fromkeys(number(value, digits) for value in (values.min(), values.max()))
    span = f", {with_unit(' to '.join(ends), unit)}"
    if not are_known:
        return span
    if p_of_one_size(values, widths) < _DIFFER:
        return f"{span}; the sizes differ by more than their intervals"
    return f"{span}, equal within their intervals"


def named_people(names: Sequence[str]) -> str:
    """``sub-01, sub-02 and 3 more``."""
    if len(names) <= _MOST_NAMED:
        return listing(list(names))
    return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"
