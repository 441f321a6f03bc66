"""The error budget as people read it: what makes RM's error, in a few words and as bars."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report.effect_words import EFFECT_WORDS
from bsip_cli.report.words import (
    component_label,
    listing,
    number,
    signed,
)

FIRST = ("fz", "cop_ap", "cop_ml")  # components that a reader asks for first
REST = "all others"
UNKNOWN = "unknown"
PARAMETERS = "the table's segment parameters"
_FAULT = "fault:"
_LAST = ("noise", UNKNOWN)
_WORDS = {
    "inertial_parameters": PARAMETERS,
    "joint_centres": "joint centres",
    "marker_places": "places of the markers",
    "soft_tissue": "soft tissue",
    "trunk_and_shoulders": "trunk and shoulders that bend",
    "smoothing": "smoothing of the motion",
    "noise": "noise",
    "unknown": UNKNOWN,
}
_WORTH = 5.0  # percent of the squared error: less is in the rest
LEAST_TOLD_SIZE = 2.0  # errors, in N or mm: what makes them is of no interest


@dataclass(frozen=True)
class Piece:
    """What some terms, told together where they look alike, make of an error [%]."""

    label: str
    share: float


def pieces(budget: pd.DataFrame, trial: str, component: str) -> tuple[Piece, ...]:
    """The largest first; what is small together, then unknown and noise. Their sum is 100."""
    whole = (budget["trial"] == trial) & (budget["target"] == "")
    return _cut(budget[whole & (budget["component"] == component)].set_index("term"))


def overall_pieces(budget: pd.DataFrame) -> tuple[Piece, ...]:
    """Of all trials, the mean over the vertical force and both directions of the centre of pressure,
    as far as their errors are of interest; terms that look alike in one count together in all."""
    shares = _overall(budget)
    return () if shares.empty else _cut(shares)


def fault_share(budget: pd.DataFrame) -> float:
    """Of the same error, what faults make [%]; NaN where no error is of interest."""
    shares = _overall(budget)
    faults = shares.index.astype(str).str.startswith(_FAULT)
    return float(shares.loc[faults, "share_percent"].sum()) if len(shares) else np.nan


def _overall(budget: pd.DataFrame) -> pd.DataFrame:
    told = [one for one in FIRST if size_of(budget, "", one)[0] >= LEAST_TOLD_SIZE]
    mine = budget[(budget["trial"] == "") & (budget["target"] == "")]
    by_term = mine[mine["component"].isin(told)].groupby("term", sort=False)
    alike = by_term["alike"].agg(lambda texts: ", ".join(filter(None, map(str, texts))))
    return pd.DataFrame({"share_percent": by_term["share_percent"].mean(), "alike": alike})


def _cut(rows: pd.DataFrame) -> tuple[Piece, ...]:
    """What was found has its own piece, however small."""
    groups = list(_groups(rows))
    found = [_together(rows, terms) for terms in groups]
    least = [0.5 if terms[0].startswith(_FAULT) else _WORTH for terms in groups]
    large = [
        one
        for one, size in zip(found, least, strict=True)
        if (one.share >= size or one.share <= -_WORTH) and one.label not in _LAST
    ]
    large.sort(key=lambda one: -one.share)
    last = [one for one in found if one.label in _LAST]
    others = 100.0 - sum(one.share for one in (*large, *last))
    rest = [Piece(REST, others)] if abs(others) >= 0.5 else []
    return (*large, *rest, *last)


def _groups(rows: pd.DataFrame) -> Iterator[tuple[str, ...]]:
    """Terms that stand in for each other are one group."""
    left = [term for term in rows.index if term != "total"]
    while left:
        group = [left[0]]
        for term in group:
            alike = str(rows.loc[term, "alike"]).split(", ")
            group += [one for one in alike if one in left and one not in group]
        left = [term for term in left if term not in group]
        yield tuple(group)


def _together(rows: pd.DataFrame, terms: tuple[str, ...]) -> Piece:
    label = " or ".join(dict.fromkeys(term_words(term) for term in terms))
    return Piece(label, float(rows.loc[list(terms), "share_percent"].sum()))


def term_words(term: str) -> str:
    """A term of the budget in words."""
    if term.startswith(_FAULT):
        return EFFECT_WORDS[term.removeprefix(_FAULT)].title
    return _WORDS[term]


def size_of(budget: pd.DataFrame, trial: str, component: str) -> tuple[float, str]:
    """RM's error of a component, and its unit."""
    row = _total(budget, trial, component)
    return (np.nan, "") if row is None else (float(row["rms"]), str(row["unit"]))


def _total(budget: pd.DataFrame, trial: str, component: str) -> pd.Series | None:
    mine = (budget["trial"] == trial) & (budget["component"] == component)
    rows = budget[mine & (budget["term"] == "total")]
    return None if rows.empty else rows.iloc[0]


def budget_sentences(budget: pd.DataFrame) -> tuple[str, ...]:
    """What makes RM's error in all trials together, one component each, and what that is worth on
    data held out."""
    if budget.empty:
        return ()
    return tuple(filter(None, (_sentence(budget, component) for component in FIRST)))


def _sentence(budget: pd.DataFrame, component: str) -> str:
    size, unit = size_of(budget, "", component)
    if not size >= LEAST_TOLD_SIZE:
        return ""
    parts = [f"{one.label} {number(one.share, 0)} %" for one in pieces(budget, "", component)]
    total = _total(budget, "", component)
    assert total is not None
    worth = ""
    if np.isfinite(total["gain_percent"]):
        change, low, high = (
            signed(-total[name], 0) for name in ("gain_percent", "gain_high", "gain_low")
        )
        worth = (
            " Put into the model with their sizes in other data, all of them change the error by "
            f"{change} % ({low} to {high} %)."
        )
    return (
        f"What makes RM's error of {number(size, 1)} {unit} in {component_label(component)}: "
        f"{listing(parts)}.{worth}"
    )
