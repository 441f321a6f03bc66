"""Table 3: sway measures of the measured and the simulated centre of pressure."""

from __future__ import annotations

from itertools import combinations

from bsip_cli.report.tables import labels, notes, paired
from bsip_cli.report.tables.labels import mean_sd, number, p_value
from bsip_cli.report.tables.model import Cell, Column, Results, Row, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Comparison, Topic
from bsip_cli.statistics.methods import MEASURED, OM, RM

NAME = "table3_posturography"

_NAMES = {
    "mean_velocity": "MV",
    "sway_length": "SL",
    "ellipse_area": "SA",
    "rms_ap": "RMS AP",
    "rms_ml": "RMS ML",
    "rms_ap_origin": "RMS AP",
    "rms_ml_origin": "RMS ML",
}
_SHORT = {MEASURED: "fp"} | paired.SHORT
_PAIRS = tuple(combinations((MEASURED, OM, RM), 2))
_MARKS = {
    (MEASURED, OM): ("OM M(SD)", "#"),
    (MEASURED, RM): ("RM M(SD)", "*"),
    (OM, RM): ("RM M(SD)", "+"),
}
"""Where the sign of a post hoc difference stands, and which it is, after the print."""

ALL = " / ".join((MEASURED, OM, RM))


def build(results: Results, criteria: Criteria) -> Table:
    tests = [results.find(topic, "one_way_anova", ALL, "") for topic in results.topics]
    named = {topic: label(topic) for topic in results.topics}
    tasks = ", ".join(dict.fromkeys(topic.task for topic in results.topics)) or "none"
    alpha = criteria.alpha
    return Table(
        NAME,
        "Table 3. Sway of the centre of pressure, measured (FP) and simulated (OM, RM, RM+mass), in "
        f"the identification sequence (task: {tasks}): mean (standard deviation) of "
        f"{notes.participants(tests)}.",
        _columns(criteria),
        tuple(_row(results, topic, criteria) for topic in results.topics),
        tuple(
            filter(
                None,
                (
                    f"Bonferroni post hoc p < {alpha:g}: * between FP and RM; + between OM and RM; # "
                    "between FP and OM. MV mean velocity, SL sway length, SA area of the 95 % prediction "
                    "ellipse, RMS about the mean.",
                    "As published: one-way ANOVA (F, p), as if FP, OM and RM were three groups of people, "
                    "with its post hoc tests. Added: ANOVA for repeated measures, because they are the "
                    "same people, with Greenhouse and Geisser's correction (epsilon); its post hoc tests "
                    "are in the CSV.",
                    paired.LEGEND,
                    *notes.not_possible(results, named),
                ),
            )
        ),
    )


def label(topic: Topic) -> str:
    about = " (origin)" if topic.variable.endswith("_origin") else ""
    return f"{_NAMES[topic.variable]}{about} [{labels.unit(topic.unit)}]"


def _columns(criteria: Criteria) -> tuple[Column, ...]:
    post_hoc = [
        Column((f"{kind}_{_SHORT[a]}_{_SHORT[b]}",))
        for kind in ("bonferroni_p", "repeated_bonferroni_p")
        for a, b in _PAIRS
    ]
    return (
        Column(("variable",)),
        Column(("label",), "Variable", text=True),
        Column(("n",)),
        Column(("fp_mean", "fp_sd"), "FP M(SD)", mean_sd(2), in_row_unit=True),
        *paired.means(),
        Column(("f",), "F", number(2)),
        Column(("df1",)),
        Column(("df2",)),
        Column(("p",), "p", p_value),
        Column(("eta_squared",)),
        Column(("lilliefors_p_smallest",)),
        Column(("repeated_f",), "F repeated", number(2)),
        Column(("repeated_df1",)),
        Column(("repeated_df2",)),
        Column(("repeated_p",), "p repeated", p_value),
        Column(("repeated_epsilon",), "epsilon", number(2)),
        Column(("repeated_partial_eta_squared",)),
        *post_hoc,
        *paired.against_rm_mass(criteria),
        Column(("reason",)),
    )


def _row(results: Results, topic: Topic, criteria: Criteria) -> Row:
    one_way = results.find(topic, "one_way_anova", ALL, "")
    repeated = results.find(topic, "repeated_measures_anova", ALL, "")
    values: dict[str, Cell] = {
        **paired.values(results, topic),
        "variable": topic.variable,
        "label": label(topic),
        "n": one_way.n,
        "f": one_way.statistic,
        "df1": one_way.df1,
        "df2": one_way.df2,
        "p": one_way.p_value,
        "eta_squared": one_way.effect_size,
        "lilliefors_p_smallest": one_way.lilliefors_p,
        "repeated_f": repeated.statistic,
        "repeated_df1": repeated.df1,
        "repeated_df2": repeated.df2,
        "repeated_p": repeated.p_value,
        "repeated_epsilon": repeated.epsilon,
        "repeated_partial_eta_squared": repeated.effect_size,
        "reason": results.reasons(topic),
    }
    marks = paired.marks(results, topic, criteria)
    for pair in _PAIRS:
        published = results.find(topic, "bonferroni_t", *pair)
        added = results.find(topic, "bonferroni_paired_t", *pair)
        values |= _means(published)
        ending = "_".join(_SHORT[method] for method in pair)
        values[f"bonferroni_p_{ending}"] = published.p_value
        values[f"repeated_bonferroni_p_{ending}"] = added.p_value
        heading, sign = _MARKS[pair]
        marks[heading] = notes.star(published, criteria.alpha, sign) + marks.get(heading, "")
    return Row(values, topic.unit, marks=marks)


def _means(pair: Comparison) -> dict[str, Cell]:
    a, b = _SHORT[pair.method_a], _SHORT[pair.method_b]
    return {
        f"{a}_mean": pair.mean_a,
        f"{a}_sd": pair.sd_a,
        f"{b}_mean": pair.mean_b,
        f"{b}_sd": pair.sd_b,
    }
