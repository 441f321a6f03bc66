"""Participants' results as tidy values, and those that belong to one line of a table."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from math import isnan, nan
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bsip_cli.statistics.methods import OM, RM
from bsip_cli.statistics.samples import TestResult, adjusted_p_values

# --- one line of the cohort's results: a test, or a description, with all its numbers -------------


@dataclass(frozen=True)
class Comparison(TestResult):
    """A test of method_a against method_b.

    `p_holm` corrects for all rows of the same test with the same method_b in the same table.
    """

    topic: Topic
    test: str
    origin: Literal["published", "added"]
    method_a: str
    method_b: str = ""
    p_holm: float = nan
    lilliefors_p: float = nan

    def as_row(self) -> dict[str, str | float]:
        """The fields by name, the topic's among them."""
        everything = asdict(self)
        return everything.pop("topic") | everything

    @classmethod
    def from_row(cls, row: Mapping) -> Comparison:
        """The comparison that `as_row` wrote down."""
        of_topic = {field.name for field in fields(Topic)}
        topic = Topic(**{name: row[name] for name in of_topic})
        return cls(topic, **{name: row[name] for name in row if name not in of_topic})


def joined(*reasons: str) -> str:
    """Every reason once, in order."""
    return " ".join(dict.fromkeys(filter(None, reasons)))


HOLM_FAMILIES = ("paired_t", "wilcoxon")


def with_holm(comparisons: Sequence[Comparison]) -> tuple[Comparison, ...]:
    """The same comparisons, p_holm filled in where a table asks one question many times."""
    families: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for place, row in enumerate(comparisons):
        if row.test in HOLM_FAMILIES and not isnan(row.p_value):
            families[row.topic.table, row.test, row.method_b].append(place)
    corrected = list(comparisons)
    for places in families.values():
        adjusted = adjusted_p_values([comparisons[place].p_value for place in places], "holm")
        for place, p in zip(places, adjusted, strict=True):
            corrected[place] = replace(comparisons[place], p_holm=p)
    return tuple(corrected)


# --------------------------------------------------------------------------------------------------


DIFFERENCE = f"|{OM}-{RM}|"
"""The method of a value that is how far both are apart."""

OVER_TASKS = ("table2", "table3", "table6")
"""Tables of the identification sequence, under whatever task names it was recorded."""


class Value(NamedTuple):
    """One number of one participant, trial and method; `trial` is empty where there is none.

    `role` is sequence or validation, `data` what the trial was to OM: identification or held_out.
    """

    participant: str
    trial: str
    task: str
    role: str
    data: str
    table: str
    variable: str
    method: str
    value: float
    unit: str


@dataclass(frozen=True)
class Topic:
    """What one line of a table is about: a variable in a task, in one unit."""

    table: str
    variable: str
    task: str
    role: str
    unit: str


def topics(values: Iterable[Value]) -> dict[Topic, list[Value]]:
    """The values of each topic, in the order in which the topics first appear."""
    groups: dict[Topic, list[Value]] = defaultdict(list)
    for value in values:
        groups[line_of(value)].append(value)
    names = {topic: sorted({value.task for value in group}) for topic, group in groups.items()}
    return {replace(topic, task=", ".join(names[topic])): groups[topic] for topic in groups}


def line_of(one: Value | Topic) -> Topic:
    """The topic of a value, or a topic itself, without the names of tasks that do not matter."""
    task = "" if one.table in OVER_TASKS else one.task
    return Topic(one.table, one.variable, task, one.role, one.unit)


def per_participant(values: Iterable[Value], methods: Sequence[str]) -> NDArray[np.float64]:
    """Shape (participants, methods): the mean over each one's runs; nan where there is none.

    Only runs with all the methods count, so that the methods are compared over the same runs.
    """
    found: dict[str, dict[str, dict[str, float]]] = defaultdict(lambda: defaultdict(dict))
    for value in values:
        found[value.participant][value.trial][value.method] = value.value
    means = np.full((len(found), len(methods)), np.nan)
    for row, trials in enumerate(found.values()):
        runs = np.array([[run.get(m, np.nan) for m in methods] for run in trials.values()])
        complete = runs[np.isfinite(runs).all(axis=1)]
        if len(complete):
            means[row] = complete.mean(axis=0)
    return means
