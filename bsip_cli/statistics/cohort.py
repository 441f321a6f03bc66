"""Participants' results as tidy values, and the tests of the six tables from these."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import combinations
from math import isnan, nan
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bsip_cli.statistics import samples
from bsip_cli.statistics.hypothesis_tests import (
    cohens_d_pooled,
    d_of_differences,
    described_pair,
    equivalence_tost,
    fisher_z_difference,
    one_way_anova,
    paired_t,
    repeated_measures_anova,
    sign_test,
    wilcoxon,
    williams_t,
)
from bsip_cli.statistics.methods import ALTERNATIVES, MEASURED, OM, RM

# --- one line of the cohort's results: a test, or a description, with all its numbers -------------


@dataclass(frozen=True)
class Comparison(samples.TestResult):
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


def all_reasons(*reasons: str) -> str:
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
        adjusted = samples.adjusted_p_values([comparisons[place].p_value for place in places])
        for place, p in zip(places, adjusted, strict=True):
            corrected[place] = replace(comparisons[place], p_holm=p)
    return tuple(corrected)


# --- values, and those that belong to one line of a table -----------------------------------------

DIFFERENCE = f"|{OM}-{RM}|"  # the method of a value that is how far both are apart
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


# --- the tests ------------------------------------------------------------------------------------

Sample = NDArray[np.float64]
Origin = Literal["published", "added"]
_MEANS = ("n", "mean_a", "sd_a", "mean_b", "sd_b")

DATA_SHARE = "_data_share"  # ending of the variable that says how far the data decided a mass
PAIR = f"{OM}-{RM}"  # in the column of methods: of the difference between the two


@dataclass(frozen=True)
class Criteria:
    """alpha : level of every test. equivalence_percent : of RM's mean, what counts as equal."""

    alpha: float
    equivalence_percent: float


# --- OM against another method over the participants: the published t test, and what it lacks -----


@dataclass(frozen=True, eq=False)
class Pair:
    """(participants,) values x of OM and y of another method, in the topic's unit.

    ``origin`` : of the tests that the papers make of OM and RM; with other methods they are added.
    """

    topic: Topic
    other: str
    x: Sample
    y: Sample
    origin: Origin

    def row(self, test: str, origin: Origin, result: samples.TestResult, **more: Any) -> Comparison:
        return Comparison(self.topic, test, origin, OM, self.other, **(vars(result) | more))


def pairs_of(topic: Topic, values: Sequence[Value], origin: Origin) -> Iterator[Pair]:
    """OM with RM, and with each other method of which there are values."""
    known = {value.method for value in values}
    for other in ALTERNATIVES:
        if other == RM or other in known:
            x, y = per_participant(values, (OM, other)).T
            yield Pair(topic, other, x, y, origin if other == RM else "added")


def description(topic: Topic, method: str, values: Sequence[Value]) -> Comparison:
    """Mean and SD of one method, without a test."""
    x = samples.finite_values(per_participant(values, (method,))[:, 0])
    found = {"n": len(x), "mean_a": samples.mean_of(x), "sd_a": samples.standard_deviation(x)}
    return Comparison(topic, "description", "published", method, **found)  # type: ignore[arg-type]


def t_and_rank_tests(pair: Pair, alpha: float) -> tuple[Comparison, ...]:
    """Paired t test with Cohen's d as printed; also d_z, and Wilcoxon's test."""
    test = paired_t(pair.x, pair.y, 1.0 - alpha)
    normality = samples.lilliefors_test(np.subtract(*samples.finite_pairs(pair.x, pair.y)))
    more: dict[str, Any] = {"effect_size_name": f"Cohen's d (pooled SD, {pair.other} - OM)"}
    more["effect_size"] = cohens_d_pooled(test.mean_a, test.sd_a, test.mean_b, test.sd_b)
    more |= {"lilliefors_p": normality.p_value, "reason": test.reason or normality.reason}
    by_t = pair.row("paired_t", pair.origin, test, **more)
    d_z = samples.TestResult(n=test.n, difference=test.difference, reason=test.reason)
    d_z = d_z.with_(effect_size=d_of_differences(pair.x, pair.y), effect_size_name="d_z")
    ranks = wilcoxon(pair.x, pair.y)
    by_rank = pair.row("wilcoxon", "added", ranks, effect_size_name="rank-biserial")
    return by_t, pair.row("d_z", "added", d_z), by_rank


def equivalence(pair: Pair, criteria: Criteria) -> Comparison:
    """Do x and y differ by less than so many percent of the mean of y? p of the weaker side."""
    other = samples.mean_of(samples.finite_pairs(pair.x, pair.y)[1])
    bound = abs(other) * criteria.equivalence_percent / 100.0
    return pair.row("tost", "added", equivalence_tost(pair.x, pair.y, bound, criteria.alpha))


def smaller_error(pair: Pair) -> Comparison:
    """In how many participants each method has the smaller error, with the exact sign test."""
    name = "share of participants in whom OM has the smaller error"
    return pair.row("sign", "added", sign_test(pair.x, pair.y), effect_size_name=name)


# --- measured, OM and RM side by side: the published ANOVA of three groups, and the one for them --


def methods_compared(
    topic: Topic, table: NDArray[np.float64], methods: Sequence[str], alpha: float
) -> Iterator[Comparison]:
    """Both ANOVAs with their Bonferroni post hoc tests, over the participants with all methods.

    The one-way takes the methods for groups of different people; that of repeated measures is
    what the design asks for.

    table : shape (participants, methods), in the topic's unit.
    """
    table = table[np.isfinite(table).all(axis=1)]
    of_each = [samples.lilliefors_test(column) for column in table.T]
    pairs = combinations(range(len(methods)), 2)
    differences = {
        (i, j): samples.lilliefors_test(table[:, i] - table[:, j]).p_value for i, j in pairs
    }
    why = all_reasons(*(test.reason for test in of_each))
    normality = [test.p_value for test in of_each]
    between, within = one_way_anova(list(table.T), alpha), repeated_measures_anova(table, alpha)
    of_pairs = list(differences.values())
    cases: tuple[tuple[str, str, Origin, Any, Sequence[float], str], ...] = (
        ("one_way_anova", "t", "published", between, normality, why),
        ("repeated_measures_anova", "paired_t", "added", within, of_pairs, ""),
    )
    for name, after, origin, (test, post_hoc), normal, doubt in cases:
        numbers = vars(test) | {
            "n": len(table),
            "lilliefors_p": min((p for p in normal if not isnan(p)), default=nan),
            "reason": test.reason or doubt,
        }
        yield Comparison(topic, name, origin, " / ".join(methods), **numbers)
        for (i, j), p in differences.items():
            means = described_pair(table[:, i], table[:, j])  # also where no test was possible
            numbers = vars(post_hoc.get((i, j), means.with_(reason=test.reason)))
            of_means = {name: getattr(means, name) for name in _MEANS}
            numbers = {**numbers, **of_means, "lilliefors_p": p}
            pair = methods[i], methods[j]
            yield Comparison(topic, f"bonferroni_{after}", origin, *pair, **numbers)


# --- which test belongs to which table ------------------------------------------------------------


def tests_of(values: Iterable[Value], criteria: Criteria) -> Iterator[Comparison]:
    """Every test of the topics that these values belong to; all of a topic's must be there."""
    for topic, group in topics(v for v in values if v.method != PAIR).items():
        table, alpha = topic.table, criteria.alpha
        is_share = topic.variable.endswith(DATA_SHARE)
        if is_share or all(value.method == DIFFERENCE for value in group):
            yield description(topic, OM if is_share else DIFFERENCE, group)
            continue
        if table == "table3":  # the published groups; RM+mass, whose COP is RM's, is no fourth
            methods = (MEASURED, OM, RM)
            yield from methods_compared(topic, per_participant(group, methods), methods, alpha)
        only_described = table == "table5" and not topic.variable.endswith("_rmse")
        is_published = table in ("table1", "table2") or only_described
        for pair in pairs_of(topic, group, "published" if is_published else "added"):
            if only_described:  # means and SDs
                means = described_pair(*samples.finite_pairs(pair.x, pair.y))
                yield pair.row("description", pair.origin, means)
            elif table != "table3" or pair.other != RM:
                yield from t_and_rank_tests(pair, alpha)
                if table == "table1":
                    yield equivalence(pair, criteria)
                elif table in ("table2", "table4", "table5"):
                    yield smaller_error(pair)


# --- does OM follow the measured signal better than RM? One test per participant, then counts -----


@dataclass(frozen=True)
class PersonTest:
    """Both tests of one participant, task and component; positive where OM correlates better."""

    participant: str
    topic: Topic
    williams: samples.TestResult
    fisher: samples.TestResult

    def values(self) -> tuple[Value, ...]:
        one, other = self.williams, self.fisher
        numbers = {"williams_t": one.statistic, "williams_df": one.df1, "williams_p": one.p_value}
        numbers |= {"fisher_z": other.statistic, "fisher_p": other.p_value}
        about, component = self.topic, self.topic.variable.removesuffix("_r")
        place = (self.participant, "", about.task, about.role, "", about.table)
        named = ((f"{component}_{name}", number) for name, number in numbers.items())
        return tuple(Value(*place, name, PAIR, number, "1") for name, number in named)


def person_tests(
    participant: str, runs: Iterable[tuple[Topic, Sequence[float]]]
) -> tuple[PersonTest, ...]:
    """One test per task and component of a participant.

    runs : what a trial's correlations are about; those of the measured signal with OM's and RM's,
    that of these two, and the independent samples that they rest on.

    Over several runs of a task the correlations are averaged and the samples added up: the mean
    of correlation matrices is one again, and independent recordings add their samples.
    """
    groups: dict[Topic, list[Sequence[float]]] = defaultdict(list)
    for topic, numbers in runs:
        groups[topic].append(numbers)
    tests = []
    for topic, group in groups.items():
        known = [numbers for numbers in group if not isnan(sum(numbers[:3]))] or [(nan,) * 4]
        *correlations, counts = zip(*known, strict=True)
        r_om, r_rm, r_om_rm = (float(np.mean(one)) for one in correlations)
        n = float(sum(counts))
        williams, fisher = williams_t(r_om, r_rm, r_om_rm, n), fisher_z_difference(r_om, n, r_rm, n)
        tests.append(PersonTest(participant, topic, williams, fisher))
    return tuple(tests)


class PersonTestCounts:
    """What the participants' tests come to; keeps numbers of them, not the tests."""

    def __init__(self) -> None:
        # statistic and p of each participant
        self._numbers: dict[tuple[Topic, str, Origin], list[tuple[float, float]]]
        self._numbers = defaultdict(list)
        self._reasons: dict[tuple[Topic, str, Origin], set[str]] = defaultdict(set)

    def add(self, tests: Iterable[PersonTest]) -> None:
        for test in tests:
            for name, origin, found in (
                ("williams_t", "added", test.williams),
                ("fisher_z", "published", test.fisher),
            ):
                key: Any = (test.topic, name, origin)
                self._numbers[key].append((found.statistic, found.p_value))
                self._reasons[key] |= {found.reason} if found.reason else set()

    def comparisons(self, alpha: float) -> Iterator[Comparison]:
        """Median t and p of each topic, and in how many participants OM or RM is better."""
        for key, found in self._numbers.items():
            numbers, reasons = np.array(found), self._reasons[key]
            t, p = numbers[~np.isnan(numbers[:, 1])].T
            better, worse = (int(np.sum((sign * t > 0.0) & (p < alpha))) for sign in (1.0, -1.0))
            like = ", for instance" if len(reasons) > 1 else ""
            concerned = f"in {len(numbers) - len(p)} of {len(numbers)} participants{like}"
            yield Comparison(
                *(*key, OM, RM),
                n=len(p),
                statistic=float(np.median(t)) if len(p) else nan,
                p_value=float(np.median(p)) if len(p) else nan,
                effect_size=(better + worse) / len(p) if len(p) else nan,
                effect_size_name="share of participants whose correlations differ",
                count_a=better,
                count_b=worse,
                reason=f"{concerned}: {min(reasons)}" if reasons else "",
            )
