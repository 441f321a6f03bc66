"""Measured, OM and RM side by side: the published ANOVA of three groups, and the one for them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import isnan, nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bsip_cli.statistics.anova import (
    PairwiseComparison,
    one_way_anova,
    repeated_measures_anova,
)
from bsip_cli.statistics.cohort_comparison import Comparison, joined
from bsip_cli.statistics.cohort_values import Topic
from bsip_cli.statistics.normality import lilliefors_test
from bsip_cli.statistics.samples import mean_of, standard_deviation


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
