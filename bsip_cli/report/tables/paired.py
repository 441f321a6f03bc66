"""The columns that tables share: OM beside its rivals RM and RM+mass, with the paired tests."""

from __future__ import annotations

from dataclasses import replace

from bsip_cli.report.tables import notes
from bsip_cli.report.tables.labels import count, counts_of, interval, mean_sd, number, p_value
from bsip_cli.report.tables.model import Cell, Column, Results
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Topic
from bsip_cli.statistics.methods import OM, RIVALS, RM, RM_MASS

P = "p"
"""Heading of the column that carries the stars."""

P_RM_MASS = "p OM, RM+mass"

SHORT = {OM: "om", RM: "rm", RM_MASS: "rm_mass"}
"""Methods in the names of CSV columns."""

_PREFIX = {RM: "", RM_MASS: "rm_mass_"}
"""Of the CSV columns with tests of OM against a rival."""

LEGEND = (
    "RM+mass is RM with all masses and tensors times the one number that fits the identification "
    "trials best: what it does is no gain of identification. Its centre of pressure and its "
    "correlations are RM's. Tests of OM against RM+mass are added, those that are not printed stand "
    "in the CSV (rm_mass_...)."
)


def means() -> tuple[Column, ...]:
    return tuple(
        Column((f"{short}_mean", f"{short}_sd"), f"{method} M(SD)", mean_sd(2), in_row_unit=True)
        for method, short in SHORT.items()
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


def against_rm_mass(criteria: Criteria) -> tuple[Column, ...]:
    """The same tests with RM+mass, of which only p is printed."""
    return tuple(
        replace(
            column,
            fields=tuple(_PREFIX[RM_MASS] + name for name in column.fields),
            heading=P_RM_MASS if column.heading == P else "",
        )
        for column in (*t_test(criteria), *added_tests())
    )


def smaller_error() -> tuple[Column, ...]:
    return tuple(column for rival in RIVALS for column in _smaller_error(rival))


def _smaller_error(rival: str) -> tuple[Column, ...]:
    before = _PREFIX[rival]
    counts = (f"{before}om_smaller", f"{SHORT[rival]}_smaller", f"{before}n")
    return (
        Column(counts, f"smaller error OM : {rival}", counts_of),
        Column((f"{before}om_smaller_share",)),
        Column((f"{before}sign_test_p",)),
    )


def participants() -> Column:
    return Column(("n",), "n", count)


def marks(results: Results, topic: Topic, criteria: Criteria) -> dict[str, str]:
    """The stars of both p."""
    return {
        heading: notes.star(results.find(topic, "paired_t", OM, rival), criteria.alpha)
        for heading, rival in ((P, RM), (P_RM_MASS, RM_MASS))
    }


def values(results: Results, topic: Topic) -> dict[str, Cell]:
    """The numbers of all these columns."""
    own = results.find(topic, "paired_t")
    found: dict[str, Cell] = {"om_mean": own.mean_a, "om_sd": own.sd_a}
    for rival in RIVALS:
        found |= _against(results, topic, rival)
    return found | {"reason": results.reasons(topic)}


def _against(results: Results, topic: Topic, rival: str) -> dict[str, Cell]:
    t, effect = (results.find(topic, test, OM, rival) for test in ("paired_t", "d_z"))
    ranks, sign = (results.find(topic, test, OM, rival) for test in ("wilcoxon", "sign"))
    tests: dict[str, Cell] = {
        "n": t.n,
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
        "om_smaller_share": sign.effect_size,
        "sign_test_p": sign.p_value,
    }
    short = SHORT[rival]
    of_rival = {f"{short}_mean": t.mean_b, f"{short}_sd": t.sd_b, f"{short}_smaller": sign.count_b}
    return of_rival | {_PREFIX[rival] + name: value for name, value in tests.items()}
