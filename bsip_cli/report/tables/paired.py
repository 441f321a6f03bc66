"""The columns that tables 1, 2 and 4 share: OM beside RM, with the paired tests."""

from __future__ import annotations

from bsip_cli.report.tables.model import Cell, Column
from bsip_cli.report.tables.numbers import count, counts_of, interval, mean_sd, number, p_value
from bsip_cli.report.tables.results import Results
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Topic

P = "p"
"""Heading of the column that carries the stars."""

BETTER = "smaller error OM : RM"


def means() -> tuple[Column, ...]:
    return (
        Column(("om_mean", "om_sd"), "OM M(SD)", mean_sd(2), in_row_unit=True),
        Column(("rm_mean", "rm_sd"), "RM M(SD)", mean_sd(2), in_row_unit=True),
    )


def t_test(criteria: Criteria) -> tuple[Column, ...]:
    confidence = f"{100.0 * (1.0 - criteria.alpha):g}% CI"
    return (
        Column(("difference",), in_row_unit=True),
        Column(("ci_low", "ci_high"), confidence, interval(2), in_row_unit=True),
        Column(("t",), "t", number(2)),
        Column(("df",)),
        Column(("p",), P, p_value),
        Column(("p_holm",)),
        Column(("cohens_d_pooled",), "Cohen's d", number(2)),
        Column(("lilliefors_p",), "Lilliefors p", p_value),
    )


def added_tests() -> tuple[Column, ...]:
    return (
        Column(("wilcoxon_w",)),
        Column(("wilcoxon_p",), "Wilcoxon p", p_value),
        Column(("rank_biserial",)),
        Column(("d_z",), "d_z", number(2)),
    )


def smaller_error() -> tuple[Column, ...]:
    return (
        Column(("om_smaller", "rm_smaller", "n"), BETTER, counts_of),
        Column(("om_smaller_share",)),
        Column(("sign_test_p",)),
    )


def participants() -> Column:
    return Column(("n",), "n", count)


def values(results: Results, topic: Topic) -> dict[str, Cell]:
    """The numbers of all these columns."""
    t, effect = results.find(topic, "paired_t"), results.find(topic, "d_z")
    ranks, sign = results.find(topic, "wilcoxon"), results.find(topic, "sign")
    return {
        "n": t.n,
        "om_mean": t.mean_a,
        "om_sd": t.sd_a,
        "rm_mean": t.mean_b,
        "rm_sd": t.sd_b,
        "difference": t.difference,
        "ci_low": t.ci_low,
        "ci_high": t.ci_high,
        "t": t.statistic,
        "df": t.df1,
        "p": t.p_value,
        "p_holm": t.p_holm,
        "cohens_d_pooled": t.effect_size,
        "lilliefors_p": t.lilliefors_p,
        "wilcoxon_w": ranks.statistic,
        "wilcoxon_p": ranks.p_value,
        "rank_biserial": ranks.effect_size,
        "d_z": effect.effect_size,
        "om_smaller": sign.count_a,
        "rm_smaller": sign.count_b,
        "om_smaller_share": sign.effect_size,
        "sign_test_p": sign.p_value,
        "reason": results.reasons(topic),
    }
