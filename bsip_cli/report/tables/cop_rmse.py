"""Table 2: error of the centre of pressure in the identification sequence."""

from __future__ import annotations

from bsip_cli.report.tables import notes, paired
from bsip_cli.report.tables.model import Column, Results, Row, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Topic

NAME = "table2_cop_rmse"

_AXES = {"cop_ap": "AP", "cop_ml": "ML"}


def build(results: Results, criteria: Criteria) -> Table:
    tests = [results.find(topic, "paired_t") for topic in results.topics]
    named = {topic: _AXES[topic.variable] for topic in results.topics}
    tasks = ", ".join(dict.fromkeys(topic.task for topic in results.topics)) or "none"
    return Table(
        NAME,
        "Table 2. RMSE of the simulated centre of pressure against the force plate [mm] in the "
        f"identification sequence (task: {tasks}): mean (standard deviation) of "
        f"{notes.participants(tests)}.",
        (
            Column(("axis",), "RMSE", _AXES.__getitem__, text=True),
            *([] if len({test.n for test in tests}) < 2 else [paired.participants()]),
            *paired.means(),
            *paired.t_test(criteria),
            *paired.added_tests(),
            *paired.against_rm_mass(criteria),
            *paired.smaller_error(),
            Column(("reason",)),
        ),
        tuple(_row(results, topic, criteria) for topic in results.topics),
        tuple(
            filter(
                None,
                (
                    notes.star_legend(criteria.alpha),
                    "As published: paired t test of OM - RM with its confidence interval; Cohen's d = (RM "
                    "- OM) / pooled SD; Lilliefors' test of the differences. Added: Wilcoxon's signed-rank "
                    "test; d_z = mean / SD of the differences; in how many participants OM or its rival has the "
                    "smaller error. AP and ML are the person's own axes.",
                    paired.LEGEND,
                    notes.normality_legend(criteria.alpha),
                    *notes.not_possible(results, named),
                ),
            )
        ),
    )


def _row(results: Results, topic: Topic, criteria: Criteria) -> Row:
    values = {"axis": topic.variable, **paired.values(results, topic)}
    marks = paired.marks(results, topic, criteria)
    return Row(values, topic.unit, marks=marks)
