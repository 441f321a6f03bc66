"""The error budget as people read it: what makes RM's error, in a few words and as bars."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from bsip_cli.report import cause_colours
from bsip_cli.report.cause_colours import NOISE, UNKNOWN, Piece
from bsip_cli.report.effect_words import EFFECT_WORDS
from bsip_cli.report.words import TEXTS, component_label, findings, listing, number, signed

FIRST = ("fz", "cop_ap", "cop_ml")  # components that a reader asks for first
BEFORE = "squared error with RM"  # RM's, of which the budget is
REST = "small parts"
PARAMETERS = "the table's segment parameters"
_FAULT = "fault:"
_WORTH = 5.0  # percent of the squared error: less is in the rest
_LEAST = 0.5  # less is nothing
_MOST_LIKE = 2  # faults that a part is like
LEAST_REPORTED_SIZE = 2.0  # errors, in N or mm: what makes them is of no interest


def pieces(budget: pd.DataFrame, component: str, found: Collection[str]) -> tuple[Piece, ...]:
    """Of all trials together, the largest first; what is small together, then unknown and noise.
    Their sum is 100. ``found``: the effects that a diagnosis reports; the share of a fault that is
    no finding is unknown, as nobody can say that it is there."""
    whole = (budget["trial"] == "") & (budget["target"] == "")
    return _cut(budget[whole & (budget["component"] == component)].set_index("term"), found)


def overall_pieces(
    budget: pd.DataFrame, found: Collection[str], trial: str = "", components: Sequence[str] = FIRST
) -> tuple[Piece, ...]:
    """The same of the mean over the vertical force and both directions of the centre of pressure,
    as far as their errors are of interest; terms that look alike in one count together in all, and
    what rounds to nothing is left out. ``trial``: of this one alone."""
    shares = _overall(budget, trial, components)
    whole = () if shares.empty else _cut(shares, found)
    return tuple(one for one in whole if abs(one.share) >= _LEAST)


_PART_OF = {  # findings that the budget has in another term, which holds what is usual too
    "soft_tissue": "soft_tissue",
    "missing_joint": "trunk_and_shoulders",
    "marker_shift": "marker_places",
    "joint_centre": "joint_centres",
    "over_smoothing": "smoothing",
    "unexplained": UNKNOWN,
}


def numbered_pieces(
    budget: pd.DataFrame, found: Mapping[int, Collection[str]]
) -> tuple[Piece, ...]:
    """The same, each with the numbers of the findings that it belongs to; ``found``: the effects
    in each finding, by its number."""
    known = {*budget["term"]}
    terms = {
        k: {own if (own := f"{_FAULT}{x}") in known else _PART_OF.get(x, own) for x in effects}
        for k, effects in found.items()
    }
    pieces = overall_pieces(budget, {one for effects in found.values() for one in effects})
    numbers = ([k for k, mine in terms.items() if mine & {*one.terms}] for one in pieces)
    return tuple(_with(one, findings(of)) for one, of in zip(pieces, numbers, strict=True))


def _with(piece: Piece, remark: str) -> Piece:
    """With a remark in its label, and what a share below zero means."""
    said = [*filter(None, [remark, "cancels some" if piece.share < 0 else ""])]
    return replace(piece, label=f"{piece.label} ({'; '.join(said)})") if said else piece


def found_share(budget: pd.DataFrame, found: Collection[str]) -> float:
    """Of the same error, what the effects found make [%]; NaN where no error is of interest."""
    shares = _overall(budget)
    mine = shares.index.isin([f"{_FAULT}{effect}" for effect in found])
    return float(shares.loc[mine, "share_percent"].sum()) if len(shares) else np.nan


def _overall(
    budget: pd.DataFrame, trial: str = "", components: Sequence[str] = FIRST
) -> pd.DataFrame:
    large = [one for one in components if size_of(budget, one, trial)[0] >= LEAST_REPORTED_SIZE]
    mine = budget[(budget["trial"] == trial) & (budget["target"] == "")]
    by_term = mine[mine["component"].isin(large)].groupby("term", sort=False)
    alike = by_term["alike"].agg(lambda texts: ", ".join(filter(None, map(str, texts))))
    return pd.DataFrame({"share_percent": by_term["share_percent"].mean(), "alike": alike})


def _cut(rows: pd.DataFrame, found: Collection[str]) -> tuple[Piece, ...]:
    """What was found has its own piece, however small."""
    large: list[Piece] = []
    noise: list[Piece] = []
    unknown: list[tuple[str, float]] = []
    shares = {str(term): float(share) for term, share in rows["share_percent"].items()}
    for terms in _groups(rows):
        faults = {term for term in terms if term.startswith(_FAULT)}
        named = {term for term in faults if term.removeprefix(_FAULT) in found}
        share = sum(shares[term] for term in terms)
        if {*terms} <= faults - named | {UNKNOWN}:
            unknown += [(term, shares[term]) for term in terms]
            continue
        piece = Piece(_label(terms, faults, named), share, terms)
        if piece.label == NOISE:
            noise.append(piece)
        elif share >= (_LEAST if named else _WORTH) or share <= -_WORTH:
            large.append(piece)
    large.sort(key=lambda one: -one.share)
    last = [*_unknown(unknown), *noise]
    others = 100.0 - sum(one.share for one in (*large, *last))
    rest = [Piece(REST, others, (cause_colours.REST,))] if abs(others) >= _LEAST else []
    return (*large, *rest, *last)


def _unknown(parts: Sequence[tuple[str, float]]) -> Iterator[Piece]:
    """The unknown with the terms and shares of faults that are no findings: the largest of these
    may be what it is."""
    if parts:
        faults = {term: share for term, share in parts if term != UNKNOWN}
        worth = sorted((-share, term) for term, share in faults.items() if share >= _WORTH)
        like = [f"{-share:.0f} % like {term_words(term)}" for share, term in worth[:_MOST_LIKE]]
        perhaps = ", ".join([*like, "not confirmed"]) if like else ""
        yield Piece(UNKNOWN, sum(share for _, share in parts), (UNKNOWN, *faults), perhaps)


def _groups(rows: pd.DataFrame) -> Iterator[tuple[str, ...]]:
    left = [term for term in rows.index if term != "total"]
    while left:
        group = [left[0]]
        for term in group:
            alike = dict.fromkeys(str(rows.loc[term, "alike"]).split(", "))  # each once
            group += [one for one in alike if one in left and one not in group]
        left = [term for term in left if term not in group]
        yield tuple(group)


def term_words(term: str) -> str:
    """A term of the budget in words."""
    if term.startswith(_FAULT):
        return EFFECT_WORDS[term.removeprefix(_FAULT)].title
    return str(TEXTS["terms"][term])


def _label(terms: Sequence[str], faults: Collection[str], named: Collection[str]) -> str:
    """Of faults that look alike only those that are findings; where none is, that they may be."""
    unsure = {*faults} - {*named}
    label = " or ".join(dict.fromkeys(term_words(one) for one in terms if one not in unsure))
    if unsure and not named:
        label += f", or perhaps {listing([*dict.fromkeys(map(term_words, sorted(unsure)))])}"
    return label


def size_of(budget: pd.DataFrame, component: str, trial: str = "") -> tuple[float, str]:
    """RM's error of a component in all trials together, or in one, and its unit."""
    row = _total(budget, component, trial)
    return (np.nan, "") if row is None else (float(row["rms"]), str(row["unit"]))


def _total(budget: pd.DataFrame, component: str, trial: str = "") -> pd.Series | None:
    mine = (budget["trial"] == trial) & (budget["component"] == component)
    rows = budget[mine & (budget["term"] == "total")]
    return None if rows.empty else rows.iloc[0]


def budget_sentences(budget: pd.DataFrame, found: Collection[str]) -> Iterator[str]:
    """What makes RM's error in all trials together, one component each, and what that is worth on
    data held out."""
    for component in FIRST:
        size, unit = size_of(budget, component)
        total = _total(budget, component)
        if total is None or not size >= LEAST_REPORTED_SIZE:
            continue
        shares = pieces(budget, component, found)
        parts = [f"{_with(one, one.perhaps).label} {number(one.share, 0)} %" for one in shares]
        worth = ""
        if np.isfinite(total["gain_percent"]):
            change = signed(-total["gain_percent"], 0)
            low, high = signed(-total["gain_high"], 0), signed(-total["gain_low"], 0)
            worth = (
                " Put into the model with their sizes in other data, all of them change the error "
                f"by {change} % ({low} to {high} %)."
            )
        yield (
            f"What makes RM's error of {number(size, 1)} {unit} in {component_label(component)}: "
            f"{listing(parts)}.{worth}"
        )
