"""The tables of paired tests (1, 2, 4 and 6): OM beside its rivals RM and RM+mass."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from bsip_cli.report.tables import labels, notes
from bsip_cli.report.tables.labels import count, counts_of, interval, mean_sd, number, p_value
from bsip_cli.report.tables.model import Cell, Column, Results, Row, Table
from bsip_cli.report.words import segment_label
from bsip_cli.statistics.cohort import DATA_SHARE, Criteria
from bsip_cli.statistics.cohort_values import DIFFERENCE, Topic
from bsip_cli.statistics.methods import OM, RIVALS, RM, RM_MASS
from bsip_cli.statistics.published.paper import load_paper

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


# --- the tables ---------------------------------------------------------------------------------

_TESTS = (
    "As published: paired t test of OM - RM with its confidence interval; Cohen's d = (RM - OM) / "
    "pooled SD; Lilliefors' test of the differences. Added: Wilcoxon's signed-rank test; d_z = mean "
    "/ SD of the differences; "
)
_SMALLER = "in how many participants OM or its rival has the smaller error"
_AXES = {"cop_ap": "AP", "cop_ml": "ML"}
_QUANTITIES = {
    "cop_error": "COP error",
    "grf_vertical": "Vertical GRF",
    "cop_ap": "COP error AP",
    "cop_ml": "COP error ML",
}
"""Groups of rows of table 4; the first two as in print."""

_RESIDUALS = {"force_residual": "force", "moment_residual": "moment"}
_OVER_SEGMENTS = {"mean": "mean", "median": "median", "max": "largest"}
_COM = "com_"


def _table(
    name: str,
    title: str,
    columns: tuple[Sequence[Column], Sequence[Column]],
    named: Mapping[Topic, str],
    row: Callable[[Topic], tuple[dict[str, Cell], str]],
    legend: Sequence[str],
    given: tuple[Results, Criteria],
) -> Table:
    """``columns``: those before the tests, and after them. ``named``: the label of each topic, a row
    each. ``row``: its own values, and its group."""
    results, criteria = given
    rows = []
    for topic in named:
        own, group = row(topic)
        found = values(results, topic) | own
        rows.append(Row(found, topic.unit, group, marks(results, topic, criteria)))
    said = (notes.star_legend(criteria.alpha), *legend, *notes.not_possible(results, named))
    before, after = columns
    tests = (*t_test(criteria), *added_tests(), *against_rm_mass(criteria))
    return Table(
        name,
        title,
        (*before, *tests, *after, Column(("reason",))),
        tuple(rows),
        tuple(filter(None, said)),
    )


def segment_mass(results: Results, criteria: Criteria) -> Table:
    """Table 1: the masses of the segments."""
    segments = [t for t in results.topics if not t.variable.endswith(DATA_SHARE)]
    segments.sort(key=lambda topic: labels.segment_rank(topic.variable))
    tests = [results.find(topic, "paired_t") for topic in segments]

    def row(topic: Topic) -> tuple[dict[str, Cell], str]:
        of_share = Topic(topic.table, topic.variable + DATA_SHARE, topic.task, topic.role, "1")
        share = results.find(of_share, "description", OM, "")
        equivalence = results.find(topic, "tost")
        own: dict[str, Cell] = {
            "segment": topic.variable,
            "equivalence_bound": equivalence.bound,
            "equivalence_t": equivalence.statistic,
            "equivalence_p": equivalence.p_value,
            "mass_data_share": share.mean_a,
            "mass_data_share_sd": share.sd_a,
        }
        return own, ""

    return _table(
        "table1_segment_mass",
        "Table 1. Mass of the segments [kg], identified from ground forces (OM), from the "
        "regression (RM), and from the regression times one number (RM+mass): mean (standard "
        f"deviation) of {notes.participants(tests)}.",
        (
            (
                Column(("segment",), "Segment", segment_label, text=True),
                Column(("n",)),
                *means(),
            ),
            (
                Column(("equivalence_bound",), in_row_unit=True),
                Column(("equivalence_t",)),
                Column(("equivalence_p",), "equivalence p", p_value),
                Column(("mass_data_share",), "data share", number(2)),
                Column(("mass_data_share_sd",)),
            ),
        ),
        {topic: segment_label(topic.variable) for topic in segments},
        row,
        (
            f"{_TESTS}equivalence by two one-sided t tests, where p < {criteria.alpha:g} says that "
            f"OM and RM differ by less than {criteria.equivalence_percent:g} % of RM's mean; data "
            "share.",
            "Data share: the part of the prior's variance of OM's mass that the data removed, from "
            "0 (the mass is the regression's) to 1 (the data alone decide), mean over participants. "
            "Masses behind spherical joints are not decided by the data alone: the ground forces "
            "hold them only in combinations, and nearness to the regression splits these.",
            LEGEND,
            notes.normality_legend(criteria.alpha),
            notes.holm_legend(tests, criteria.alpha),
        ),
        (results, criteria),
    )


def cop_rmse(results: Results, criteria: Criteria) -> Table:
    """Table 2: error of the centre of pressure in the identification sequence."""
    tests = [results.find(topic, "paired_t") for topic in results.topics]
    tasks = ", ".join(dict.fromkeys(topic.task for topic in results.topics)) or "none"
    return _table(
        "table2_cop_rmse",
        "Table 2. RMSE of the simulated centre of pressure against the force plate [mm] in the "
        f"identification sequence (task: {tasks}): mean (standard deviation) of "
        f"{notes.participants(tests)}.",
        (
            (
                Column(("axis",), "RMSE", _AXES.__getitem__, text=True),
                *([] if len({test.n for test in tests}) < 2 else [participants()]),
                *means(),
            ),
            smaller_error(),
        ),
        {topic: _AXES[topic.variable] for topic in results.topics},
        lambda topic: ({"axis": topic.variable}, ""),
        (
            f"{_TESTS}{_SMALLER}. AP and ML are the person's own axes.",
            LEGEND,
            notes.normality_legend(criteria.alpha),
        ),
        (results, criteria),
    )


def cross_validation(results: Results, criteria: Criteria) -> Table:
    """Table 4: errors of the centre of pressure and of the vertical force by movement."""
    order = list(_QUANTITIES)
    topics = sorted(
        results.topics, key=lambda t: (order.index(t.variable), t.role == "sequence", t.task)
    )
    tests = [results.find(topic, "paired_t") for topic in topics]

    def row(topic: Topic) -> tuple[dict[str, Cell], str]:
        own: dict[str, Cell] = {
            "quantity": topic.variable,
            "task": topic.task,
            "role": topic.role,
            "label": labels.task(topic),
        }
        return own, f"{_QUANTITIES[topic.variable]} [{labels.unit(topic.unit)}]"

    return _table(
        "table4_cross_validation",
        "Table 4. Errors of the simulated centre of pressure (COP) and vertical ground force (GRF)"
        f" by movement: mean (standard deviation) of {notes.participants(tests)}.",
        (
            (
                *(Column((name,)) for name in ("quantity", "task", "role")),
                Column(("label",), "Movement", text=True),
                participants(),
                *means(),
            ),
            smaller_error(),
        ),
        {topic: f"{_QUANTITIES[topic.variable]}, {topic.task}" for topic in topics},
        row,
        (
            "COP error: root mean square of the distance in the plane, sqrt(AP² + ML²); several "
            "runs of a movement are averaged for each participant first.",
            "As published: means and standard deviations. Added: everything else (paired t test of "
            "OM - RM, Cohen's d = (RM - OM) / pooled SD, Wilcoxon's test, d_z = mean / SD of the "
            f"differences, {_SMALLER}). The same count for the six components stands in table 5.",
            LEGEND,
            notes.normality_legend(criteria.alpha),
            notes.holm_legend(tests, criteria.alpha),
        ),
        (results, criteria),
    )


def centres_of_mass(results: Results, criteria: Criteria) -> Table:
    """Table 6: what identification changes, as Robert 2017 compares it."""
    topics = sorted(results.topics, key=_rank)
    tests = [results.find(topic, "paired_t") for topic in topics if topic.variable in _RESIDUALS]
    named = {topic: _quantity(topic) for topic in topics}

    def row(topic: Topic) -> tuple[dict[str, Cell], str]:
        apart = results.find(topic, "description", DIFFERENCE, "")
        own: dict[str, Cell] = {
            "variable": topic.variable,
            "label": named[topic],
            "apart_mean": apart.mean_a,
            "apart_sd": apart.sd_a,
        }
        if topic.variable in _RESIDUALS:
            return own, "Residual"
        return own | {"n": apart.n}, "Centres of mass along the segments"

    return _table(
        "table6_centres_of_mass",
        "Table 6. Residual of the ground wrench in the identification sequence, and how far the "
        "identified centres of mass (OM) lie from the regression's (RM) along the segments: mean "
        f"(standard deviation) of {notes.participants(tests)}.",
        (
            (
                Column(("variable",)),
                Column(("label",), "Quantity", text=True),
                participants(),
                *means(),
                Column(("apart_mean", "apart_sd"), "|OM - RM| M(SD)", mean_sd(2), in_row_unit=True),
            ),
            (),
        ),
        named,
        row,
        (
            "As published (Robert 2017, table 1): residuals of force and moment, and mean, median "
            "and largest distance of the centres of mass over a person's segments, along each "
            "segment's Y axis: its length, of a foot its height. Added: the tests, and each segment. "
            "Residuals are root mean squares of the error as a vector, the moment about the lab's "
            "origin, so that it grows with the plate's distance from there.",
            LEGEND,
            f"In print, of single people: {'; '.join(_in_print())}.",
        ),
        (results, criteria),
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


def _quantity(topic: Topic) -> str:
    name = topic.variable.removeprefix(_COM)
    whose = _RESIDUALS.get(name) or _OVER_SEGMENTS.get(name) or segment_label(name)
    return f"{whose} [{labels.unit(topic.unit)}]"
