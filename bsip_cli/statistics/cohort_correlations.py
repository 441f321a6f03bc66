"""Does OM follow the measured signal better than RM does? One test per participant, then counts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isnan, nan

import numpy as np

from bsip_cli.statistics.cohort_comparison import Comparison
from bsip_cli.statistics.cohort_values import OM, RM, Topic, Value
from bsip_cli.statistics.correlation_tests import (
    DependentCorrelations,
    IndependentCorrelations,
    fisher_z_difference,
    williams_t,
)

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


def over_participants(tests: Iterable[PersonTest], alpha: float) -> tuple[Comparison, ...]:
    """Median t and p of each topic, and in how many participants OM or RM is better."""
    groups: dict[Topic, list[PersonTest]] = defaultdict(list)
    for test in tests:
        groups[test.topic].append(test)
    rows = []
    for topic, group in groups.items():
        williams = [(test.williams.t, test.williams.p) for test in group]
        fisher = [(test.fisher.z, test.fisher.p) for test in group]
        why = sorted({test.williams.reason for test in group if test.williams.reason})
        why_fisher = sorted({test.fisher.reason for test in group if test.fisher.reason})
        rows.append(_counted(topic, "williams_t", "added", williams, why, alpha))
        rows.append(_counted(topic, "fisher_z", "published", fisher, why_fisher, alpha))
    return tuple(rows)


def _counted(topic, test, origin, results: Sequence[tuple[float, float]], reasons, alpha: float):
    possible = [(t, p) for t, p in results if not isnan(p)]
    better = sum(t > 0.0 and p < alpha for t, p in possible)
    worse = sum(t < 0.0 and p < alpha for t, p in possible)
    impossible = len(results) - len(possible)
    like = ", for instance" if len(reasons) > 1 else ""
    concerned = f"in {impossible} of {len(results)} participants{like}"
    return Comparison(
        topic,
        test,
        origin,
        OM,
        RM,
        n=len(possible),
        statistic=float(np.median([t for t, _ in possible])) if possible else nan,
        p_value=float(np.median([p for _, p in possible])) if possible else nan,
        effect_size=(better + worse) / len(possible) if possible else nan,
        effect_size_name="share of participants whose correlations differ",
        count_a=better,
        count_b=worse,
        reason=f"{concerned}: {reasons[0]}" if reasons else "",
    )
