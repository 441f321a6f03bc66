"""OM against RM over the participants: the published t test, and what stands beside it.

All functions take samples of shape (participants,), x of OM and y of RM, in the topic's unit.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bsip_cli.statistics.cohort_comparison import Comparison
from bsip_cli.statistics.cohort_values import OM, RM, Topic
from bsip_cli.statistics.normality import NormalityTest, lilliefors_test
from bsip_cli.statistics.paired_tests import (
    MINIMUM_FOR_WILCOXON,
    EquivalenceTest,
    PairedComparison,
    equivalence_tost,
    paired_t,
    wilcoxon,
)
from bsip_cli.statistics.samples import finite_pairs, finite_values, mean_of, standard_deviation

Sample = NDArray[np.float64]


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


def pair_description(topic: Topic, x: Sample, y: Sample) -> Comparison:
    """Means and SDs of the participants with both methods, without a test."""
    x, y = finite_pairs(x, y)
    return Comparison(
        topic,
        "description",
        "published",
        OM,
        RM,
        n=len(x),
        mean_a=mean_of(x),
        sd_a=standard_deviation(x),
        mean_b=mean_of(y),
        sd_b=standard_deviation(y),
        difference=mean_of(x - y),
    )


def t_and_rank_tests(
    topic: Topic, x: Sample, y: Sample, alpha: float, origin: Literal["published", "added"]
) -> tuple[Comparison, ...]:
    """Paired t test with Cohen's d as printed; beside it d_z, and Wilcoxon's test."""
    test = paired_t(x, y, 1.0 - alpha)
    normality = lilliefors_test(np.subtract(*finite_pairs(x, y)), alpha)
    published = _t_row(topic, test, origin, normality)
    paired_effect = Comparison(
        topic,
        "d_z",
        "added",
        OM,
        RM,
        test.n,
        difference=test.mean_difference,
        effect_size=test.d_paired,
        effect_size_name="d_z",
        reason=test.reason,
    )
    ranks = wilcoxon(x, y)
    by_rank = Comparison(
        topic,
        "wilcoxon",
        "added",
        OM,
        RM,
        ranks.n,
        difference=ranks.hodges_lehmann,
        statistic=ranks.w,
        p_value=ranks.p,
        effect_size=ranks.rank_biserial,
        effect_size_name="rank-biserial",
        reason=ranks.reason,
    )
    return published, paired_effect, by_rank


def _t_row(
    topic: Topic,
    test: PairedComparison,
    origin: Literal["published", "added"],
    normality: NormalityTest,
) -> Comparison:
    return Comparison(
        topic,
        "paired_t",
        origin,
        OM,
        RM,
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
        effect_size_name="Cohen's d (pooled SD, RM - OM)",
        lilliefors_p=normality.p_value,
        reason=test.reason or normality.reason,
    )


def equivalence(topic: Topic, x: Sample, y: Sample, alpha: float, percent: float) -> Comparison:
    """Do x and y differ by less than so many percent of the mean of y? p of the weaker side."""
    bound = abs(mean_of(finite_pairs(x, y)[1])) * percent / 100.0
    test = equivalence_tost(x, y, bound, alpha)
    return Comparison(
        topic,
        "tost",
        "added",
        OM,
        RM,
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


def smaller_error(topic: Topic, x: Sample, y: Sample) -> Comparison:
    """In how many participants each method has the smaller error, with the exact sign test."""
    x, y = finite_pairs(x, y)
    om, rm = int(np.sum(x < y)), int(np.sum(y < x))
    possible = om + rm >= MINIMUM_FOR_WILCOXON
    return Comparison(
        topic,
        "sign",
        "added",
        OM,
        RM,
        n=len(x),
        p_value=float(stats.binomtest(om, om + rm).pvalue) if possible else np.nan,
        effect_size=om / len(x) if len(x) else np.nan,
        effect_size_name="share of participants in whom OM has the smaller error",
        count_a=om,
        count_b=rm,
        reason=""
        if possible
        else (
            f"The sign test needs {MINIMUM_FOR_WILCOXON} pairs that differ to reach p < 0.05, "
            f"there are {om + rm}."
        ),
    )
