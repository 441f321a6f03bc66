"""Table 6: what identification changes, as Robert 2017 compares it: residual and centres of mass."""

from __future__ import annotations

from collections.abc import Iterator

from bsip_cli.report.tables import labels, notes, paired
from bsip_cli.report.tables.labels import mean_sd
from bsip_cli.report.tables.model import Column, Results, Row, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import DIFFERENCE, Topic
from bsip_cli.statistics.published.paper import load_paper

NAME = "table6_centres_of_mass"

_RESIDUALS = {"force_residual": "force", "moment_residual": "moment"}
_OVER_SEGMENTS = {"mean": "mean", "median": "median", "max": "largest"}
_COM = "com_"
_APART = "|OM - RM| M(SD)"


def build(results: Results, criteria: Criteria) -> Table:
    topics = sorted(results.topics, key=_rank)
    tests = [results.find(topic, "paired_t") for topic in topics if topic.variable in _RESIDUALS]
    named = {topic: _label(topic) for topic in topics}
    return Table(
        NAME,
        "Table 6. Residual of the ground wrench in the identification sequence, and how far the "
        "identified centres of mass (OM) lie from the regression's (RM) along the segments: mean "
        f"(standard deviation) of {notes.participants(tests)}.",
        (
            Column(("variable",)),
            Column(("label",), "Quantity", text=True),
            paired.participants(),
            *paired.means(),
            Column(("apart_mean", "apart_sd"), _APART, mean_sd(2), in_row_unit=True),
            *paired.t_test(criteria),
            *paired.added_tests(),
            *paired.against_rm_mass(criteria),
            Column(("reason",)),
        ),
        tuple(_row(results, topic, criteria) for topic in topics),
        (
            notes.star_legend(criteria.alpha),
            "As published (Robert 2017, table 1): residuals of force and moment, and mean, median "
            "and largest distance of the centres of mass over a person's segments, along each "
            "segment's Y axis: its length, of a foot its height. Added: the tests, and each segment. "
            "Residuals are root mean squares of the error as a vector, the moment about the lab's "
            "origin, so that it grows with the plate's distance from there.",
            paired.LEGEND,
            f"In print, of single people: {'; '.join(_in_print())}.",
            *notes.not_possible(results, named),
        ),
    )


def _in_print() -> Iterator[str]:
    """The published cases: residuals, then mean, median and largest distance."""
    for row in load_paper("robert2017").table(1).rows:
        force, moment, *apart = (cell.text for cell in row.cells.values())
        yield f"{row.name} {force} N, {moment} N m; {', '.join(apart)} m"


def _rank(topic: Topic) -> tuple[int, int]:
    """Residuals, then over the segments, then segment by segment."""
    order = [*_RESIDUALS, *(_COM + name for name in _OVER_SEGMENTS)]
    place = order.index(topic.variable) if topic.variable in order else len(order)
    return place, labels.segment_rank(topic.variable.removeprefix(_COM))


def _label(topic: Topic) -> str:
    if topic.variable in _RESIDUALS:
        return f"{_RESIDUALS[topic.variable]} [{labels.unit(topic.unit)}]"
    name = topic.variable.removeprefix(_COM)
    whose = _OVER_SEGMENTS.get(name) or labels.segment(name)
    return f"{whose} [{labels.unit(topic.unit)}]"


def _row(results: Results, topic: Topic, criteria: Criteria) -> Row:
    apart = results.find(topic, "description", DIFFERENCE, "")
    values = {
        "variable": topic.variable,
        "label": _label(topic),
        **paired.values(results, topic),
        "apart_mean": apart.mean_a,
        "apart_sd": apart.sd_a,
    }
    is_residual = topic.variable in _RESIDUALS
    if not is_residual:
        values["n"] = apart.n
    group = "Residual" if is_residual else "Centres of mass along the segments"
    marks = paired.marks(results, topic, criteria)
    return Row(values, topic.unit, group, marks)
