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
    def from_row(cls, row: Mapping[Any, Any]) -> Comparison:
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


def pair_tests(
    topic: Topic, other: str, x: Sample, y: Sample, criteria: Criteria
) -> Iterator[Comparison]:
    """Of values (participants,) x of OM and y of another method.

    Paired t test with Cohen's d as printed; d_z, and Wilcoxon's test; of masses, whether x and y
    differ by less than so many percent of the mean of y; of errors, in how many participants each
    method has the smaller one. What the papers test of OM and RM is added with other methods.
    """
    table = topic.table
    only_described = table == "table5" and not topic.variable.endswith("_rmse")
    is_published = other == RM and (only_described or table in ("table1", "table2"))
    of_pair: Origin = "published" if is_published else "added"
    x, y = samples.finite_pairs(x, y)

    def row(test: str, result: samples.TestResult, origin: Origin = "added", **more: Any) -> Any:
        return Comparison(topic, test, origin, OM, other, **(vars(result) | more))

    if only_described:
        yield row("description", described_pair(x, y), of_pair)
        return
    if table == "table3" and other == RM:
        return  # that is one of the methods side by side
    test = paired_t(x, y, 1.0 - criteria.alpha)
    normality = samples.lilliefors_test(x - y)
    more: dict[str, Any] = {"effect_size_name": f"Cohen's d (pooled SD, {other} - OM)"}
    more["effect_size"] = cohens_d_pooled(test.mean_a, test.sd_a, test.mean_b, test.sd_b)
    more |= {"lilliefors_p": normality.p_value, "reason": test.reason or normality.reason}
    yield row("paired_t", test, of_pair, **more)
    d_z = samples.TestResult(n=test.n, difference=test.difference, reason=test.reason)
    d = nan if test.reason else float((x - y).mean() / (x - y).std(ddof=1))
    yield row("d_z", d_z, effect_size=d, effect_size_name="d_z")
    yield row("wilcoxon", wilcoxon(x, y), effect_size_name="rank-biserial")
    if table == "table1":
        bound = abs(samples.mean_of(y)) * criteria.equivalence_percent / 100.0
        yield row("tost", equivalence_tost(x, y, bound, criteria.alpha))
    elif table in ("table2", "table4", "table5"):
        name = "share of participants in whom OM has the smaller error"
        yield row("sign", sign_test(x, y), effect_size_name=name)


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
    doubt = all_reasons(*(test.reason for test in of_each))
    differences = {
        (i, j): samples.lilliefors_test(table[:, i] - table[:, j]).p_value
        for i, j in combinations(range(len(methods)), 2)
    }

    def rows(name: str, after: str, origin: Origin, found: Any, normal: Iterable[float]) -> Any:
        test, post_hoc = found
        of_all = vars(test) | {"n": len(table)}
        of_all["lilliefors_p"] = min((p for p in normal if not isnan(p)), default=nan)
        of_all["reason"] = test.reason or doubt * (origin == "published")
        yield Comparison(topic, name, origin, " / ".join(methods), **of_all)
        for (i, j), p in differences.items():
            means = described_pair(table[:, i], table[:, j])  # also where no test was possible
            numbers = vars(post_hoc.get((i, j), means.with_(reason=test.reason)))
            numbers = numbers | {name: getattr(means, name) for name in _MEANS}
            pair = methods[i], methods[j]
            yield Comparison(topic, after, origin, *pair, **(numbers | {"lilliefors_p": p}))

    between, within = one_way_anova(list(table.T), alpha), repeated_measures_anova(table, alpha)
    own = [test.p_value for test in of_each]
    yield from rows("one_way_anova", "bonferroni_t", "published", between, own)
    names = "repeated_measures_anova", "bonferroni_paired_t"
    yield from rows(*names, "added", within, differences.values())


# --- which test belongs to which table ------------------------------------------------------------


def tests_of(values: Iterable[Value], criteria: Criteria) -> Iterator[Comparison]:
    """Every test of the topics that these values belong to; all of a topic's must be there."""
    for topic, group in topics(v for v in values if v.method != PAIR).items():
        is_share = topic.variable.endswith(DATA_SHARE)
        if is_share or all(value.method == DIFFERENCE for value in group):
            method = OM if is_share else DIFFERENCE
            x = samples.finite_values(per_participant(group, (method,))[:, 0])
            mean, sd = samples.mean_of(x), samples.standard_deviation(x)
            described = samples.TestResult(n=len(x), mean_a=mean, sd_a=sd)
            yield Comparison(topic, "description", "published", method, **vars(described))
            continue
        if topic.table == "table3":  # RM+mass, whose COP is RM's, is no fourth group
            methods = (MEASURED, OM, RM)
            by_method = per_participant(group, methods)
            yield from methods_compared(topic, by_method, methods, criteria.alpha)
        there = {value.method for value in group}
        for other in (one for one in ALTERNATIVES if one == RM or one in there):
            x, y = per_participant(group, (OM, other)).T
            yield from pair_tests(topic, other, x, y, criteria)


# --- does OM follow the measured signal better than RM? One test per participant, then counts -----


@dataclass(frozen=True)
class PersonTest:
    """Both tests of one participant, task and component; positive where OM correlates better."""

    participant: str
    topic: Topic
    williams: samples.TestResult
    fisher: samples.TestResult

    def add_to(self, tests: PersonTests) -> None:
        """To those of the other participants."""
        both: dict[Origin, tuple[str, samples.TestResult]]
        both = {"added": ("williams_t", self.williams), "published": ("fisher_z", self.fisher)}
        for origin, (name, found) in both.items():
            numbers = found.statistic, found.p_value, found.reason
            tests.setdefault((self.topic, name, origin), []).append(numbers)

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
        williams, fisher = (
            williams_t(r_om, r_rm, r_om_rm, n),
            fisher_z_difference(r_om, r_rm, n),
        )
        tests.append(PersonTest(participant, topic, williams, fisher))
    return tuple(tests)


PersonTests = dict[tuple[Topic, str, Origin], list[tuple[float, float, str]]]
"""By topic and test, the participants' statistics, p and reasons: numbers, not the tests."""


def counted(tests: PersonTests, alpha: float) -> Iterator[Comparison]:
    """Median t and p of each topic, and in how many participants OM or RM is better."""
    for key, found in tests.items():
        t, p = np.array([one[:2] for one in found if not isnan(one[1])]).reshape(-1, 2).T
        reasons = {reason for *_, reason in found if reason}
        better, worse = (int(np.sum((sign * t > 0.0) & (p < alpha))) for sign in (1.0, -1.0))
        like = ", for instance" if len(reasons) > 1 else ""
        concerned = f"in {len(found) - len(p)} of {len(found)} participants{like}"
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
