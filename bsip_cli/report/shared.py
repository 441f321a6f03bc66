"""Causes that several people's recordings share."""

from __future__ import annotations

from collections.abc import Sequence
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
    """A sentence for each named cause that more than one person has."""
    found: dict[str, dict[str, Candidate]] = {}
    for one in people:
        for cause in one.causes:
            if len(cause) == 1:
                found.setdefault(cause[0].label, {}).setdefault(one.id, cause[0])
    asked = sum(one.was_looked_at for one in people)
    return tuple(
        f"{capital(label)}: in {len(of)} of {asked} participants ({named_people(list(of))})"
        f"{_sizes([one.main_number() for one in of.values()])}."
        for label, of in found.items()
        if len(of) > 1
    )


def _sizes(numbers: Sequence[Number | None]) -> str:
    """From the least to the largest, and whether their intervals have a value in common."""
    known = [n for n in numbers if n is not None]
    if len(known) < len(numbers) or len({n.name for n in known}) > 1:
        return ""
    factor, unit = readable_unit(known[0].name, known[0].unit)
    values = sorted(factor * n.value for n in known)
    digits = digits_of(values[-1] - values[0] or values[0])
    span = f"{signed(values[0], digits)} to {signed(values[-1], digits)}"
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
