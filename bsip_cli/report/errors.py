"""Errors of the methods: what identification gains over the table's parameters, and over these times
one number; how large they are against yardsticks; what makes them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pandas as pd

from bsip_cli.report import cause_colours
from bsip_cli.report.blocks import Scale
from bsip_cli.report.cause_colours import NOISE, UNKNOWN, Piece
from bsip_cli.report.effect_words import EFFECT_WORDS
from bsip_cli.report.words import (
    COMPONENTS,
    TEXTS,
    component_label,
    count,
    findings,
    listing,
    number,
    signed,
)
from bsip_cli.statistics.choice import Difference
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN
from bsip_cli.statistics.published import load_paper

_PAIRS = ("om", "rm_mass", "om_rm_mass")  # of whose ratios the choice is made


@dataclass(frozen=True)
class Errors:
    """Errors (RMSE) of the methods in one component: of OM, RM, and RM+mass if there."""

    component: str
    unit: str
    of: Mapping[str, float]

    def change(self, method: str = OM) -> float:
        """Relative change of RM's error: -0.4 is 40 % less."""
        return relative_change(self.of[RM], self.of.get(method, np.nan))


@dataclass(frozen=True)
class Gain(Errors):
    """Those of one trial. frames : that they rest on. held_out : OM had not seen the data."""

    trial: str
    frames: int
    held_out: bool


def relative_change(before: float, after: float) -> float:
    return after / before - 1.0 if before > 0.0 else float("nan")


def gains_of(trial: str, fit: pd.DataFrame) -> tuple[Gain, ...]:
    """The gains of one trial, in the order of the components; the vertical force in % BW."""
    rows = {(row["method"], row["component"]): row for _, row in fit.iterrows()}
    gains = []
    for component in COMPONENTS:
        known = {m: rows[m, component] for m in METHODS if (m, component) in rows}
        if not {RM, OM} <= known.keys():
            continue
        column, unit = "rmse", str(known[OM]["unit"])
        if component == "grf_vertical" and np.isfinite(known[OM]["rmse_percent_bw"]):
            column, unit = "rmse_percent_bw", "% BW"
        gains.append(
            Gain(
                component,
                unit,
                {method: float(row[column]) for method, row in known.items()},
                trial,
                min(int(row["n"]) for row in known.values()),
                known[OM]["data"] == "held_out",
            )
        )
    return tuple(gains)


def pooled_gains(gains: Iterable[Gain]) -> tuple[Errors, ...]:
    """Over all frames of the trials, component by component, so that a stride of 0.2 s counts for
    no more than it is; trials without numbers are left out."""
    known = [gain for gain in gains if np.isfinite(list(gain.of.values())).all()]
    of_each = ([gain for gain in known if gain.component == name] for name in COMPONENTS)
    return tuple(Errors(of[0].component, of[0].unit, _pooled(of)) for of in of_each if of)


def _pooled(gains: Sequence[Gain]) -> dict[str, float]:
    """Root mean square over all frames, of those of intervals of so many frames."""
    frames = [gain.frames for gain in gains]
    methods = [m for m in METHODS if all(m in gain.of for gain in gains)]
    return {
        method: float(np.sqrt(np.average([g.of[method] ** 2 for g in gains], weights=frames)))
        for method in methods
    }


def one_number_alone(quantity: str, rm_mass: float, om: float, over_rm_mass: float) -> str:
    """What one number for the whole mass does without identification, in a sentence.

    rm_mass, om : relative change of RM's error by these methods; over_rm_mass : of RM+mass's by OM.
    """
    if min(rm_mass, om) >= -SAME_WITHIN:
        gained = "neither is better than the table"
    elif over_rm_mass < -SAME_WITHIN:
        gained = f"OM errs by {number(-100.0 * over_rm_mass, 0)} % less than {RM_MASS}"
    else:
        gained = "identification gains nothing over that number"
    return (
        f"One number for the whole mass alone ({RM_MASS}) changes RM's error in the {quantity} by "
        f"{signed(100.0 * rm_mass)} %, OM by {signed(100.0 * om)} %: {gained}."
    )


# --- which parameters ---------------------------------------------------------------------------


def use_sentence(
    choice: pd.DataFrame | None,
    identification: pd.DataFrame,
    waits: str = "",
    is_known: bool = False,
) -> str:
    """Which method, by how much it is better than the others, and in which movements another; from
    the artifacts of these names. ``waits``: what is to be done first; ``is_known``: what the method
    is has been said."""
    use = f"{waits} Then use" if waits else "Use"
    if choice is None or choice.empty:
        return f"{use} {RM if is_known else TEXTS['methods_in_full'][RM]}: nothing was compared."
    first = choice.iloc[0]
    brief = (lambda method: method) if is_known else TEXTS["methods"].__getitem__
    others = [
        f"{brief(str(method))} for {listing(list(rows['movement']))}, where OM is "
        f"{'' if method == OM else 'not '}clearly better"
        for method, rows in choice.iloc[1:].groupby("use")
        if method != first["use"]
    ]
    most = str(first["use"]) if is_known else TEXTS["methods_in_full"][str(first["use"])]
    if others:
        most = f"{brief(str(first['use']))} for all other movements"
    rare = identification.loc[identification["rare"].astype(bool), "method"].tolist()
    compared = _compared(first, together=bool(others), is_rare=OM in rare)
    said = f"{use} {', and '.join([*others, most])}{compared}."
    warned = [
        f"Never use {m}: fewer than 1 in 100 people have such a body; other errors made it."
        for m in rare
    ]
    return " ".join([said, *warned])


def _compared(first: pd.Series, together: bool, is_rare: bool) -> str:
    """What the choice rests on, to go on with after the method's name; ``together``: over movements
    of which some ask for another method; ``is_rare``: OM is ruled out by its body."""
    if not np.isfinite([first[f"ratio_{name}"] for name in _PAIRS]).all():
        return ": no recording is left to judge OM by"
    om, scaled, over_scaled = (
        _change(first[f"ratio_{name}"], first[f"log_error_{name}"]) for name in _PAIRS
    )
    n = int(first["trials"])
    every = "all " if together and n > 1 else ""
    others = "both other recordings" if every and n == 2 else every + count(n, "other recording")
    where = {
        "whole_trials": f"in {others} ",
        "held_out": f"in {every}seconds of {count(n, 'recording')} that were held out ",
    }.get(str(first["data"]), "")
    if first["use"] == RM_MASS:
        return (
            f": {where}its error is {scaled} than RM's, and OM's error {over_scaled} than RM+mass's"
        )
    said = f"{om} than RM's and RM+mass's"
    if om != over_scaled:
        said = f"{om} than RM's, {over_scaled} than RM+mass's"
    if first["use"] == RM and not is_rare:
        return f": OM is not clearly better; {where}its error is {said}"
    whose = "its" if first["use"] == OM and not together else "OM's"
    return f": {where}{whose} error is {said}"


def _change(ratio: float, log_error: float) -> str:
    """``31 to 45 % smaller`` or ``5 % smaller to 16 % larger``: one standard error to either
    side."""
    ends = [100 * (end - 1) for end in Difference.of_ratio(ratio, log_error).interval()]
    if not np.isfinite(ends).all():
        ends = [100 * (ratio - 1)] * 2
    words = ["smaller" if end < 0 else "larger" for end in ends]
    if words[0] != words[1]:
        return f"{number(-ends[0], 0)} % smaller to {number(ends[1], 0)} % larger"
    sizes = [number(size, 0) for size in sorted(map(abs, ends))]
    return f"{' to '.join(dict.fromkeys(sizes))} % {words[0]}"


# --- three numbers of a recording against those of good laboratories and the literature -----------


COP, FORCE, MARKERS = "cop_mm", "vertical_force_percent_bw", "markers_mm"
COP_LIMIT_M, FORCE_LIMIT_PERCENT = "large_cop_error_m", "large_force_error_percent"
"""Options of the diagnosis: errors that are called large."""

SOURCES = (
    "Good to the first mark (Hansen 2017), bad from the second (Hicks 2015; markers: OpenSim)."
)
ENDS_AT = 2.0  # times the size that is called large, where every scale ends
_MARKER_GOOD_MM, _MARKER_LIMIT_MM = 10.0, 20.0
"""RMS of a fitted static pose, and of a movement, in OpenSim's checklist (Simulation with OpenSim,
Best Practices)."""


@dataclass(frozen=True)
class Yardstick:
    """``good`` and ``limit`` in ``unit``: up to the one it is as good as published, beyond the
    other it is large. ``brief``: its title where many stand in a line."""

    name: str
    title: str
    brief: str
    unit: str
    good: float
    limit: float

    def in_sentence(self) -> str:
        return f"{self.title[:1].lower()}{self.title[1:]}"

    def short(self) -> str:
        """Before its size."""
        return self.in_sentence().removesuffix(" error")

    def brief_unit(self) -> str:
        """Without of what."""
        return self.unit.partition(" ")[0]

    def is_large(self, value: float) -> bool:
        return value > self.limit

    def words(self, value: float) -> str:
        if not np.isfinite(value):
            return "not known"
        if self.is_large(value):
            return "bad: large"
        return "good" if value <= self.good else "acceptable"

    def scale(self, value: float) -> Scale:
        """On a scale from nothing to a fixed multiple of the limit, in every report the same."""
        end = ENDS_AT * self.limit
        return Scale(
            self.title,
            f"{number(value)} {self.unit}",
            self.words(value),
            min(value / end, 1.0) if np.isfinite(value) else 0.0,
            self.good / end,
            self.limit / end,
            f"{self.good:.2g}",
            number(self.limit, 0),
            bool(value > end),
        )


def yardsticks(cop_limit_m: float, force_limit_percent: float) -> tuple[Yardstick, ...]:
    """Of the centre of pressure, the vertical force and the markers."""
    cop = _published("cop_error"), 1e3 * cop_limit_m
    force = _published("grf_vertical"), force_limit_percent
    return (
        Yardstick(COP, "Centre of pressure (COP) error", "COP", "mm", *cop),
        Yardstick(FORCE, "Vertical force error", "vertical force", "% of body weight", *force),
        Yardstick(MARKERS, "Markers from model", "marker", "mm", _MARKER_GOOD_MM, _MARKER_LIMIT_MM),
    )


@cache
def _published(variable: str) -> float:
    """Median over the movements of the mean errors with identified parameters."""
    rows = [r for r in load_paper("hansen2017").table(4).rows if r.compare.startswith(variable)]
    return float(np.median([row.cells[OM].mean for row in rows if OM in row.cells]))


def errors_of(fits: Iterable[pd.DataFrame]) -> dict[str, float]:
    """Errors over trials, from rows of one method of each one's table ``fit``: the root mean square
    of those with held-out data, or of all where there are none; NaN where nothing is known."""
    rows = [_error(fit) for fit in fits]
    known = [row for row in rows if np.isfinite(row[COP]) or np.isfinite(row[FORCE])]
    chosen = [row for row in known if row["held_out"]] or known
    found = {}
    for name in (COP, FORCE):
        sizes = [row[name] for row in chosen if np.isfinite(row[name])]
        found[name] = float(np.sqrt(np.mean(np.square(sizes)))) if sizes else float("nan")
    return found


def _error(fit: pd.DataFrame) -> Mapping[str, float]:
    rows = fit.set_index("component")
    of = rows["rmse"].to_dict()
    cop = np.hypot(of.get("cop_ap", np.nan), of.get("cop_ml", np.nan))
    percent = rows["rmse_percent_bw"].to_dict().get("grf_vertical", np.nan)
    held_out = bool((fit["data"] == "held_out").any())
    return {COP: float(cop), FORCE: float(percent), "held_out": held_out}


# --- the error budget as people read it: what makes RM's error, in a few words and as bars --------


FIRST = ("fz", "cop_ap", "cop_ml")  # components that a reader asks for first
BEFORE = "squared error before identification"  # RM's, of which the budget is
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
    budget: pd.DataFrame,
    found: Collection[str],
    trial: str = "",
    components: Sequence[str] = FIRST,
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
    """Terms that stand in for each other are one group."""
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


def budget_sentences(budget: pd.DataFrame, found: Collection[str]) -> tuple[str, ...]:
    """What makes RM's error in all trials together, one component each, and what that is worth on
    data held out."""
    return tuple(filter(None, (_sentence(budget, component, found) for component in FIRST)))


def _sentence(budget: pd.DataFrame, component: str, found: Collection[str]) -> str:
    size, unit = size_of(budget, component)
    total = _total(budget, component)
    if total is None or not size >= LEAST_REPORTED_SIZE:
        return ""
    shares = pieces(budget, component, found)
    parts = [f"{_with(one, one.perhaps).label} {number(one.share, 0)} %" for one in shares]
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
