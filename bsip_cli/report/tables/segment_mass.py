"""Table 1: the masses of the segments, identified and from the regression."""

from __future__ import annotations

from bsip_cli.report.tables import labels, notes, paired
from bsip_cli.report.tables.labels import number, p_value
from bsip_cli.report.tables.model import Column, Results, Row, Table
from bsip_cli.statistics.cohort import DATA_SHARE, Criteria
from bsip_cli.statistics.cohort_values import Topic
from bsip_cli.statistics.methods import OM

NAME = "table1_segment_mass"


def build(results: Results, criteria: Criteria) -> Table:
    segments = [t for t in results.topics if not t.variable.endswith(DATA_SHARE)]
    segments.sort(key=lambda topic: labels.segment_rank(topic.variable))
    tests = [results.find(topic, "paired_t") for topic in segments]
    named = {topic: labels.segment(topic.variable) for topic in segments}
    return Table(
        NAME,
        "Table 1. Mass of the segments [kg], identified from ground forces (OM), from the regression "
        f"(RM), and from the regression times one number (RM+mass): mean (standard deviation) of {notes.participants(tests)}.",
        _columns(criteria),
        tuple(_row(results, topic, criteria) for topic in segments),
        tuple(
            filter(
                None,
                (
                    notes.star_legend(criteria.alpha),
                    "As published: paired t test of OM - RM with its confidence interval; Cohen's d = (RM "
                    "- OM) / pooled SD; Lilliefors' test of the differences. Added: Wilcoxon's signed-rank "
                    "test; d_z = mean / SD of the differences; equivalence by two one-sided t tests, "
                    f"where p < {criteria.alpha:g} says that OM and RM differ by less than "
                    f"{criteria.equivalence_percent:g} % of RM's mean; data share.",
                    "Data share: the part of the prior's variance of OM's mass that the data removed, from "
                    "0 (the mass is the regression's) to 1 (the data alone decide), mean over participants."
                    " Masses behind spherical joints are not decided by the data alone: the ground forces "
                    "hold them only in combinations, and nearness to the regression splits these.",
                    paired.LEGEND,
                    notes.normality_legend(criteria.alpha),
                    notes.holm_legend(tests, criteria.alpha),
                    *notes.not_possible(results, named),
                ),
            )
        ),
    )


def _columns(criteria: Criteria) -> tuple[Column, ...]:
    return (
        Column(("segment",), "Segment", labels.segment, text=True),
        Column(("n",)),
        *paired.means(),
        *paired.t_test(criteria),
        *paired.added_tests(),
        *paired.against_rm_mass(criteria),
        Column(("equivalence_bound",), in_row_unit=True),
        Column(("equivalence_t",)),
        Column(("equivalence_p",), "equivalence p", p_value),
        Column(("mass_data_share",), "data share", number(2)),
        Column(("mass_data_share_sd",)),
        Column(("reason",)),
    )


def _row(results: Results, topic: Topic, criteria: Criteria) -> Row:
    of_share = Topic(topic.table, topic.variable + DATA_SHARE, topic.task, topic.role, "1")
    share = results.find(of_share, "description", OM, "")
    equivalence = results.find(topic, "tost")
    values = {
        "segment": topic.variable,
        **paired.values(results, topic),
        "equivalence_bound": equivalence.bound,
        "equivalence_t": equivalence.statistic,
        "equivalence_p": equivalence.p_value,
        "mass_data_share": share.mean_a,
        "mass_data_share_sd": share.sd_a,
    }
    marks = paired.marks(results, topic, criteria)
    return Row(values, topic.unit, marks=marks)
