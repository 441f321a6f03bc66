"""Measured, OM and RM side by side: the published ANOVA of three groups, and the one for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isnan, nan, sqrt
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bsip_cli.statistics.cohort_values import Comparison, Topic, joined
from bsip_cli.statistics.paired_tests import paired_t
from bsip_cli.statistics.samples import (
    ROUNDING,
    adjusted_p_values,
    finite_values,
    lilliefors_test,
    mean_of,
    standard_deviation,
)

# --- more than two methods: one-way analysis of variance, and the one for repeated measures -------

# Hansen 2017 (table 3) compares force plate, OM and RM by a one-way ANOVA, as if they were three
# groups of people. They are the same people: `repeated_measures_anova` is the test for them. A
# test that is not possible has nan numbers and a sentence in `reason`.


@dataclass(frozen=True)
class PairwiseComparison:
    """Post hoc t test of two groups or columns, numbered from 0 in the order given.

    mean_difference is first - second; the interval and p_bonferroni are corrected for the number
    of comparisons, p is not.
    """

    first: int
    second: int
    mean_difference: float
    ci_low: float = nan
    ci_high: float = nan
    t: float = nan
    df: float = nan
    p: float = nan
    p_bonferroni: float = nan
    reason: str = ""


@dataclass(frozen=True)
class OneWayAnova:
    """F test of equal means of independent groups; eta_squared = SS between / SS total."""

    n_per_group: tuple[int, ...]
    f: float = nan
    df_between: float = nan
    df_within: float = nan
    p: float = nan
    eta_squared: float = nan
    post_hoc: tuple[PairwiseComparison, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class RepeatedMeasuresAnova:
    """F test of equal column means within participants.

    df_effect, df_error and p assume sphericity; epsilon is Greenhouse and Geisser's, between
    1/(k-1) and 1, and p_greenhouse_geisser is at epsilon times both degrees of freedom.
    partial_eta_squared = SS effect / (SS effect + SS error).
    """

    n: int
    k: int
    f: float = nan
    df_effect: float = nan
    df_error: float = nan
    p: float = nan
    epsilon: float = nan
    p_greenhouse_geisser: float = nan
    partial_eta_squared: float = nan
    post_hoc: tuple[PairwiseComparison, ...] = ()
    reason: str = ""


def one_way_anova(groups: Sequence[ArrayLike], alpha: float = 0.05) -> OneWayAnova:
    """One-way ANOVA of independent groups (Fisher 1925) with Bonferroni post hoc tests.

    The post hoc t tests share the pooled variance and its degrees of freedom, as in SPSS and in
    R's pairwise.t.test.

    Parameters
    ----------
    groups : two or more samples of shape (n_i,), one unit. Values that are not finite are
        dropped; n_per_group says how many are left.
    alpha : the post hoc intervals hold together at 1 - alpha.
    """
    samples = [finite_values(group) for group in groups]
    sizes = tuple(len(sample) for sample in samples)
    reason = ""
    if len(samples) < 2:
        reason = f"An analysis of variance needs two groups, there are {len(samples)}."
    elif min(sizes) < 2:
        reason = f"Each group needs two values; there are {', '.join(map(str, sizes))}."
    elif _nothing_left(
        np.concatenate([sample - sample.mean() for sample in samples]), np.concatenate(samples)
    ):
        reason = "The values do not vary within the groups, so F has no finite value."
    if reason:
        return OneWayAnova(sizes, reason=reason)
    pooled = np.concatenate(samples)
    ss_within = float(sum(np.sum((sample - sample.mean()) ** 2) for sample in samples))
    ss_total = float(np.sum((pooled - pooled.mean()) ** 2))
    df_between, df_within = float(len(samples) - 1), float(len(pooled) - len(samples))
    f, p = stats.f_oneway(*samples)
    return OneWayAnova(
        n_per_group=sizes,
        f=float(f),
        df_between=df_between,
        df_within=df_within,
        p=float(p),
        eta_squared=1.0 - ss_within / ss_total,
        post_hoc=_pooled_post_hoc(samples, ss_within / df_within, df_within, alpha),
    )


def repeated_measures_anova(matrix: ArrayLike, alpha: float = 0.05) -> RepeatedMeasuresAnova:
    """ANOVA of k measurements of the same n participants, with Bonferroni paired post hoc tests.

    epsilon = (tr S)^2 / ((k - 1) tr(S S)) with S the doubly centred covariance of the columns
    (Greenhouse and Geisser 1959, Psychometrika 24; Box 1954).

    Parameters
    ----------
    matrix : shape (n, k), one row per participant. Rows with a value that is not finite are
        dropped; n says how many are left.
    alpha : the post hoc intervals hold together at 1 - alpha.

    Raises
    ------
    ValueError
        if matrix is not two-dimensional.
    """
    table = np.asarray(matrix, dtype=float)
    if table.ndim != 2:
        raise ValueError(f"matrix must have shape (participants, columns), not {table.shape}")
    table = table[np.isfinite(table).all(axis=1)]
    n, k = table.shape
    reason = ""
    if k < 2:
        reason = f"Repeated measures need two columns, there are {k}."
    elif n < 3:
        reason = f"Repeated measures need three complete participants, there are {n}."
    elif _nothing_left(_doubly_centred(table), table):
        reason = "All participants change alike, without any error, so F has no finite value."
    if reason:
        return RepeatedMeasuresAnova(n, k, reason=reason)
    ss_effect = n * float(np.sum((table.mean(axis=0) - table.mean()) ** 2))
    ss_error = float(np.sum(_doubly_centred(table) ** 2))
    df_effect, df_error = float(k - 1), float((k - 1) * (n - 1))
    f = (ss_effect / df_effect) / (ss_error / df_error)
    epsilon = _greenhouse_geisser(table)
    return RepeatedMeasuresAnova(
        n=n,
        k=k,
        f=f,
        df_effect=df_effect,
        df_error=df_error,
        p=float(stats.f.sf(f, df_effect, df_error)),
        epsilon=epsilon,
        p_greenhouse_geisser=float(stats.f.sf(f, epsilon * df_effect, epsilon * df_error)),
        partial_eta_squared=ss_effect / (ss_effect + ss_error),
        post_hoc=_paired_post_hoc(table, alpha),
    )


def _nothing_left(residual: NDArray[np.float64], values: NDArray[np.float64]) -> bool:
    return float(np.max(np.abs(residual))) <= ROUNDING * float(np.max(np.abs(values)))


def _doubly_centred(table: NDArray[np.float64]) -> NDArray[np.float64]:
    rows, columns = table.mean(axis=1, keepdims=True), table.mean(axis=0, keepdims=True)
    return table - rows - columns + table.mean()


def _greenhouse_geisser(table: NDArray[np.float64]) -> float:
    covariance = _doubly_centred(np.cov(table, rowvar=False))
    k = len(covariance)
    return float(np.trace(covariance) ** 2 / ((k - 1) * np.sum(covariance**2)))


def _pooled_post_hoc(
    samples: Sequence[NDArray[np.float64]], variance: float, df: float, alpha: float
) -> tuple[PairwiseComparison, ...]:
    pairs = list(combinations(range(len(samples)), 2))
    critical = float(stats.t.isf(alpha / 2.0 / len(pairs), df))
    differences = [float(samples[i].mean() - samples[j].mean()) for i, j in pairs]
    errors = [sqrt(variance * (1.0 / len(samples[i]) + 1.0 / len(samples[j]))) for i, j in pairs]
    p_values = [
        2.0 * float(stats.t.sf(abs(d) / e, df)) for d, e in zip(differences, errors, strict=True)
    ]
    return tuple(
        PairwiseComparison(i, j, d, d - critical * e, d + critical * e, d / e, df, p, adjusted)
        for (i, j), d, e, p, adjusted in zip(
            pairs,
            differences,
            errors,
            p_values,
            adjusted_p_values(p_values, "bonferroni"),
            strict=True,
        )
    )


def _paired_post_hoc(table: NDArray[np.float64], alpha: float) -> tuple[PairwiseComparison, ...]:
    pairs = list(combinations(range(table.shape[1]), 2))
    tests = [paired_t(table[:, i], table[:, j], 1.0 - alpha / len(pairs)) for i, j in pairs]
    adjusted = adjusted_p_values([test.p for test in tests], "bonferroni")
    return tuple(
        PairwiseComparison(
            i,
            j,
            test.mean_difference,
            test.ci_low,
            test.ci_high,
            test.t,
            test.df,
            test.p,
            p,
            test.reason,
        )
        for (i, j), test, p in zip(pairs, tests, adjusted, strict=True)
    )


# --------------------------------------------------------------------------------------------------


def methods_beside_each_other(
    topic: Topic, table: NDArray[np.float64], methods: Sequence[str], alpha: float
) -> tuple[Comparison, ...]:
    """Both ANOVAs with their Bonferroni post hoc tests, over the participants with all methods.

    Parameters
    ----------
    table : shape (participants, methods), in the topic's unit.
    """
    complete = table[np.isfinite(table).all(axis=1)]
    return (
        *_as_published(topic, complete, methods, alpha),
        *_of_the_same_people(topic, complete, methods, alpha),
    )


def _as_published(
    topic: Topic, table: NDArray[np.float64], methods: Sequence[str], alpha: float
) -> tuple[Comparison, ...]:
    """The one-way ANOVA, which takes the methods for groups of different people."""
    groups = one_way_anova(list(table.T), alpha)
    normality = [lilliefors_test(column, alpha) for column in table.T]
    anova = Comparison(
        topic,
        "one_way_anova",
        "published",
        " / ".join(methods),
        n=len(table),
        statistic=groups.f,
        df1=groups.df_between,
        df2=groups.df_within,
        p_value=groups.p,
        effect_size=groups.eta_squared,
        effect_size_name="eta squared",
        lilliefors_p=_smallest(test.p_value for test in normality),
        reason=groups.reason or joined(*(test.reason for test in normality)),
    )
    return anova, *_post_hoc(
        topic,
        "bonferroni_t",
        "published",
        table,
        methods,
        groups.post_hoc,
        groups.reason,
        alpha,
    )


def _of_the_same_people(
    topic: Topic, table: NDArray[np.float64], methods: Sequence[str], alpha: float
) -> tuple[Comparison, ...]:
    """The ANOVA of repeated measures, which the design asks for."""
    same = repeated_measures_anova(table, alpha)
    pairs = combinations(range(len(methods)), 2)
    anova = Comparison(
        topic,
        "repeated_measures_anova",
        "added",
        " / ".join(methods),
        n=len(table),
        statistic=same.f,
        df1=same.epsilon * same.df_effect,
        df2=same.epsilon * same.df_error,
        p_value=same.p_greenhouse_geisser,
        effect_size=same.partial_eta_squared,
        effect_size_name="partial eta squared",
        epsilon=same.epsilon,
        lilliefors_p=_smallest(_normality_of_difference(table, i, j, alpha) for i, j in pairs),
        reason=same.reason,
    )
    return anova, *_post_hoc(
        topic,
        "bonferroni_paired_t",
        "added",
        table,
        methods,
        same.post_hoc,
        same.reason,
        alpha,
    )


def _post_hoc(
    topic: Topic,
    test: str,
    origin: Literal["published", "added"],
    table: NDArray[np.float64],
    methods: Sequence[str],
    done: Sequence[PairwiseComparison],
    reason: str,
    alpha: float,
) -> tuple[Comparison, ...]:
    """A row for each pair of methods, with means also where the test was not possible."""
    results = {(pair.first, pair.second): pair for pair in done}
    rows = []
    for i, j in combinations(range(len(methods)), 2):
        x, y = table[:, i], table[:, j]
        pair = results.get((i, j), PairwiseComparison(i, j, mean_of(x - y), reason=reason))
        rows.append(
            Comparison(
                topic,
                test,
                origin,
                methods[i],
                methods[j],
                len(x),
                mean_of(x),
                standard_deviation(x),
                mean_of(y),
                standard_deviation(y),
                pair.mean_difference,
                pair.ci_low,
                pair.ci_high,
                statistic=pair.t,
                df1=pair.df,
                p_value=pair.p_bonferroni,
                lilliefors_p=_normality_of_difference(table, i, j, alpha),
                reason=pair.reason,
            )
        )
    return tuple(rows)


def _normality_of_difference(
    table: NDArray[np.float64], first: int, second: int, alpha: float
) -> float:
    return lilliefors_test(table[:, first] - table[:, second], alpha).p_value


def _smallest(p_values) -> float:
    return min((p for p in p_values if not isnan(p)), default=nan)
