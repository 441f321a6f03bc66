"""Table 5: the six components of the ground wrench, movement by movement (Hansen 2014)."""

from __future__ import annotations

from bsip_cli.report.tables import labels, notes, paired
from bsip_cli.report.tables.labels import count, counts_of, mean_sd, number, p_value
from bsip_cli.report.tables.model import Cell, Column, Results, Row, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Comparison, Topic, joined
from bsip_cli.statistics.methods import OM, RM, RM_MASS

NAME = "table5_six_components"

_NAMES = {name: name[0].upper() + name[1] for name in ("fx", "fy", "fz", "mx", "my", "mz")}
_MEASURES = {"rmse": "rmse", "pearson_r": "r", "schwer_m": "m", "schwer_p": "p", "schwer_c": "c"}
"""Measure of the data: its name in the CSV."""

_DIFFER = "r differs OM : RM"


def build(results: Results, criteria: Criteria) -> Table:
    errors = [topic for topic in results.topics if topic.variable.endswith("_rmse")]
    errors.sort(key=lambda t: (t.role == "sequence", t.task, list(_NAMES).index(_component(t))))
    tests = [results.find(topic, "paired_t") for topic in errors]
    named = {
        sibling: f"{_NAMES[_component(topic)]}, {topic.task}"
        for topic in errors
        for sibling in (topic, _sibling(topic, "r"))
    }
    return Table(
        NAME,
        "Table 5. Six components of the ground wrench about the world origin, simulated against "
        f"measured: mean (standard deviation) of {notes.participants(tests)}.",
        _columns(),
        tuple(_row(results, topic, method) for topic in errors for method in paired.SHORT),
        tuple(
            filter(
                None,
                (
                    "RMSE in N for forces and N m for moments; r Pearson's correlation; M, P, C errors in "
                    "magnitude and phase and both (Schwer 2007), without unit, 0 for equal signals.",
                    "The test of r is made in each participant, with the effective number of independent "
                    "samples; t, z and p are medians over participants, positive where OM correlates "
                    f"better. '{_DIFFER}' counts those in whom r of OM, or of RM, is significantly higher "
                    f"(p < {criteria.alpha:g}) by Williams' t.",
                    "As published: RMSE, r, M, P, C, and Fisher's z, which takes the two correlations for "
                    "independent. Added: Williams' t, because they share the measured signal; in how many "
                    "participants OM or its rival has the smaller RMSE (paired t tests of the RMSE are in "
                    "the CSV). Several runs of a movement are averaged for each participant first.",
                    paired.LEGEND,
                    *notes.not_possible(results, named),
                ),
            )
        ),
    )


def _columns() -> tuple[Column, ...]:
    return (
        Column(("task",)),
        Column(("role",)),
        Column(("component",)),
        Column(("label",), "Component", text=True),
        Column(("method",), "Method", text=True),
        Column(("n",), "n", count),
        Column(("rmse_mean", "rmse_sd"), "RMSE", mean_sd(2), in_row_unit=True),
        Column(("r_mean", "r_sd"), "r", mean_sd(3)),
        Column(("m_mean", "m_sd"), "M", mean_sd(3)),
        Column(("p_mean", "p_sd"), "P", mean_sd(3)),
        Column(("c_mean", "c_sd"), "C", mean_sd(3)),
        Column(("om_smaller", "rm_smaller", "n_paired"), "smaller error OM : RM", counts_of),
        Column(("om_smaller_share",)),
        Column(("sign_test_p",)),
        Column(("rmse_t",)),
        Column(("rmse_t_p",)),
        Column(
            ("rm_mass_om_smaller", "rm_mass_smaller", "rm_mass_n_paired"),
            "smaller error OM : RM+mass",
            counts_of,
        ),
        Column(("rm_mass_om_smaller_share",)),
        Column(("rm_mass_sign_test_p",)),
        Column(("rm_mass_rmse_t",)),
        Column(("rm_mass_rmse_t_p",)),
        Column(("williams_t_median",), "Williams t", number(2)),
        Column(("williams_p_median",), "p", p_value),
        Column(("williams_om_better", "williams_rm_better", "williams_n"), _DIFFER, counts_of),
        Column(("fisher_z_median",), "Fisher z", number(2)),
        Column(("fisher_p_median",), "p (z)", p_value),
        Column(("fisher_om_better",)),
        Column(("fisher_rm_better",)),
        Column(("reason",)),
    )


def _component(topic: Topic) -> str:
    return topic.variable.partition("_")[0]


def _sibling(topic: Topic, measure: str) -> Topic:
    """The same component and task, another measure."""
    unit = topic.unit if measure == "rmse" else "1"
    return Topic(topic.table, f"{_component(topic)}_{measure}", topic.task, topic.role, unit)


def _row(results: Results, topic: Topic, method: str) -> Row:
    """OM's row carries the tests of OM against its rivals; theirs leave them empty."""
    name = _NAMES[_component(topic)]
    tests = _tests(results, topic)
    values: dict[str, Cell] = {
        "task": topic.task,
        "role": topic.role,
        "component": _component(topic),
        "method": method,
        "label": f"{name} [{labels.unit(topic.unit)}]" if method == OM else "",
        "n": results.find(topic, "paired_t").n,
        **(tests if method == OM else dict.fromkeys(tests, "")),
    }
    for measure, short in _MEASURES.items():
        test = "paired_t" if measure == "rmse" else "description"
        rival = RM if method == OM else method
        pair = results.find(_sibling(topic, measure), test, OM, rival)
        values |= _mean_and_sd(short, pair, method)
    return Row(values, topic.unit, labels.task(topic))


def _mean_and_sd(name: str, pair: Comparison, method: str) -> dict[str, Cell]:
    mean, sd = (pair.mean_a, pair.sd_a) if method == OM else (pair.mean_b, pair.sd_b)
    return {f"{name}_mean": mean, f"{name}_sd": sd}


def _tests(results: Results, topic: Topic) -> dict[str, Cell]:
    williams = results.find(_sibling(topic, "r"), "williams_t")
    fisher = results.find(_sibling(topic, "r"), "fisher_z")
    return {
        **_smaller_error(results, topic, RM, ""),
        **_smaller_error(results, topic, RM_MASS, "rm_mass_"),
        "williams_t_median": williams.statistic,
        "williams_p_median": williams.p_value,
        "williams_om_better": williams.count_a,
        "williams_rm_better": williams.count_b,
        "williams_n": williams.n,
        "fisher_z_median": fisher.statistic,
        "fisher_p_median": fisher.p_value,
        "fisher_om_better": fisher.count_a,
        "fisher_rm_better": fisher.count_b,
        "reason": joined(results.reasons(topic), results.reasons(_sibling(topic, "r"))),
    }


def _smaller_error(results: Results, topic: Topic, rival: str, before: str) -> dict[str, Cell]:
    error, sign = (results.find(topic, test, OM, rival) for test in ("paired_t", "sign"))
    return {
        f"{before}om_smaller": sign.count_a,
        f"{paired.SHORT[rival]}_smaller": sign.count_b,
        f"{before}n_paired": sign.n,
        f"{before}om_smaller_share": sign.effect_size,
        f"{before}sign_test_p": sign.p_value,
        f"{before}rmse_t": error.statistic,
        f"{before}rmse_t_p": error.p_value,
    }
