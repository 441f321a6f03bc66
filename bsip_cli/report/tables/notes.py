"""The sentences below a table: who is in it, what the stars mean, what could not be tested."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from math import isnan

from bsip_cli.report.tables.labels import p_value
from bsip_cli.report.tables.model import Results
from bsip_cli.statistics.cohort_values import Comparison, Topic

NAMED_AT_MOST = 6
"""Missing participants and rows that are named one by one."""


def participants(rows: Iterable[Comparison]) -> str:
    """n = 8 participants, or the range over the rows."""
    numbers = [row.n for row in rows] or [0]
    low, high = min(numbers), max(numbers)
    word = "participant" if high == 1 else "participants"
    return f"n = {high} {word}" if low == high else f"n = {low} to {high} {word}"


def significant(row: Comparison, alpha: float) -> bool:
    return row.p_value < alpha


def star(row: Comparison, alpha: float, sign: str = "*") -> str:
    return sign if significant(row, alpha) else ""


def star_legend(alpha: float) -> str:
    return f"* significant: p < {_level(alpha)}."


def normality_legend(alpha: float) -> str:
    return (
        f"Where Lilliefors' p is below {_level(alpha)} the differences are not normal, and "
        "Wilcoxon's test is the one to read."
    )


def holm_legend(tests: Sequence[Comparison], alpha: float) -> str:
    """How many of the stars outlast the correction for their number; nothing for one test."""
    done = [row for row in tests if not isnan(row.p_value)]
    if len(done) < 2:
        return ""
    before = sum(significant(row, alpha) for row in done)
    after = sum(row.p_holm < alpha for row in done)
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
        f"Not possible ({'all rows' if len(names) == len(everyone) > 1 else _named([*names])}): "
        f"{reason}"
        for reason, names in concerned.items()
    )


def missing(sentences: Sequence[str]) -> str:
    """Who is not in the table, and why."""
    return f"Missing: {_named(sentences, '; ')}." if sentences else ""


def fitted_on(counts: Iterable[Mapping]) -> tuple[str, ...]:
    """For each task what its data were to OM: those it was fitted to, or data it never saw.

    Parameters
    ----------
    counts : task, role, and of how many participants (``everyone``) OM was fitted to its data
        (``identification``).
    """
    sentences = []
    for count in counts:
        task, fitted = count["task"], count["identification"]
        if fitted:
            sentences.append(
                f"{task}: OM was fitted to these very data in {fitted} of {count['everyone']} "
                "participants; there its error is that of a fit, not of a prediction."
            )
        elif count["role"] == "sequence":
            sentences.append(f"{task}: only stretches that OM was not fitted to.")
    return tuple(sentences)


def _named(names: Sequence[str], comma: str = ", ") -> str:
    shown = comma.join(names[:NAMED_AT_MOST])
    more = len(names) - NAMED_AT_MOST
    return f"{shown}{comma}and {more} more" if more > 0 else shown


def _level(alpha: float) -> str:
    return p_value(alpha) if alpha < 0.01 else f"{alpha:g}".removeprefix("0")
