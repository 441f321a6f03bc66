"""The papers' six tables, from the cohort's results to text."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from bsip_cli.report.tables import published
from bsip_cli.report.tables.model import (
    AXES,
    TEXTS,
    Cell,
    Column,
    Results,
    Row,
    Table,
    columns,
    columns_of,
    p_value,
    to_csv,
    to_latex,
    to_markdown,
    unit_label,
)
from bsip_cli.report.words import segment_label
from bsip_cli.statistics.cohort import (
    DATA_SHARE,
    DIFFERENCE,
    Comparison,
    Criteria,
    Topic,
    all_reasons,
)
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS
from bsip_cli.statistics.published import load_paper

NAMED_AT_MOST = 6  # missing participants and rows that are named one by one


class Line(NamedTuple):
    """A row in the making: its topic, what this is called in the row and in notes, the row's group,
    and values that come from no test of it."""

    topic: Topic
    label: str
    group: str = ""
    own: Mapping[str, Cell] | None = None

    def values(self, results: Results, columns: Iterable[Column]) -> dict[str, Cell]:
        """Of all columns that its table may have."""
        name, reason = self.topic.variable, results.reasons(self.topic)
        values: dict[str, Cell] = dict.fromkeys(("segment", "axis", "variable", "quantity"), name)
        values |= {"task": self.topic.task, "role": self.topic.role, "component": name[:2]}
        values |= {"label": self.label, "reason": reason}
        return {**values, **results.values(self.topic, columns), **(self.own or {})}


Marks = Callable[[Results, Topic, Criteria], dict[str, str]]


def _stars(results: Results, topic: Topic, criteria: Criteria) -> dict[str, str]:
    """At both p of the paired tests."""
    against = {"p": RM, "p OM, RM+mass": RM_MASS}
    tests = {heading: results.find(topic, "paired_t", OM, x) for heading, x in against.items()}
    return {heading: _sign(test, criteria) for heading, test in tests.items()}


def _sign(row: Comparison, criteria: Criteria, sign: str = "*") -> str:
    """The sign if p < alpha, else nothing."""
    return sign if row.p_value < criteria.alpha else ""


@dataclass(frozen=True)
class Made:
    """What a table is made of: its name, the tests, and the options with which they were made."""

    name: str
    results: Results
    criteria: Criteria

    def table(
        self,
        lines: Sequence[Line],
        tests: Sequence[Comparison] | None = None,
        marks: Marks = _stars,
        named: Mapping[Topic, str] | None = None,
        **words: str,
    ) -> Table:
        """``tests``: whose numbers the legend sums up, if not those of OM against RM; ``named``:
        what topics are called, if not those of the lines; ``words``: what only this table says."""
        results, criteria, texts = self.results, self.criteria, TEXTS[self.name]
        words |= {"ci": f"{100.0 * (1.0 - criteria.alpha):g}% CI"}
        found = columns_of(self.name, **words)
        rows = [
            Row(x.values(results, found), x.topic.unit, x.group, marks(results, x.topic, criteria))
            for x in lines
        ]
        paired = [results.find(one.topic, "paired_t") for one in lines]
        words |= _words(results, paired if tests is None else tests, criteria)
        title, *notes = (text.format(**words) for text in (texts["title"], *texts["notes"]))
        notes += _not_possible(results, named or {one.topic: one.label for one in lines})
        return Table(self.name, title, found, tuple(rows), tuple(filter(None, notes)))


# --- the tables -----------------------------------------------------------------------------------

_LIMBS = (("upper_arm", "forearm", "hand"), ("thigh", "shank", "foot"))
_SEGMENTS = ["lower_torso", "upper_torso", "head"]
_SEGMENTS += [f"{part}_{side}" for limb in _LIMBS for side in "lr" for part in limb]
"""As in table 1 of Hansen 2017; other segments follow."""
_QUANTITIES: dict[str, str] = TEXTS["quantities"]
_RESIDUALS = {"force_residual": "force", "moment_residual": "moment"}
_OVER_SEGMENTS = {"mean": "mean", "median": "median", "max": "largest"}
_COM = "com_"


def _segment_rank(name: str) -> int:
    return _SEGMENTS.index(name) if name in _SEGMENTS else len(_SEGMENTS)


def _task_label(topic: Topic) -> str:
    """The movement; the one that identified OM is named as such."""
    identified = " (identified OM; in the paper: random, 120 s)"
    return topic.task + identified * (topic.role == "sequence")


def _segment_mass(made: Made) -> Table:
    lines = []
    for topic in sorted(made.results.topics, key=lambda topic: _segment_rank(topic.variable)):
        if not (name := topic.variable).endswith(DATA_SHARE):
            of_share = replace(topic, variable=name + DATA_SHARE, unit="1")
            share = made.results.find(of_share, "description", OM, "")
            own = {"mass_data_share": share.mean_a, "mass_data_share_sd": share.sd_a}
            lines.append(Line(topic, segment_label(name), own=own))
    return made.table(lines)


def _cop_rmse(made: Made) -> Table:
    lines = [Line(topic, AXES[topic.variable]) for topic in made.results.topics]
    table = made.table(lines)
    if len({row.values["n"] for row in table.rows}) > 1:
        return table
    return replace(table, columns=tuple(c for c in table.columns if c.fields != ("n",)))


_MARKS = {
    (MEASURED, OM): ("OM M(SD)", "#"),
    (MEASURED, RM): ("RM M(SD)", "*"),
    (OM, RM): ("RM M(SD)", "+"),
}
"""Where the sign of a post hoc difference stands, and which it is, after the print."""


def _marks_of_sway(results: Results, topic: Topic, criteria: Criteria) -> dict[str, str]:
    marks = _stars(results, topic, criteria)
    for pair, (heading, sign) in _MARKS.items():
        differs = _sign(results.find(topic, "bonferroni_t", *pair), criteria, sign)
        marks[heading] = differs + marks.get(heading, "")
    return marks


def _posturography(made: Made) -> Table:
    """Sway of the measured and the simulated centre of pressure."""
    named = {t: f"{TEXTS['sway'][t.variable]} [{unit_label(t.unit)}]" for t in made.results.topics}
    lines = [Line(topic, label) for topic, label in named.items()]
    all_three = " / ".join((MEASURED, OM, RM)), ""
    tests = [made.results.find(topic, "one_way_anova", *all_three) for topic in made.results.topics]
    return made.table(lines, tests, _marks_of_sway)


def _cross_validation(made: Made) -> Table:
    """Errors of the centre of pressure and of the vertical force by movement."""
    order, lines = list(_QUANTITIES), []
    for topic in sorted(
        made.results.topics, key=lambda t: (order.index(t.variable), t.role == "sequence", t.task)
    ):
        quantity = _QUANTITIES[topic.variable]
        group = f"{quantity} [{unit_label(topic.unit)}]"
        own = {"label": _task_label(topic)}
        lines.append(Line(topic, f"{quantity}, {topic.task}", group, own))
    return made.table(lines)


_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_MEASURES = {"rmse": "rmse", "pearson_r": "r", "schwer_m": "m", "schwer_p": "p", "schwer_c": "c"}
"""Measure of the data: its name in the CSV."""


def _six_components(made: Made) -> Table:
    """The components of the ground wrench, movement by movement (Hansen 2014); tests stand in OM's
    row, those of the other methods leave them empty."""
    errors = [topic for topic in made.results.topics if topic.variable.endswith("_rmse")]
    errors.sort(key=lambda t: (t.role == "sequence", t.task, _COMPONENTS.index(t.variable[:2])))
    differ = "r differs OM : RM"
    of_error, of_r = columns("smaller_of_six"), columns("correlations", differ=differ)
    lines: list[Line] = []
    named: dict[Topic, str] = {}
    for topic in errors:
        component, r = topic.variable[:2].capitalize(), _sibling(topic, "r")
        label = f"{component}, {topic.task}"
        named |= dict.fromkeys((topic, r), label)
        tests = made.results.values(topic, of_error) | made.results.values(r, of_r)
        tests["label"] = f"{component} [{unit_label(topic.unit)}]"
        tests["reason"] = all_reasons(made.results.reasons(topic), made.results.reasons(r))
        for method in (OM, RM, RM_MASS):
            own = tests if method == OM else dict.fromkeys(tests, "")
            more: dict[str, Cell] = {"method": method, "n": made.results.find(topic, "paired_t").n}
            means = _means_of_six(made.results, topic, method)
            lines.append(Line(topic, label, _task_label(topic), {**own, **more, **means}))
    return made.table(lines, marks=lambda *_: {}, named=named, differ=differ)


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
    return replace(topic, variable=topic.variable[:3] + measure, unit="1")


def _centres_of_mass(made: Made) -> Table:
    """What identification changes, as Robert 2017 compares it."""
    order = [*_RESIDUALS, *(_COM + name for name in _OVER_SEGMENTS)]

    def rank(topic: Topic) -> tuple[int, int]:
        """Residuals, then over the segments, then segment by segment."""
        place = order.index(topic.variable) if topic.variable in order else len(order)
        return place, _segment_rank(topic.variable.removeprefix(_COM))

    lines, tests = [], []
    for topic in sorted(made.results.topics, key=rank):
        name = topic.variable.removeprefix(_COM)
        whose = _RESIDUALS.get(name) or _OVER_SEGMENTS.get(name) or segment_label(name)
        label = f"{whose} [{unit_label(topic.unit)}]"
        if topic.variable in _RESIDUALS:
            tests.append(made.results.find(topic, "paired_t"))
            lines.append(Line(topic, label, "Residual"))
        else:
            n = made.results.find(topic, "description", DIFFERENCE, "").n
            lines.append(Line(topic, label, "Centres of mass along the segments", {"n": n}))
    printed = "; ".join(_in_print())
    return made.table(lines, tests, in_print=printed)


def _in_print() -> Iterator[str]:
    """The published cases: residuals, then mean, median and largest distance."""
    for row in load_paper("robert2017").table(1).rows:
        force, moment, *apart = (cell.text for cell in row.cells.values())
        yield f"{row.name} {force} N, {moment} N m; {', '.join(apart)} m"


# --- notes: who is in a table, what the stars mean, what could not be tested ----------------------


def _words(results: Results, tests: Sequence[Comparison], criteria: Criteria) -> dict[str, str]:
    """What titles and legends are filled with."""
    numbers = sorted({row.n for row in tests} or {0})
    how_many = " to ".join(dict.fromkeys(map(str, (numbers[0], numbers[-1]))))
    alpha = criteria.alpha
    level = p_value(alpha) if alpha < 0.01 else f"{alpha:g}".removeprefix("0")
    done = [row for row in tests if not isnan(row.p_value)]
    known = {
        "n": f"n = {how_many} participant{'' if numbers[-1] == 1 else 's'}",
        "alpha": f"{alpha:g}",
        "level": level,
        "percent": f"{criteria.equivalence_percent:g}",
        "tasks": ", ".join(dict.fromkeys(topic.task for topic in results.topics)) or "none",
        "done": str(len(done)),
        "before": str(sum(row.p_value < alpha for row in done)),
        "after": str(sum(row.p_holm < alpha for row in done)),
    }
    said = {name: text.format(**known) for name, text in TEXTS["shared"].items()}
    said["holm"] = said["holm"] if len(done) > 1 else ""
    return known | said


def _not_possible(results: Results, labels: Mapping[Topic, str]) -> Iterator[str]:
    """A sentence for each reason why a test is missing, with the labels of its rows."""
    concerned: dict[str, dict[str, None]] = defaultdict(dict)
    for topic, label in labels.items():
        for row in results.about(topic):
            if row.reason:
                concerned[row.reason][label] = None
    everyone = set(labels.values())
    for reason, names in concerned.items():
        where = "all rows" if len(names) == len(everyone) > 1 else _named([*names])
        yield f"Not possible ({where}): {reason}"


def _fitted_on(counts: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """For each task what its data were to OM: those it was fitted to, or data it never saw."""
    for one in counts:
        kind = "fitted" if one["identification"] else one["role"]
        if kind in TEXTS["data"]:
            yield TEXTS["data"][kind].format(**one)


def _named(names: Sequence[str], comma: str = ", ") -> str:
    """The first names, and how many more there are."""
    shown = comma.join(names[:NAMED_AT_MOST])
    more = len(names) - NAMED_AT_MOST
    return f"{shown}{comma}and {more} more" if more > 0 else shown


# --- all of them ----------------------------------------------------------------------------------

BUILDERS: dict[str, Callable[[Made], Table]] = {
    "table1_segment_mass": _segment_mass,
    "table2_cop_rmse": _cop_rmse,
    "table3_posturography": _posturography,
    "table4_cross_validation": _cross_validation,
    "table5_six_components": _six_components,
    "table6_centres_of_mass": _centres_of_mass,
}
NAMES = tuple(BUILDERS)
TAGS = tuple(name.partition("_")[0] for name in NAMES)
IN_PRINT = TAGS[:4]
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
    missing : who is not in which tables: ``sentence`` and ``tables`` (as in `TAGS`).
    """
    rows = [Comparison.from_row(row) for row in comparisons.to_dict("records")]
    of_table = {tag: Results(row for row in rows if row.topic.table == tag) for tag in TAGS}
    tables = []
    for tag, (name, build) in zip(TAGS, BUILDERS.items(), strict=True):
        table = build(Made(name, of_table[tag], criteria))
        notes = [*table.notes, *_fitted_on(one for one in fitted_on if one["table"] == tag)]
        if absent := [str(gone["sentence"]) for gone in missing if tag in gone["tables"]]:
            notes.append(f"Missing: {_named(absent, '; ')}.")
        tables.append(replace(table, notes=tuple(notes)))
    return (*tables, *(published.next_to_published(tag, of_table[tag]) for tag in IN_PRINT))


def folder(out: Path) -> Path:
    """Where the written tables lie."""
    return out / "group" / "tables"


def show(out: Path) -> str:
    """The written Markdown tables of an output folder, one after the other; empty without any."""
    paths = [folder(out) / f"{name}.md" for name in NAMES]
    return "\n\n".join(path.read_text(encoding="utf-8") for path in paths if path.exists())
