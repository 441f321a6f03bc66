"""Table 4: errors of the centre of pressure and of the vertical force, movement by movement."""

from __future__ import annotations

from bsip_cli.report.tables import labels, notes, paired
from bsip_cli.report.tables.model import Column, Results, Row, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Topic

NAME = "table4_cross_validation"

_QUANTITIES = {
    "cop_error": "COP error",
    "grf_vertical": "Vertical GRF",
    "cop_ap": "COP error AP",
    "cop_ml": "COP error ML",
}
"""Groups of rows; the first two as in print."""


def build(results: Results, criteria: Criteria) -> Table:
    order = list(_QUANTITIES)
    topics = sorted(
        results.topics, key=lambda t: (order.index(t.variable), t.role == "sequence", t.task)
    )
    tests = [results.find(topic, "paired_t") for topic in topics]
    named = {topic: f"{_QUANTITIES[topic.variable]}, {topic.task}" for topic in topics}
    return Table(
        NAME,
        "Table 4. Errors of the simulated centre of pressure (COP) and vertical ground force (GRF)"
        f" by movement: mean (standard deviation) of {notes.participants(tests)}.",
        (
            Column(("quantity",)),
            Column(("task",)),
            Column(("role",)),
            Column(("label",), "Movement", text=True),
            paired.participants(),
            *paired.means(),
            *paired.t_test(criteria),
            *paired.added_tests(),
            *paired.against_rm_mass(criteria),
            *paired.smaller_error(),
            Column(("reason",)),
        ),
        tuple(_row(results, topic, criteria) for topic in topics),
        tuple(
            filter(
                None,
                (
                    notes.star_legend(criteria.alpha),
                    "COP error: root mean square of the distance in the plane, sqrt(AP² + ML²); several "
                    "runs of a movement are averaged for each participant first.",
                    "As published: means and standard deviations. Added: everything else (paired t test of "
                    "OM - RM, Cohen's d = (RM - OM) / pooled SD, Wilcoxon's test, d_z = mean / SD of the "
                    "differences, in how many participants OM or its rival has the smaller error). The same count "
                    "for the six components stands in table 5.",
                    paired.LEGEND,
                    notes.normality_legend(criteria.alpha),
                    notes.holm_legend(tests, criteria.alpha),
                    *notes.not_possible(results, named),
                ),
            )
        ),
    )


def _row(results: Results, topic: Topic, criteria: Criteria) -> Row:
    values = {
        "quantity": topic.variable,
        "task": topic.task,
        "role": topic.role,
        "label": labels.task(topic),
        **paired.values(results, topic),
    }
    marks = paired.marks(results, topic, criteria)
    group = f"{_QUANTITIES[topic.variable]} [{labels.unit(topic.unit)}]"
    return Row(values, topic.unit, group, marks)
