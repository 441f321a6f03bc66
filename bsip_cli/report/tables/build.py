"""The papers' six tables, from the cohort's results to text; here those of sway and components."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from bsip_cli.report.tables import model, paired, published
from bsip_cli.report.tables.formats import to_csv, to_latex, to_markdown
from bsip_cli.report.tables.model import (
    Cell,
    Column,
    Results,
    Row,
    Table,
    column,
    count,
    mean_sd,
    unit_label,
)
from bsip_cli.report.tables.paired import REASON, SHORT
from bsip_cli.statistics.cohort import Comparison, Criteria, Topic, all_reasons
from bsip_cli.statistics.methods import MEASURED, OM, RM

# --- table 3: sway of the measured and the simulated centre of pressure ---------------------------

_MARKS = {
    (MEASURED, OM): ("OM M(SD)", "#"),
    (MEASURED, RM): ("RM M(SD)", "*"),
    (OM, RM): ("RM M(SD)", "+"),
}
"""Where the sign of a post hoc difference stands, and which it is, after the print."""

_ALL = " / ".join((MEASURED, OM, RM)), ""


def _posturography(results: Results, criteria: Criteria) -> Table:
    alpha, short = criteria.alpha, {MEASURED: "fp"} | SHORT
    measured = "bonferroni_t.mean_a bonferroni_t.sd_a"
    tests_after = {"bonferroni_p": "bonferroni_t", "repeated_bonferroni_p": "bonferroni_paired_t"}
    post_hoc = [
        column(f"{kind}_{short[a]}_{short[b]}", f"{test}.p_value", pair=(a, b))
        for (kind, test), (a, b) in product(tests_after.items(), _MARKS)
    ]
    columns = (
        Column(("variable",)),
        Column(("label",), "Variable", text=True),
        column("n", "one_way_anova.n", pair=_ALL),
        column("fp_mean fp_sd", measured, "FP M(SD)", mean_sd(2), (MEASURED, RM), True),
        *paired.means("bonferroni_t"),
        *model.columns("anova", _ALL),
        *post_hoc,
        *paired.against_rm_mass(criteria),
        REASON,
    )
    named = {t: f"{model.TEXTS['sway'][t.variable]} [{unit_label(t.unit)}]" for t in results.topics}
    rows = []
    for topic, label in named.items():
        own = {"variable": topic.variable, "label": label, "reason": results.reasons(topic)}
        marks = paired.stars(results, topic, criteria)
        for pair, (heading, sign) in _MARKS.items():
            differs = model.star(results.find(topic, "bonferroni_t", *pair), alpha, sign)
            marks[heading] = differs + marks.get(heading, "")
        rows.append(Row(results.values(topic, columns) | own, topic.unit, marks=marks))
    tests = [results.find(topic, "one_way_anova", *_ALL) for topic in results.topics]
    title, legend = model.texts_of(NAMES[2], results, tests, criteria)
    notes = (*legend, *model.not_possible(results, named))
    return Table(NAMES[2], title, columns, tuple(rows), notes)


# --- table 5: the six components of the ground wrench, movement by movement (Hansen 2014) ---------

_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_MEASURES = {"rmse": "rmse", "pearson_r": "r", "schwer_m": "m", "schwer_p": "p", "schwer_c": "c"}
"""Measure of the data: its name in the CSV."""

_DIFFER = "r differs OM : RM"


def _six_components(results: Results, criteria: Criteria) -> Table:
    errors = [topic for topic in results.topics if topic.variable.endswith("_rmse")]
    errors.sort(key=lambda t: (t.role == "sequence", t.task, _COMPONENTS.index(t.variable[:2])))
    of_error = list(_errors_of_six())
    of_r = model.columns("correlations", differ=_DIFFER)
    named: dict[Topic, str] = {}
    rows = []
    for topic in errors:
        component, r = topic.variable[:2], _sibling(topic, "r")
        name = component.capitalize()
        named |= dict.fromkeys((topic, r), f"{name}, {topic.task}")
        of_topic: dict[str, Cell] = {"task": topic.task, "role": topic.role, "component": component}
        of_topic["n"] = results.find(topic, "paired_t").n
        tests = results.values(topic, of_error) | results.values(r, of_r)
        tests["label"] = f"{name} [{unit_label(topic.unit)}]"
        tests["reason"] = all_reasons(results.reasons(topic), results.reasons(r))
        for method in SHORT:  # tests stand in OM's row; those of other methods leave them empty
            own = tests if method == OM else dict.fromkeys(tests, "")
            of_method = _means_of_six(results, topic, method)
            values = {**of_topic, "method": method, **own, **of_method}
            rows.append(Row(values, topic.unit, paired.task_label(topic)))
    columns = (
        *(Column((name,)) for name in ("task", "role", "component")),
        Column(("label",), "Component", text=True),
        Column(("method",), "Method", text=True),
        Column(("n",), "n", count),
        Column(("rmse_mean", "rmse_sd"), "RMSE", mean_sd(2), in_row_unit=True),
        *(Column((f"{x.lower()}_mean", f"{x.lower()}_sd"), x, mean_sd(3)) for x in "rMPC"),
        *of_error,
        *of_r,
        REASON,
    )
    tests_of_error = [results.find(topic, "paired_t") for topic in errors]
    title, legend = model.texts_of(NAMES[4], results, tests_of_error, criteria, differ=_DIFFER)
    notes = (*legend, *model.not_possible(results, named))
    return Table(NAMES[4], title, columns, tuple(rows), notes)


def _errors_of_six() -> Iterator[Column]:
    for one in paired.smaller_error("n_paired", "sign.n"):
        yield one
        name, pair = one.fields[0], one.of[0][2:]
        if name.endswith("sign_test_p"):
            before = name.removesuffix("sign_test_p")
            yield column(f"{before}rmse_t", "paired_t.statistic", pair=pair)
            yield column(f"{before}rmse_t_p", "paired_t.p_value", pair=pair)


def _means_of_six(results: Results, topic: Topic, method: str) -> dict[str, Cell]:
    found: dict[str, Cell] = {}
    for measure, short in _MEASURES.items():
        place = (topic, "paired_t")
        if measure != "rmse":
            place = _sibling(topic, measure), "description"
        pair = results.find(*place, OM, RM if method == OM else method)
        mean, sd = (pair.mean_a, pair.sd_a) if method == OM else (pair.mean_b, pair.sd_b)
        found |= {f"{short}_mean": mean, f"{short}_sd": sd}
    return found


def _sibling(topic: Topic, measure: str) -> Topic:
    return Topic(topic.table, topic.variable[:3] + measure, topic.task, topic.role, "1")


# --- all of them ----------------------------------------------------------------------------------

BUILDERS: dict[str, Callable[[Results, Criteria], Table]] = {
    "table1": paired.segment_mass,
    "table2": paired.cop_rmse,
    "table3": _posturography,
    "table4": paired.cross_validation,
    "table5": _six_components,
    "table6": paired.centres_of_mass,
}
IN_PRINT = ("table1", "table2", "table3", "table4")
NAMES = (
    "table1_segment_mass",
    "table2_cop_rmse",
    "table3_posturography",
    "table4_cross_validation",
    "table5_six_components",
    "table6_centres_of_mass",
)
RENDERERS: dict[str, Callable[[Table], str]] = {"csv": to_csv, "md": to_markdown, "tex": to_latex}


def build_tables(
    comparisons: pd.DataFrame,
    criteria: Criteria,
    fitted_on: Sequence[Mapping[str, Any]] = (),
    missing: Sequence[Mapping[str, Any]] = (),
) -> tuple[Table, ...]:
    """The six tables as data, and the first four next to the published values.

    comparisons : the artifact of ``stats``.
    criteria : the options with which it was computed.
    fitted_on : what each task's data were to OM, as a fact of the values: ``table``, ``task``,
        ``role``, and of how many participants (``everyone``) OM was fitted to them
        (``identification``).
    missing : who is not in which tables: ``sentence`` and ``tables`` (as in `BUILDERS`).
    """
    rows = [Comparison.from_row(row) for row in comparisons.to_dict("records")]
    of_table = {tag: Results(row for row in rows if row.topic.table == tag) for tag in BUILDERS}
    tables = []
    for tag, build in BUILDERS.items():
        table = build(of_table[tag], criteria)
        absent = [str(gone["sentence"]) for gone in missing if tag in gone["tables"]]
        more = (
            *model.fitted_on(counts for counts in fitted_on if counts["table"] == tag),
            f"Missing: {model.named(absent, '; ')}." if absent else "",
        )
        tables.append(replace(table, notes=(*table.notes, *filter(None, more))))
    return (*tables, *(published.next_to_published(tag, of_table[tag]) for tag in IN_PRINT))


def folder(out: Path) -> Path:
    """Where the written tables lie."""
    return out / "group" / "tables"


def show(out: Path) -> str:
    """The written Markdown tables of an output folder, one after the other; empty without any."""
    paths = [folder(out) / f"{name}.md" for name in NAMES]
    return "\n\n".join(path.read_text(encoding="utf-8") for path in paths if path.exists())
