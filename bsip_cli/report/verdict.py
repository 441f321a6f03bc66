"""The diagnosis of one person in words: what is wrong, how large, how sure, what it does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from string import ascii_lowercase

import numpy as np
import pandas as pd

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.report import budget_words
from bsip_cli.report.blocks import Light
from bsip_cli.report.candidates import (
    OF_THE_WEIGHT,
    UNNAMED,
    Candidate,
    analysed,
    candidates_of,
    causes_of,
    effects_in,
    is_large,
    limits_of,
    limits_sentence,
)
from bsip_cli.report.cause_colours import NOISE, UNKNOWN, Piece
from bsip_cli.report.effect_words import (
    EFFECT_WORDS,
    WEIGHT,
    check_for,
    effect_title,
    separating_recording,
)
from bsip_cli.report.words import (
    METHODS,
    TEXTS,
    capital,
    component_label,
    count,
    findings,
    listing,
    number,
    segment_label,
    signed,
    trial_label,
)
from bsip_cli.statistics.methods import OM, RM

ALL_FAULTS = "wrong"  # address of the section that has all of them
_NEARLY_SURE = 1e-3  # probabilities this near to 0 or 1 are not given in digits
_MOST_GAINS = 3
_MOST_NAMED = 2  # recordings, in a line
_MOST_MEMBERS = 2  # of a group, in a line with their sizes
_MOST_CHANGES = 2
_MOST_STEPS = 3
_WORTH_KG, _WORTH_MM = 0.05, 1.0  # changes of the parameters below are none to a reader
_NO_TRIAL = "No recording has motion with every contact on a plate."
CAUSE_UNKNOWN = "cause unknown"
OF_IT_UNKNOWN = "of it unknown"
_NO_CAUSE = (UNKNOWN, NOISE)
MAY_HIDE = "Faults of any size may hide behind so large an error."
NONE_FOUND = f"none of the {len(EFFECTS)} faults that bsip knows was found"
NOT_RUN = "The recordings were not searched for errors: run `bsip diagnose`."


@dataclass(frozen=True)
class Verdict:
    """All that is said of a diagnosis.

    headline : whether anything is wrong.
    causes : a text per cause or group of causes that cannot be distinguished here.
    results : what the causes do to forces and parameters, and where they were looked for.
    advice : what follows for the reader.
    limits : what might have gone unseen; empty where that is not known.
    """

    headline: str
    causes: tuple[str, ...]
    results: tuple[str, ...]
    advice: tuple[str, ...]
    limits: str


def verdict_of(
    diagnosis: pd.DataFrame,
    detection: pd.DataFrame,
    gains: pd.DataFrame | None = None,
    changes: pd.DataFrame | None = None,
    budget: pd.DataFrame | None = None,
    before: Sequence[str] = (),
) -> Verdict:
    """From the artifacts ``diagnosis`` and ``detection``, and of ``extend`` where it has run
    ``gain`` and ``bsip-change``, with one method each. ``budget``: ``overall-error-budget``, where
    it is known. ``before``: findings of the report that come before those of the diagnosis."""
    causes = causes_of(candidates_of(diagnosis))
    everywhere = analysed(detection, diagnosis)
    light = light_of(diagnosis, detection, budget, before=len(before))
    results: list[str] = []
    if budget is not None:
        results += budget_words.budget_sentences(budget, effects_in(causes))
    if any(cause[0].effect != UNNAMED for cause in causes):  # what has a name is put into a model
        results += _results(gains, changes)
    if everywhere:
        results.append(f"Recordings analysed: {listing([*map(trial_label, everywhere)])}.")
    return Verdict(
        f"{light.title}. {light.text}".rstrip(),
        (*before, *(cause_text(cause, everywhere) for cause in causes)),
        tuple(results),
        (*filter(None, [_named_twice(causes)]), *consequences(causes, 1 + len(before))),
        unseen(detection, diagnosis),
    )


def unseen(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> str:
    """What might have been missed; empty where that is not known."""
    if any(is_large(cause) for cause in causes_of(candidates_of(diagnosis))):
        return MAY_HIDE
    return limits_sentence(limits_of(detection, diagnosis))


def light_of(
    diagnosis: pd.DataFrame | None,
    detection: pd.DataFrame | None,
    budget: pd.DataFrame | None = None,
    large: Sequence[str] | None = None,
    use: str = RM,
    alone: Sequence[str] = (),
    before: int = 0,
) -> Light:
    """Whether anything is wrong with a person's recordings: fine, a cause named, a large error that
    nothing explains, or inconclusive. ``large``: the yardsticks beyond which the errors are with
    the method ``use``, None where that is not known; ``alone``: the recordings whose own errors
    are; ``budget`` is of RM's; ``before``: findings of the report besides the diagnosis'."""
    if diagnosis is None or detection is None:
        return Light("inconclusive", "Not examined", NOT_RUN)
    if diagnosis.empty:
        return Light("inconclusive", "Inconclusive", _NO_TRIAL)
    causes = causes_of(candidates_of(diagnosis))
    unsure = [c[0] for c in causes if c[0].effect == "inconclusive"]
    if unsure:
        return Light("inconclusive", "Inconclusive", f"{capital(unsure[0].words.what)}.")
    looked = count(len(analysed(detection, diagnosis)), "recording")
    nothing = f"{capital(NONE_FOUND)} in {looked}."
    found = count(len(causes) + before, "finding")
    if large or any(is_large(cause) for cause in causes):
        title = f"Large error{mostly(budget, effects_in(causes), use)}"
        title += f"; {found}" if len(causes) + before > 1 else ""  # one is the error itself
        said = f"Large with {METHODS[use]}: {listing(large)}." if large else ""
        return Light("large", title, " ".join(filter(None, (said, "" if causes else nothing))))
    no_large = f"no large error{f' except in {listing(alone)}' if alone else ''}"
    if not causes:
        title = "No fault found" if large is None else f"Fine: no fault found, {no_large}"
        return Light("fine", title, nothing)
    share = np.nan if budget is None else budget_words.found_share(budget, effects_in(causes))
    size = f"{number(share, 0)} %" if share >= 1.0 else "less than 1 %"
    named = "" if np.isnan(share) else f"What was found makes {size} of the {budget_words.BEFORE}."
    if len({effect_title(one.effect) for cause in causes for one in cause}) == 1:
        found += f": {effect_title(causes[0][0].effect)}"
    title = found if large is None else f"{found}; {no_large}"
    return Light("cause", title, named or f"Searched: {looked}.")


def mostly(budget: pd.DataFrame | None, found: Collection[str], use: str = RM) -> str:
    """Of a large error, what makes most of it, one part or two: ``, most of it soft tissue (56 %)``;
    else the largest part. Errors with identified parameters are not the table's."""
    ranked, is_left = _ranked(budget, found, use)
    if is_left:
        return " even with OM"
    first, second = [*ranked, None, None][:2]
    if first is None or first.label in _NO_CAUSE:
        if first is not None and first.label == UNKNOWN and first.share <= 50.0:
            return f", {number(first.share, 0)} % {OF_IT_UNKNOWN}"
        return f", {CAUSE_UNKNOWN}"
    if first.share >= 100.0:  # what another part takes off again is beyond the whole
        return f", all of it {first.label}"
    said = f"{first.label} ({number(first.share, 0)} %)"
    if first.share > 50.0:
        return f", most of it {said}"
    if second is None or second.label in _NO_CAUSE or first.share + second.share <= 50.0:
        return f", the largest part of it {said}"
    return f", most of it {said} and {second.label} ({number(second.share, 0)} %)"


def main_part(
    budget: pd.DataFrame | None, found: Collection[str], use: str = RM
) -> tuple[Piece | None, bool]:
    """Of a large error with the method ``use``, what makes the largest part; None if unknown, so
    that nothing is of unknown cause whose bar has no such part. And whether that is only what the
    table's parameters leave, which OM should have taken away."""
    ranked, is_left = _ranked(budget, found, use)
    most = next(iter(ranked), None)
    return (None if most is None or most.label in _NO_CAUSE else most), is_left


def _ranked(
    budget: pd.DataFrame | None, found: Collection[str], use: str
) -> tuple[list[Piece], bool]:
    """The parts of `main_part`, the largest first, and whether they are what OM has left."""
    parts = () if budget is None or budget.empty else budget_words.overall_pieces(budget, found)
    whole = [one for one in parts if one.label != budget_words.REST]  # which has no name
    ranked = sorted(whole, key=lambda one: -one.share)
    is_left = use == OM and bool(ranked) and budget_words.PARAMETERS in ranked[0].label
    return ranked[is_left:], is_left


def cause_line(cause: Sequence[Candidate], everywhere: Sequence[str], at_joints: str = "") -> str:
    """What, how large compared with what laboratories meet, where and how sure, as short as
    possible; ``at_joints``: what it changes there."""
    sure = probability_words(probability_of(cause))
    if len(cause) > 1:
        return _group_line(cause, sure)
    (one,) = cause
    some = _MOST_NAMED < len(one.trials) < len(everywhere)
    where = where_seen(one.trials, everywhere)
    where = f"in {len(one.trials)} of {len(everywhere)} recordings" if some else where
    title = capital(effect_title(one.effect))  # as the error budget calls it
    if is_large(cause):
        return f"{title}: {one.words.short}, {where}; {one.words.against}."
    said = [one.against_usual(), f"; {at_joints}" if at_joints else ""]
    said += [f"; probability {sure}" if sure else ""]
    what = one.in_words(brief=True).removeprefix("of unknown cause: ")
    line = f"{title}: {what}, {where}{''.join(said)}."
    return f"{line} {one.which_size(short=True)}".rstrip()


def _group_line(cause: Sequence[Candidate], sure: str) -> str:
    if cause[0].class_id == OF_THE_WEIGHT:
        mass = probability_words(1 - probability_of(cause))
        either = ", ".join(one.words.short for one in cause)
        return (
            f"{capital(cause[0].words.against)}: either {either}, or the stated mass is wrong "
            f"(probability of the last {mass})."
        )
    ranked = sorted(cause, key=lambda one: one.effect == UNNAMED)
    members = []
    for one in ranked[: _MOST_MEMBERS if len(cause) == _MOST_MEMBERS else 1]:
        size = "" if one.effect == UNNAMED else f" ({one.words.short or one.words.what})"
        members.append(f"{effect_title(one.effect)}{size}")
    places = Counter(effect_title(one.effect) for one in ranked[len(members) :])
    others = [f"{title} ({n} places)" if n > 1 else title for title, n in places.items()]
    return (
        f"One of {len(cause)} causes that look alike here: {'; '.join((*members, *others))}. "
        f"Together {sure}."
    )


# --- a cause ----------------------------------------------------------------------------------


def cause_text(cause: Sequence[Candidate], everywhere: Sequence[str]) -> str:
    """A cause, or a group of which one is there: what, how large, where and how probable."""
    first = cause[0]
    places, sure = [f", {where_seen(one.trials, everywhere)}" for one in cause], _how_sure(cause)
    if len(cause) == 1:
        said = (f"{capital(first.in_words())}{places[0]}.", sure, first.which_size())
        return " ".join(filter(None, said))
    common, own = (places[0], [""] * len(cause)) if len(set(places)) == 1 else ("", places)
    members = []
    for k, (one, place) in enumerate(zip(cause, own, strict=True)):
        words = probability_words(one.probability)
        probability = f", probability {words}" if words else ""
        members.append(f"({ascii_lowercase[k]}) {one.in_words()}{place}{probability}")
    steps = separating_recording([(one.effect, one.target) for one in cause], _MOST_STEPS)
    if first.class_id == OF_THE_WEIGHT:
        steps = f"weigh the person on a scale; {steps}"
    return (
        f"One of these, which these recordings cannot distinguish{common}: {'; '.join(members)}. "
        f"{sure}{' ' if sure else ''}To distinguish them: {steps}."
    )


def where_seen(trials: Sequence[str], everywhere: Sequence[str]) -> str:
    """``in all 4 recordings`` or ``only in squat (run 3)``; ``everywhere``: those analysed."""
    names = [trial_label(stem) for stem in trials]
    if len(everywhere) > 1 and set(trials) >= set(everywhere):
        every = "both" if len(everywhere) == 2 else f"all {len(everywhere)}"
        return f"in {every} recordings"
    return f"{'only ' if set(trials) < set(everywhere) else ''}in {listing(names)}"


def _how_sure(cause: Sequence[Candidate]) -> str:
    words = probability_words(probability_of(cause))
    if words:
        rest = ", else the stated mass is wrong" if cause[0].class_id == OF_THE_WEIGHT else ""
        words = f"probability {words}" if len(cause) == 1 else f"together {words}{rest}"
    said = [words] if words else []
    for letter, (gain, low, high) in zip(
        ascii_lowercase, (one.gain for one in cause), strict=False
    ):
        if np.isfinite(gain):  # else it was not tested
            share, least, most = (number(x, 0 if gain >= 10 else 1) for x in (gain, low, high))
            which = f"({letter}) " if len(cause) > 1 else ""
            perhaps = "" if low > 0 else ": too few seconds to be sure"
            said.append(
                f"{which}explains {share} % ({least} to {most} %{perhaps}) of the squared "
                "difference in seconds it was not fitted to"
            )
    return f"{capital('; '.join(said))}." if said else ""


def probability_of(cause: Sequence[Candidate]) -> float:
    """That one of them is there; NaN where the diagnosis gives none."""
    return float(sum(one.probability for one in cause))


def probability_words(probability: float) -> str:
    """``99.5 %`` or ``over 99.9 %``; empty where there is none."""
    if np.isnan(probability):
        return ""
    if probability > 1 - _NEARLY_SURE:
        return "over 99.9 %"
    return f"{number(100 * probability, 1)} %" if probability >= _NEARLY_SURE else "under 0.1 %"


# --- what it does -----------------------------------------------------------------------------


def _results(gains: pd.DataFrame | None, changes: pd.DataFrame | None) -> Iterator[str]:
    if gains is None:
        yield "What it does to the result is not known: run `bsip extend`."
        return
    said = [gain_sentence(gains), change_sentence(changes) if changes is not None else ""]
    yield from filter(None, said)


def gain_sentence(gains: pd.DataFrame) -> str:
    """What the causes do to the forces: the components that improve most, and those that lose.

    ``gains`` is a ``gain`` table; empty text where it has no number. The vertical force, which it
    has twice, counts once.
    """
    whole = gains[np.isfinite(gains["gain_percent"]) & (gains["component"] != "fz")]
    if whole.empty:
        return ""
    best = whole[whole["gain_percent"] > 0].nlargest(_MOST_GAINS, "gain_percent")
    worse = [component_label(c) for c in whole.loc[whole["ci_high"] < 0, "component"]]
    rises = f" The error rises in {listing(worse)}." if worse else ""
    if best.empty:
        return f"With what was found in the model, no component follows better.{rises}"
    parts = [
        f"{component_label(r['component'])} {number(r['rmse_before'], 2)} → "
        f"{number(r['rmse_after'], 2)} {r['unit']} ({number(r['gain_percent'], 0)} % less, "
        f"{number(r['ci_low'], 0)} to {number(r['ci_high'], 0)} %)"
        for r in best.to_dict("records")
    ]
    return (
        "What it does to the forces: with what was found in the model, the error on data that did "
        f"not size it falls most in {'; '.join(parts)}.{rises}"
    )


def change_sentence(changes: pd.DataFrame) -> str:
    """What the causes do to the person's parameters; ``changes`` is a ``bsip-change`` table."""
    if changes.empty:
        return ""
    large = changes["mass_change_kg"].abs() >= _WORTH_KG
    worth = changes[large | (1000.0 * changes["com_change_m"] >= _WORTH_MM)]
    if worth.empty:
        return (
            "What it does to the body's parameters: next to nothing; no segment changes by "
            f"{_WORTH_KG:g} kg or {_WORTH_MM:g} mm."
        )
    by_mass = worth.loc[worth["mass_change_kg"].abs().nlargest(_MOST_CHANGES).index]
    by_place = worth.loc[worth["com_change_m"].nlargest(1).index]
    rows = pd.concat([by_mass, by_place]).drop_duplicates("segment")
    parts = [
        f"{segment_label(r['segment'])} {signed(r['mass_change_kg'], 2)} kg, its centre of mass "
        f"moves by {number(1000 * r['com_change_m'], 0)} mm"
        for r in rows.to_dict("records")
    ]
    return (
        "What it does to the body's parameters: with what was found in the model, most of all "
        f"{'; '.join(parts)}."
    )


def corrected_sentence(events: Sequence[tuple[str, pd.DataFrame]]) -> tuple[str, ...]:
    """What ``ik`` has corrected, from (stem, ``marker-events``); nothing where there was nothing."""
    said = [
        f"in {trial_label(stem)} {text}"
        for stem, table in events
        for text in table.loc[table["put_right"].astype(bool), "what"]
    ]
    return (f"Corrected already, before the search for faults: {'; '.join(said)}.",) if said else ()


def consequences(
    causes: Sequence[Sequence[Candidate]], first: int = 1, only_actions: bool = False
) -> tuple[str, ...]:
    """What the causes mean for the reader and what is to be done, or the latter only; each once and
    with the numbers of its causes, of which the ``first`` is given."""
    numbers: dict[str, list[int]] = {}
    for k, cause in enumerate(causes, start=first):
        if only_actions and (is_large(cause) or len(cause) > 1):
            continue  # of these another line says where to look, and what to record
        for meaning, action in _consequences_of(cause):
            text = action if only_actions else f"{meaning} {action}".rstrip()
            numbers.setdefault(text, []).append(k)
    if len(causes) == first == 1 and not only_actions:
        return tuple(filter(None, numbers))
    return tuple(f"{capital(findings(of))}: {text}" for text, of in numbers.items() if text)


def _consequences_of(cause: Sequence[Candidate]) -> tuple[tuple[str, str], ...]:
    if cause[0].class_id == OF_THE_WEIGHT:
        return (WEIGHT,)
    known = [EFFECT_WORDS[one.effect] for one in cause if one.effect in EFFECT_WORDS]
    if len(cause) == 1 and cause[0].effect == UNNAMED:
        check = check_for(cause[0].target, [size.name for size in cause[0].numbers])
        known = [replace(known[0], action=check or known[0].action)]
    said = [*dict.fromkeys((words.meaning, words.action) for words in known)]
    if all(one.scope == "laboratory" for one in cause):
        said.append((TEXTS["of_the_laboratory"], ""))
    return tuple(said)


def _named_twice(causes: Sequence[Sequence[Candidate]]) -> str:
    """A warning where one cause was kept more than once in the same recording; else empty."""
    places = [(cause[0].label, stem) for cause in causes for stem in cause[0].trials]
    twice = dict.fromkeys(label for label, stem in places if places.count((label, stem)) > 1)
    if not twice:
        return ""
    return (
        f"Named more than once: {listing(list(twice))}. Its parts add up, and their single sizes "
        "and intervals, and faults named between them, should not be trusted."
    )
