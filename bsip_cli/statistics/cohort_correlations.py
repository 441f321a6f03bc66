"""Does OM follow the measured signal better than RM does? One test per participant, then counts."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Literal

import numpy as np

from bsip_cli.statistics.cohort_values import Comparison, Topic, Value
from bsip_cli.statistics.correlation_tests import (
    DependentCorrelations,
    IndependentCorrelations,
    fisher_z_difference,
    williams_t,
)
from bsip_cli.statistics.methods import OM, RM

PAIR = f"{OM}-{RM}"
"""In the column of methods: of the difference between the two."""


@dataclass(frozen=True)
class CorrelationRun:
    """Correlations of one trial and component, and the independent samples they rest on."""

    participant: str
    trial: str
    task: str
    role: str
    component: str
    r_om: float
    r_rm: float
    r_om_rm: float
    n_effective: float


@dataclass(frozen=True)
class PersonTest:
    """Both tests of one participant, task and component; positive where OM correlates better."""

    participant: str
    topic: Topic
    williams: DependentCorrelations
    fisher: IndependentCorrelations

    def values(self) -> tuple[Value, ...]:
        numbers = {
            "williams_t": self.williams.t,
            "williams_df": self.williams.df,
            "williams_p": self.williams.p,
            "fisher_z": self.fisher.z,
            "fisher_p": self.fisher.p,
        }
        component = self.topic.variable.removesuffix("_r")
        return tuple(
            Value(
                self.participant,
                "",
                self.topic.task,
                self.topic.role,
                "",
                self.topic.table,
                f"{component}_{name}",
                PAIR,
                number,
                "1",
            )
            for name, number in numbers.items()
        )


def person_tests(table: str, runs: Iterable[CorrelationRun]) -> tuple[PersonTest, ...]:
    """One test per participant, task and component.

    Over several runs of a task the correlations are averaged and the samples added up: the mean
    of correlation matrices is one again, and independent recordings add their samples.
    """
    groups: dict[tuple[str, Topic], list[CorrelationRun]] = defaultdict(list)
    for run in runs:
        topic = Topic(table, f"{run.component}_r", run.task, run.role, "1")
        groups[run.participant, topic].append(run)
    tests = []
    for (participant, topic), group in groups.items():
        known = [run for run in group if not isnan(run.r_om + run.r_rm + run.r_om_rm)]
        r_om, r_rm, r_om_rm = (
            float(np.mean([getattr(run, name) for run in known])) if known else nan
            for name in ("r_om", "r_rm", "r_om_rm")
        )
        n = float(sum(run.n_effective for run in known)) if known else nan
        tests.append(
            PersonTest(
                participant,
                topic,
                williams_t(r_om, r_rm, r_om_rm, n),
                fisher_z_difference(r_om, n, r_rm, n),
            )
        )
    return tuple(tests)


class PersonTestCounts:
    """What the participants' tests come to; keeps numbers of them, not the tests."""

    def __init__(self) -> None:
        self._topics: dict[Topic, dict[str, _Results]] = {}

    def add(self, tests: Iterable[PersonTest]) -> None:
        for test in tests:
            topic = self._topics.setdefault(
                test.topic, {"williams_t": _Results("added"), "fisher_z": _Results("published")}
            )
            topic["williams_t"].add(test.williams.t, test.williams.p, test.williams.reason)
            topic["fisher_z"].add(test.fisher.z, test.fisher.p, test.fisher.reason)

    def comparisons(self, alpha: float) -> tuple[Comparison, ...]:
        """Median t and p of each topic, and in how many participants OM or RM is better."""
        return tuple(
            results.comparison(topic, test, alpha)
            for topic, tests in self._topics.items()
            for test, results in tests.items()
        )


@dataclass
class _Results:
    """Statistic and p of one test in every participant, and why it is missing in some."""

    origin: Literal["published", "added"]
    statistics: array[float] = field(default_factory=lambda: array("d"))
    p_values: array[float] = field(default_factory=lambda: array("d"))
    reasons: set[str] = field(default_factory=set)

    def add(self, statistic: float, p_value: float, reason: str) -> None:
        self.statistics.append(statistic)
        self.p_values.append(p_value)
        if reason:
            self.reasons.add(reason)

    def comparison(self, topic: Topic, test: str, alpha: float) -> Comparison:
        t, p = np.array(self.statistics), np.array(self.p_values)
        t, p = t[~np.isnan(p)], p[~np.isnan(p)]
        better, worse = (int(np.sum((sign * t > 0.0) & (p < alpha))) for sign in (1.0, -1.0))
        total = len(self.p_values)
        like = ", for instance" if len(self.reasons) > 1 else ""
        concerned = f"in {total - len(p)} of {total} participants{like}"
        return Comparison(
            topic,
            test,
            self.origin,
            OM,
            RM,
            n=len(p),
            statistic=float(np.median(t)) if len(p) else nan,
            p_value=float(np.median(p)) if len(p) else nan,
            effect_size=(better + worse) / len(p) if len(p) else nan,
            effect_size_name="share of participants whose correlations differ",
            count_a=better,
            count_b=worse,
            reason=f"{concerned}: {min(self.reasons)}" if self.reasons else "",
        )
