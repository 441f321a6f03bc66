"""The error budget as people read it: what makes RM's error, in a few words, as the pieces of bars
and in colours that mean one kind of cause in every report."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.report.causes import effect_title
from bsip_cli.report.words import TEXTS, findings, listing, say

FIRST = ("fz", "cop_ap", "cop_ml")  # components that a reader asks for first
BEFORE = "squared error with RM"  # RM's, of which the budget is
REST = "small parts"
PARAMETERS = "the table's segment parameters"
FAULT, NOISE, UNKNOWN = "fault", "noise", "unknown"
_WORTH = 5.0  # percent of the squared error: less is in the rest
_LEAST = 0.5  # less is nothing
_MOST_LIKE = 2  # faults that a part is like
LEAST_REPORTED_SIZE = 2.0  # errors, in N or mm: what makes them is of no interest


@dataclass(frozen=True)
class Piece:
    """What some terms of the error budget, taken together where they look alike, make of an
    error [%]. ``perhaps``: of the unknown part, the faults that may make it but are no findings."""

    label: str
    share: float
    terms: tuple[str, ...]
    perhaps: str = ""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Keys of ``COLOURS``."""
        if UNKNOWN in self.terms:  # whatever may make it
            return (UNKNOWN,)
        return tuple(dict.fromkeys(term.partition(":")[0] for term in self.terms))

    def with_remark(self, remark: str) -> Piece:
        """With a remark in its label, and what a share below zero means."""
        said = [*filter(None, [remark, "cancels some" if self.share < 0 else ""])]
        return replace(self, label=f"{self.label} ({'; '.join(said)})") if said else self


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
        k: {own if (own := f"{FAULT}:{x}") in known else _PART_OF.get(x, own) for x in effects}
        for k, effects in found.items()
    }
    whole = overall_pieces(budget, {one for effects in found.values() for one in effects})
    numbers = ([k for k, mine in terms.items() if mine & {*one.terms}] for one in whole)
    return tuple(one.with_remark(findings(of)) for one, of in zip(whole, numbers, strict=True))


def found_share(budget: pd.DataFrame, found: Collection[str]) -> float:
    """Of the same error, what the effects found make [%]; NaN where no error is of interest."""
    shares = _overall(budget)["share_percent"]
    mine = shares.index.isin([f"{FAULT}:{effect}" for effect in found])
    return float(shares[mine].sum()) if len(shares) else np.nan


def _overall(
    budget: pd.DataFrame, trial: str = "", components: Sequence[str] = FIRST
) -> pd.DataFrame:
    large = [one for one in components if size_of(budget, one, trial)[0] >= LEAST_REPORTED_SIZE]
    mine = budget[(budget["trial"] == trial) & (budget["target"] == "")]
    by_term = mine[mine["component"].isin(large)].groupby("term", sort=False)
    alike = by_term["alike"].agg(lambda texts: ", ".join(filter(None, map(str, texts))))
    return pd.DataFrame({"share_percent": by_term["share_percent"].mean(), "alike": alike})


def _cut(rows: pd.DataFrame, found: Collection[str]) -> tuple[Piece, ...]:
    """What was found has its own piece, however small; of the unknown, the largest shares of
    faults that are no findings may be what it is."""
    large: list[Piece] = []
    noise: list[Piece] = []
    unknown: dict[str, float] = {}
    shares = {str(term): float(share) for term, share in rows["share_percent"].items()}
    for terms in _groups(rows):
        faults = [term for term in terms if term.startswith(f"{FAULT}:")]
        unsure = {term for term in faults if term.partition(":")[2] not in found}
        is_named = len(unsure) < len(faults)
        share = sum(shares[term] for term in terms)
        if {*terms} <= unsure | {UNKNOWN}:
            unknown |= {term: shares[term] for term in terms}
            continue
        label = " or ".join(dict.fromkeys(term_words(one) for one in terms if one not in unsure))
        if unsure and not is_named:
            label += f", or perhaps {listing([*dict.fromkeys(map(term_words, sorted(unsure)))])}"
        if label == NOISE:
            noise.append(Piece(label, share, terms))
        elif share >= (_LEAST if is_named else _WORTH) or share <= -_WORTH:
            large.append(Piece(label, share, terms))
    large.sort(key=lambda one: -one.share)
    if unknown:
        whole = sum(unknown.values())
        faults = [term for term in unknown if term != UNKNOWN]
        worth = sorted((-unknown[term], term) for term in faults if unknown[term] >= _WORTH)
        like = [f"{-share:.0f} % like {term_words(term)}" for share, term in worth[:_MOST_LIKE]]
        perhaps = ", ".join([*like, "not confirmed"]) if like else ""
        noise = [Piece(UNKNOWN, whole, (UNKNOWN, *faults), perhaps), *noise]
    others = 100.0 - sum(one.share for one in (*large, *noise))
    rest = [Piece(REST, others, ("rest",))] if abs(others) >= _LEAST else []
    return (*large, *rest, *noise)


def _groups(rows: pd.DataFrame) -> Iterator[tuple[str, ...]]:
    """Terms that look alike, directly or by others between them."""
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
    kind, _, effect = term.partition(":")
    return effect_title(effect) if kind == FAULT else str(TEXTS["terms"][term])


def size_of(budget: pd.DataFrame, component: str, trial: str = "") -> tuple[float, str]:
    """RM's error of a component in all trials together, or in one, and its unit."""
    rows = _totals(budget, component, trial)
    return (float(rows[0]["rms"]), str(rows[0]["unit"])) if rows else (np.nan, "")


def _totals(budget: pd.DataFrame, component: str, trial: str = "") -> list[dict[Any, Any]]:
    mine = (budget["trial"] == trial) & (budget["component"] == component)
    return budget[mine & (budget["term"] == "total")].to_dict("records")


def budget_sentences(budget: pd.DataFrame, found: Collection[str]) -> Iterator[str]:
    """What makes RM's error in all trials together, one component each, and what that is worth on
    data held out."""
    for component in FIRST:
        for total in _totals(budget, component)[:1]:
            if total["rms"] >= LEAST_REPORTED_SIZE:
                parts = [one.with_remark(one.perhaps) for one in pieces(budget, component, found)]
                is_known = np.isfinite(total["gain_percent"])
                yield say("budget", total=total, parts=parts, is_known=is_known)


# --- colours: Okabe and Ito, which the colour-blind can distinguish -------------------------------

COLOURS: dict[str, str] = TEXTS["colours"]
"""By term of the error budget; all faults have one, and differ by their hatching."""
HATCHES = ("", "||", "--", "..")
_INK = "#1c1c1c"
_CSS = {
    "": "{colour}",
    "||": f"repeating-linear-gradient(90deg, {{colour}} 0 4px, {_INK} 4px 5px)",
    "--": f"repeating-linear-gradient(0deg, {{colour}} 0 4px, {_INK} 4px 5px)",
    "..": f"radial-gradient({_INK} 1px, {{colour}} 1.5px) 0 0 / 6px 6px",
    "////": f"repeating-linear-gradient(45deg, {{colour}} 0 4px, {_INK} 4px 6px)",
}


@dataclass(frozen=True)
class Fill:
    """Colours one above the other, and a hatching."""

    colours: tuple[str, ...]
    hatch: str

    def css(self) -> str:
        """As the background of an element."""
        if len(self.colours) == 1:
            return _CSS[self.hatch].format(colour=self.colours[0])
        part = 100 / len(self.colours)
        stops = (f"{c} {k * part:.0f}% {(k + 1) * part:.0f}%" for k, c in enumerate(self.colours))
        return f"linear-gradient({', '.join(stops)})"


def fills(pieces: Iterable[Piece]) -> dict[str, Fill]:
    """By label, in the order in which the labels come first."""
    faults = 0
    found: dict[str, Fill] = {}
    for piece in pieces:
        if piece.label in found:
            continue
        hatch = "////" if piece.kinds == (UNKNOWN,) else ""
        if piece.kinds == (FAULT,):
            hatch = HATCHES[faults % len(HATCHES)]
            faults += 1
        found[piece.label] = Fill(tuple(COLOURS[kind] for kind in piece.kinds), hatch)
    return found
