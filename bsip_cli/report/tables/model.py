"""A table as data, the tests of one table by what they are about, and numbers as the papers print
them; a number that is not there is a dash."""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import isnan
from pathlib import Path

from bsip_cli.statistics.cohort import Comparison, Criteria, Topic, all_reasons
from bsip_cli.statistics.methods import OM, RM

Cell = str | float | int
Number = tuple[str, str, str, str]
"""A number of a test: the test, the number's name, and the two methods."""


@dataclass(frozen=True)
class Column:
    """One printed column, made of one or more CSV columns.

    fields : names of the CSV columns, which are also the keys of a row's values.
    heading : what is printed above; empty for columns that only the CSV has.
    form : the values of the fields as printed text.
    in_row_unit : the CSV names get the unit of the row, so that each holds one unit only.
    text : aligned to the left.
    of : the numbers of the fields; empty for what a row brings itself.
    """

    fields: tuple[str, ...]
    heading: str = ""
    form: Callable[..., str] = str
    in_row_unit: bool = False
    text: bool = False
    of: tuple[Number, ...] = ()


def column(
    fields: str,
    of: str,
    heading: str = "",
    form: Callable[..., str] = str,
    pair: tuple[str, str] = (OM, RM),
    in_row_unit: bool = False,
) -> Column:
    """A column of numbers: ``of`` as ``test.name``, as many as there are names of ``fields``."""
    numbers = ((test, name, *pair) for test, name in (one.split(".") for one in of.split()))
    return Column(tuple(fields.split()), heading, form, in_row_unit, of=tuple(numbers))


@dataclass(frozen=True)
class Row:
    """One line. `marks` are signs after a printed cell, by heading, that the notes explain.

    `group` is printed once as a line of its own above the rows that share it.
    """

    values: Mapping[str, Cell]
    unit: str = ""
    group: str = ""
    marks: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """`name` is the file's stem, `notes` the legend below, a sentence or two each."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def printed_columns(self) -> tuple[Column, ...]:
        return tuple(column for column in self.columns if column.heading)

    def printed_cells(self, row: Row) -> tuple[str, ...]:
        """The row as text, marks included, in the order of the printed columns."""
        return tuple(_printed(column, row) for column in self.printed_columns())


def _printed(column: Column, row: Row) -> str:
    values = [row.values[name] for name in column.fields]
    if all(value == "" for value in values):
        return ""
    return column.form(*values) + row.marks.get(column.heading, "")


class Results:
    """`topics` in the order in which they were computed."""

    def __init__(self, comparisons: Iterable[Comparison]) -> None:
        self._about: dict[Topic, list[Comparison]] = defaultdict(list)
        for row in comparisons:
            self._about[row.topic].append(row)
        self.topics = tuple(self._about)
        rows = (row for rows in self._about.values() for row in rows)
        self._rows = {(row.topic, row.test, row.method_a, row.method_b): row for row in rows}

    def find(self, topic: Topic, test: str, first: str = OM, second: str = RM) -> Comparison:
        """The row, or one without any number if there is none."""
        nothing = Comparison(topic, test, "added", first, second, reason="There are no such data.")
        return self._rows.get((topic, test, first, second), nothing)

    def values(self, topic: Topic, columns: Iterable[Column]) -> dict[str, Cell]:
        """The numbers of those columns that are made of tests."""
        return {
            name: getattr(self.find(topic, test, *pair), number)
            for one in columns
            for name, (test, number, *pair) in zip(one.fields, one.of, strict=False)
        }

    def about(self, topic: Topic) -> Sequence[Comparison]:
        """Every row on the topic."""
        return self._about.get(topic, ())

    def reasons(self, topic: Topic) -> str:
        """Why tests on the topic are not possible, each reason once."""
        return all_reasons(*(row.reason for row in self.about(topic)))


# --- numbers as text ------------------------------------------------------------------------------

ABSENT = "-"


def unit_label(unit: str) -> str:
    """A column's unit as print has it."""
    return {"mm2": "mm²", "% body weight": "% BW"}.get(unit, unit)


def number(decimals: int) -> Callable[[float], str]:
    """A form with so many decimals, without a sign before zero."""
    return partial(_rounded, decimals=decimals)


def mean_sd(decimals: int) -> Callable[[float, float], str]:
    """M(SD), in whole numbers from a thousand on; one participant has no SD."""

    def form(mean: float, sd: float) -> str:
        places = number(0 if abs(mean) >= 1000.0 else decimals)
        return ABSENT if isnan(mean) else f"{places(mean)}({places(sd)})"

    return form


def interval(decimals: int) -> Callable[[float, float], str]:
    """A form of both ends in brackets; absent if one is."""

    def form(low: float, high: float) -> str:
        ends = [_rounded(end, decimals) for end in (low, high)]
        return ABSENT if ABSENT in ends else f"[{', '.join(ends)}]"

    return form


def p_value(p: float) -> str:
    """Three decimals without the leading zero."""
    if isnan(p):
        return ABSENT
    return "<.001" if p < 0.0005 else f"{p:.3f}".removeprefix("0")


def count(value: float) -> str:
    """A whole number."""
    return ABSENT if isnan(value) else f"{value:.0f}"


def counts_of(a: float, b: float, n: float) -> str:
    """How many for the one, how many for the other, of how many."""
    return ABSENT if isnan(a) or n == 0 else f"{a:.0f} : {b:.0f} of {n:.0f}"


def _rounded(value: float, decimals: int) -> str:
    if isnan(value):
        return ABSENT
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


_COLUMNS = tomllib.loads(Path(__file__).with_name("columns.toml").read_text(encoding="utf-8"))
_FORMS: dict[str, Callable[..., str]] = {
    "number": number(2),
    "interval": interval(2),
    "p": p_value,
    "counts": counts_of,
}


def columns(name: str, pair: tuple[str, str] = (OM, RM), **words: str) -> tuple[Column, ...]:
    """Those of ``columns.toml`` by that name; ``words`` go into the headings."""
    found = []
    for fields, of, heading, form, *in_row_unit in _COLUMNS[name]:
        how = heading.format(**words), _FORMS.get(form, str), pair
        found.append(column(fields, of, *how, in_row_unit=bool(in_row_unit)))
    return tuple(found)


# --- sentences below a table: who is in it, what the stars mean, what could not be tested ---------

NAMED_AT_MOST = 6  # missing participants and rows that are named one by one


TEXTS = tomllib.loads(Path(__file__).with_name("texts.toml").read_text(encoding="utf-8"))


def texts_of(
    name: str, results: Results, tests: Sequence[Comparison], criteria: Criteria, **more: str
) -> tuple[str, tuple[str, ...]]:
    """Title and legend of a table; ``more``: what only this one says."""
    words = TEXTS["shared"] | more
    numbers = sorted({row.n for row in tests} or {0})
    how_many = " to ".join(dict.fromkeys(map(str, (numbers[0], numbers[-1]))))
    words["n"] = f"n = {how_many} participant{'' if numbers[-1] == 1 else 's'}"
    words |= {"alpha": f"{criteria.alpha:g}", "percent": f"{criteria.equivalence_percent:g}"}
    words["tasks"] = ", ".join(dict.fromkeys(topic.task for topic in results.topics)) or "none"
    words["star"] = f"* significant: p < {_level(criteria.alpha)}."
    words["holm"] = _holm_legend(tests, criteria.alpha)
    words["normal"] = (
        f"Where Lilliefors' p is below {_level(criteria.alpha)} the differences are not normal, and "
        "Wilcoxon's test is the one to read."
    )
    notes = (note.format(**words) for note in TEXTS[name]["notes"])
    return TEXTS[name]["title"].format(**words), tuple(filter(None, notes))


def star(row: Comparison, alpha: float, sign: str = "*") -> str:
    """The sign if p < alpha, else nothing."""
    return sign if row.p_value < alpha else ""


def _holm_legend(tests: Sequence[Comparison], alpha: float) -> str:
    """How many of the stars outlast the correction for their number; nothing for one test."""
    done = [row for row in tests if not isnan(row.p_value)]
    if len(done) < 2:
        return ""
    before, after = (
        sum(p < alpha for p in ps)
        for ps in zip(*((r.p_value, r.p_holm) for r in done), strict=True)
    )
    return (
        f"The {len(done)} t tests ask one question many times: {before} have p < {_level(alpha)}, "
        f"{after} after Holm's correction (added; p_holm in the CSV)."
    )


def not_possible(results: Results, labels: Mapping[Topic, str]) -> tuple[str, ...]:
    """A sentence for each reason why a test is missing, with the labels of its rows."""
    concerned: dict[str, dict[str, None]] = defaultdict(dict)
    for topic, label in labels.items():
        for row in results.about(topic):
            if row.reason:
                concerned[row.reason][label] = None
    everyone = set(labels.values())
    return tuple(
        f"Not possible ({'all rows' if len(names) == len(everyone) > 1 else named([*names])}): "
        f"{reason}"
        for reason, names in concerned.items()
    )


def fitted_on(counts: Iterable[Mapping[str, object]]) -> tuple[str, ...]:
    """For each task what its data were to OM: those it was fitted to, or data it never saw.

    counts : task, role, and of how many participants (``everyone``) OM was fitted to its data
        (``identification``).
    """
    sentences = []
    for counted in counts:
        task, fitted = counted["task"], counted["identification"]
        if fitted:
            sentences.append(
                f"{task}: OM was fitted to these very data in {fitted} of {counted['everyone']} "
                "participants; there its error is that of a fit, not of a prediction."
            )
        elif counted["role"] == "sequence":
            sentences.append(f"{task}: only intervals that OM was not fitted to.")
    return tuple(sentences)


def named(names: Sequence[str], comma: str = ", ") -> str:
    """The first names, and how many more there are."""
    shown = comma.join(names[:NAMED_AT_MOST])
    more = len(names) - NAMED_AT_MOST
    return f"{shown}{comma}and {more} more" if more > 0 else shown


def _level(alpha: float) -> str:
    return p_value(alpha) if alpha < 0.01 else f"{alpha:g}".removeprefix("0")
