"""The tests of the six tables, from the participants' values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bsip_cli.statistics.cohort_correlations import PAIR
from bsip_cli.statistics.cohort_groups import methods_beside_each_other
from bsip_cli.statistics.cohort_values import (
    DIFFERENCE,
    Comparison,
    Topic,
    Value,
    per_participant,
    topics,
)
from bsip_cli.statistics.methods import MEASURED, OM, RIVALS, RM
from bsip_cli.statistics.paired_tests import (
    MINIMUM_FOR_WILCOXON,
    EquivalenceTest,
    PairedComparison,
    equivalence_tost,
    paired_t,
    wilcoxon,
)
from bsip_cli.statistics.samples import (
    NormalityTest,
    finite_pairs,
    finite_values,
    lilliefors_test,
    mean_of,
    standard_deviation,
)

# --- oM against a rival over the participants: the published t test, and what stands beside it ----


Sample = NDArray[np.float64]
Origin = Literal["published", "added"]


@dataclass(frozen=True, eq=False)
class Pair:
    """(participants,) values x of OM and y of a rival, in the topic's unit.

    ``origin`` : of the tests that the papers make of OM and RM; with another rival they are added.
    """

    topic: Topic
    rival: str
    x: Sample
    y: Sample
    origin: Origin

    def finite(self) -> tuple[Sample, Sample]:
        """Of the participants with both."""
        return finite_pairs(self.x, self.y)


def pairs_of(topic: Topic, values: Sequence[Value], origin: Origin) -> Iterator[Pair]:
    """OM with RM, and with each other rival of which there are values."""
    known = {value.method for value in values}
    for rival in RIVALS:
        if rival == RM or rival in known:
            x, y = per_participant(values, (OM, rival)).T
            yield Pair(topic, rival, x, y, origin if rival == RM else "added")


def description(topic: Topic, method: str, x: Sample) -> Comparison:
    """Mean and SD of one method, without a test."""
    values = finite_values(x)
    return Comparison(
        topic,
        "description",
        "published",
        method,
        n=len(values),
        mean_a=mean_of(values),
        sd_a=standard_deviation(values),
    )


def pair_description(pair: Pair) -> Comparison:
    """Means and SDs of the participants with both methods, without a test."""
    x, y = pair.finite()
    return Comparison(
        pair.topic,
        "description",
        pair.origin,
        OM,
        pair.rival,
        n=len(x),
        mean_a=mean_of(x),
        sd_a=standard_deviation(x),
        mean_b=mean_of(y),
        sd_b=standard_deviation(y),
        difference=mean_of(x - y),
    )


def t_and_rank_tests(pair: Pair, alpha: float) -> tuple[Comparison, ...]:
    """Paired t test with Cohen's d as printed; beside it d_z, and Wilcoxon's test."""
    test = paired_t(pair.x, pair.y, 1.0 - alpha)
    normality = lilliefors_test(np.subtract(*pair.finite()), alpha)
    paired_effect = Comparison(
        pair.topic,
        "d_z",
        "added",
        OM,
        pair.rival,
        test.n,
        difference=test.mean_difference,
        effect_size=test.d_paired,
        effect_size_name="d_z",
        reason=test.reason,
    )
    ranks = wilcoxon(pair.x, pair.y)
    by_rank = Comparison(
        pair.topic,
        "wilcoxon",
        "added",
        OM,
        pair.rival,
        ranks.n,
        difference=ranks.hodges_lehmann,
        statistic=ranks.w,
        p_value=ranks.p,
        effect_size=ranks.rank_biserial,
        effect_size_name="rank-biserial",
        reason=ranks.reason,
    )
    return _t_row(pair, test, normality), paired_effect, by_rank


def _t_row(pair: Pair, test: PairedComparison, normality: NormalityTest) -> Comparison:
    return Comparison(
        pair.topic,
        "paired_t",
        pair.origin,
        OM,
        pair.rival,
        test.n,
        test.mean_x,
        test.sd_x,
        test.mean_y,
        test.sd_y,
        test.mean_difference,
        test.ci_low,
        test.ci_high,
        statistic=test.t,
        df1=test.df,
        p_value=test.p,
        effect_size=test.cohens_d_pooled,
        effect_size_name=f"Cohen's d (pooled SD, {pair.rival} - OM)",
        lilliefors_p=normality.p_value,
        reason=test.reason or normality.reason,
    )


def equivalence(pair: Pair, alpha: float, percent: float) -> Comparison:
    """Do x and y differ by less than so many percent of the mean of y? p of the weaker side."""
    bound = abs(mean_of(pair.finite()[1])) * percent / 100.0
    test = equivalence_tost(pair.x, pair.y, bound, alpha)
    return Comparison(
        pair.topic,
        "tost",
        "added",
        OM,
        pair.rival,
        test.n,
        difference=test.mean_difference,
        ci_low=test.ci_low,
        ci_high=test.ci_high,
        bound=bound,
        statistic=_weaker_side(test),
        df1=test.df,
        p_value=test.p,
        reason=test.reason,
    )


def _weaker_side(test: EquivalenceTest) -> float:
    return test.t_lower if test.t_lower <= -test.t_upper else test.t_upper


def smaller_error(pair: Pair) -> Comparison:
    """In how many participants each method has the smaller error, with the exact sign test."""
    x, y = pair.finite()
    own, other = int(np.sum(x < y)), int(np.sum(y < x))
    possible = own + other >= MINIMUM_FOR_WILCOXON
    return Comparison(
        pair.topic,
        "sign",
        "added",
        OM,
        pair.rival,
        n=len(x),
        p_value=float(stats.binomtest(own, own + other).pvalue) if possible else np.nan,
        effect_size=own / len(x) if len(x) else np.nan,
        effect_size_name="share of participants in whom OM has the smaller error",
        count_a=own,
        count_b=other,
        reason=""
        if possible
        else (
            f"The sign test needs {MINIMUM_FOR_WILCOXON} pairs that differ to reach p < 0.05, "
            f"there are {own + other}."
        ),
    )


# --------------------------------------------------------------------------------------------------


DATA_SHARE = "_data_share"
"""Ending of the variable that says how far the data decided a mass."""


@dataclass(frozen=True)
class Criteria:
    """alpha : level of every test. equivalence_percent : of RM's mean, what counts as equal."""

    alpha: float
    equivalence_percent: float


def tests_of(values: Iterable[Value], criteria: Criteria) -> Iterator[Comparison]:
    """Every test of the topics that these values belong to; all of a topic's must be there."""
    for topic, group in topics(v for v in values if v.method != PAIR).items():
        yield from _TABLES[topic.table](topic, group, criteria)


def _segment_mass(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    if topic.variable.endswith(DATA_SHARE):
        yield description(topic, OM, per_participant(values, (OM,))[:, 0])
        return
    for pair in pairs_of(topic, values, "published"):
        yield from t_and_rank_tests(pair, criteria.alpha)
        yield equivalence(pair, criteria.alpha, criteria.equivalence_percent)


def _errors(
    topic: Topic, values: Sequence[Value], criteria: Criteria, origin: Origin
) -> Iterator[Comparison]:
    for pair in pairs_of(topic, values, origin):
        yield from t_and_rank_tests(pair, criteria.alpha)
        yield smaller_error(pair)


def _cop_rmse(topic: Topic, values: Sequence[Value], criteria: Criteria) -> Iterator[Comparison]:
    yield from _errors(topic, values, criteria, "published")


def _posturography(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    """The published groups; RM+mass, whose centre of pressure is RM's, is no fourth."""
    methods = (MEASURED, OM, RM)
    table = per_participant(values, methods)
    yield from methods_beside_each_other(topic, table, methods, criteria.alpha)
    for pair in pairs_of(topic, values, "added"):
        if pair.rival != RM:
            yield from t_and_rank_tests(pair, criteria.alpha)


def _cross_validation(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    yield from _errors(topic, values, criteria, "added")


def _six_components(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    if topic.variable.endswith("_rmse"):
        yield from _cross_validation(topic, values, criteria)
    else:
        yield from map(pair_description, pairs_of(topic, values, "published"))


def _table_or_identified(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    if all(value.method == DIFFERENCE for value in values):
        yield description(topic, DIFFERENCE, per_participant(values, (DIFFERENCE,))[:, 0])
        return
    for pair in pairs_of(topic, values, "added"):
        yield from t_and_rank_tests(pair, criteria.alpha)


_TABLES: dict[str, Callable[[Topic, Sequence[Value], Criteria], Iterator[Comparison]]] = {
    "table1": _segment_mass,
    "table2": _cop_rmse,
    "table3": _posturography,
    "table4": _cross_validation,
    "table5": _six_components,
    "table6": _table_or_identified,
}
