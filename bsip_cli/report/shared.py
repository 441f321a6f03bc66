"""Causes that several people's recordings share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.effects.readable import digits_of, readable_unit, with_unit
from bsip_cli.report.candidates import Candidate, Number, candidates_of, causes_of
from bsip_cli.report.words import capital, listing, signed

SHARED = (
    "What several participants share points to the laboratory, the protocol or the model rather "
    "than to a person:"
)
_MOST_NAMED = 12  # participants in one sentence
_MOST_TOLD = 8  # causes


@dataclass(frozen=True)
class Person:
    """What was found of one participant: a single candidate each, or all of a class of rivals."""

    id: str
    causes: tuple[tuple[Candidate, ...], ...]
    was_looked_at: bool


def person_of(participant: str, diagnosis: pd.DataFrame) -> Person:
    """From the artifact ``diagnosis`` of a person; it is empty where no trial was long enough."""
    return Person(participant, causes_of(candidates_of(diagnosis)), not diagnosis.empty)


def shared_causes(people: Sequence[Person]) -> tuple[str, ...]:
    """A sentence for each cause that more than one person has, be it as one of several
    that look alike; what most people have comes first."""
    asked = sum(one.was_looked_at for one in people)
    found = _people_of_causes(people)
    shared = sorted(
        (label for label in found if len(found[label]) > 1), key=lambda x: -len(found[x])
    )
    return tuple(
        f"{capital(label)}: {_told(found[label], asked)}." for label in shared[:_MOST_TOLD]
    )


def _people_of_causes(people: Sequence[Person]) -> dict[str, dict[str, tuple[Candidate, ...]]]:
    """Of each cause, by its label, the people who have it, and itself before its rivals there."""
    found: dict[str, dict[str, tuple[Candidate, ...]]] = {}
    for one in people:
        for cause in one.causes:
            for rival in cause:
                others = (c for c in cause if c is not rival)
                found.setdefault(rival.label, {}).setdefault(one.id, (rival, *others))
    return found


def _told(of: Mapping[str, Sequence[Candidate]], asked: int) -> str:
    unsure = [name for name, cause in of.items() if len(cause) > 1]
    where = f"in {len(of)} of {asked} participants ({named_people(list(of))})"
    sizes = _sizes([cause[0].main_number() for cause in of.values()])
    if not unsure:
        return f"{where}{sizes}"
    which = "all of them" if len(unsure) == len(of) else named_people(unsure)
    return f"{where}{sizes}; one of several that look alike in {which}"


def _sizes(numbers: Sequence[Number | None]) -> str:
    """From the least to the largest, and whether their intervals have a value in common."""
    known = [n for n in numbers if n is not None]
    if len(known) < len(numbers) or len({n.name for n in known}) > 1:
        return ""
    factor, unit = readable_unit(known[0].name, known[0].unit)
    values = sorted(factor * n.value for n in known)
    digits = digits_of(values[-1] - values[0] or values[0])
    ends = dict.fromkeys(signed(value, digits) for value in (values[0], values[-1]))
    span = " to ".join(ends)
    low, high = (np.array([getattr(n, end) for n in known]) for end in ("low", "high"))
    if not np.isfinite(high - low).all():
        return f", {with_unit(span, unit)}"
    verb = "agree" if low.max() <= high.min() else "differ by more than their intervals"
    return f", {with_unit(span, unit)}; the sizes {verb}"


def named_people(names: Sequence[str]) -> str:
    """``sub-01, sub-02 and 3 more``."""
    if len(names) <= _MOST_NAMED:
        return listing(list(names))
    return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"
