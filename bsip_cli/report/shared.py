"""Causes that several people's recordings share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.effects.readable import digits_of, readable_unit, with_unit
from bsip_cli.report.candidates import Candidate, Number, candidates_of, causes_of
from bsip_cli.report.words import capital, listing, number, task_of
from bsip_cli.statistics.samples import p_of_one_size

SHARED = (
    "Shared causes may point to the laboratory, the task or the model rather than to a person "
    "(a few of very many may be coincidence):"
)
_MOST_NAMED = 12  # participants in one sentence
_MOST_TOLD = 8  # causes
_DIFFER = 0.05  # p-value from which on sizes may be the same

Cause = tuple[Candidate, ...]
"""A single candidate, or all of a group of which one is there."""


@dataclass(frozen=True)
class Searched:
    """What was found of one participant.

    trials : stems of those that were searched.
    was_searched : whether anything can be said at all.
    """

    id: str
    causes: tuple[Cause, ...]
    trials: tuple[str, ...]
    was_searched: bool


def searched(participant: str, diagnosis: pd.DataFrame, facts: Mapping[str, Any]) -> Searched:
    """From a person's artifact ``diagnosis``, which is empty where no trial could be searched, and
    its facts."""
    return Searched(
        participant,
        causes_of(candidates_of(diagnosis)),
        tuple(facts.get("trials", ())),
        not diagnosis.empty,
    )


def shared_causes(people: Sequence[Searched]) -> tuple[str, ...]:
    """A sentence for each cause that more than one person has, be it as one of several that look
    alike; what most people have comes first. What the laboratory tells of itself is said there."""
    shared = [found for found in _found(people) if len(found.people) > 1]
    shared.sort(key=lambda found: -len(found.people))
    said = [_told(found, people) for found in shared[:_MOST_TOLD]]
    left = len(shared) - len(said)
    return (*said, f"And {left} more, see the participants' reports.") if left else tuple(said)


@dataclass
class _Found:
    """A cause by its label: who has it, what of each, and for whom it may be another one."""

    label: str
    people: dict[str, list[Candidate]]
    named_of: set[str]


def _found(people: Sequence[Searched]) -> list[_Found]:
    found: dict[str, _Found] = {}
    for person in people:
        for cause in person.causes:
            for one in (x for x in cause if not x.is_of_all):
                known = found.setdefault(one.label, _Found(one.label, {}, set()))
                known.people.setdefault(person.id, []).append(one)
                if len(cause) == 1:
                    known.named_of.add(person.id)
    return list(found.values())


def _told(found: _Found, people: Sequence[Searched]) -> str:
    unsure = [person for person in found.people if person not in found.named_of]
    possibly = "possibly " if not found.named_of else ""
    asked = _asked(found, people)
    where = f"{possibly}in {len(found.people)} of {asked} participants"
    if len(found.people) < asked:
        where += f" ({named_people(list(found.people))})"
    every = [one.main_number() for of in found.people.values() for one in of]
    text = f"{capital(found.label)}: {where}{_sizes(every)}"
    if not unsure:
        return f"{text}."
    which = "all of them" if len(unsure) == len(found.people) else named_people(unsure)
    return f"{text}; one of several that look alike in {which}."


def _asked(found: _Found, people: Sequence[Searched]) -> int:
    """How many could have shown it: a recording of the same task was searched. Of standing, which is
    no search, everybody counts."""
    tasks = {task_of(t) for of in found.people.values() for one in of for t in one.trials}
    of_each = {p.id: {task_of(t) for t in p.trials} for p in people if p.was_searched}
    if tasks.isdisjoint(set().union(*of_each.values())):
        return len(of_each)
    return sum(not tasks.isdisjoint(own) or p in found.people for p, own in of_each.items())


def _sizes(numbers: Sequence[Number | None]) -> str:
    """From the least to the largest, and whether they may all be the same."""
    known = [n for n in numbers if n is not None]
    if len(known) < len(numbers) or len({n.name for n in known}) > 1:
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
    return f"{span}; the sizes may all be the same"


def named_people(names: Sequence[str]) -> str:
    """``sub-01, sub-02 and 3 more``."""
    if len(names) <= _MOST_NAMED:
        return listing(list(names))
    return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"
