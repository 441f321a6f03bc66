"""Participants' results as tidy values, and those that belong to one line of a table."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bsip_cli.statistics.methods import OM, RM

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
    return {_with_task_names(topic, group): group for topic, group in groups.items()}


def line_of(one: Value | Topic) -> Topic:
    """The topic of a value, or a topic itself, without the names of tasks that do not matter."""
    task = "" if one.table in OVER_TASKS else one.task
    return Topic(one.table, one.variable, task, one.role, one.unit)


def _with_task_names(topic: Topic, group: Sequence[Value]) -> Topic:
    names = ", ".join(sorted({value.task for value in group}))
    return Topic(topic.table, topic.variable, names, topic.role, topic.unit)


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
