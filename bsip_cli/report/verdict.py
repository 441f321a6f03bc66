"""The diagnosis of one person in words: what is wrong, how large, how sure, what it does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from string import ascii_lowercase

import numpy as np
import pandas as pd

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.report import budget as budgets
from bsip_cli.report import causes as of_causes
from bsip_cli.report.blocks import Light
from bsip_cli.report.budget import NOISE, UNKNOWN, Piece
from bsip_cli.report.causes import (
    OF_THE_WEIGHT,
    UNNAMED,
    Candidate,
    analysed,
    candidates_of,
    causes_of,
    effect_title,
    effects_in,
    is_large,
)
from bsip_cli.report.words import (
    METHODS,
    TEXTS,
    capital,
    count,
    findings,
    listing,
    number,
    probability_words,
    say,
    trial_label,
)
from bsip_cli.statistics.methods import RM

ALL_FAULTS = "wrong"  # address of the section that has all of them
_MOST_GAINS = 3
_MOST_NAMED = 2  # recordings, in a line
_MOST_MEMBERS = 2  # of a group, in a line with their sizes
_MOST_CHANGES = 2
_MOST_STEPS = 3
_WORTH_KG, _WORTH_MM = 0.05, 1.0  # changes of the parameters below are none to a reader
NO_CAUSE = (UNKNOWN, NOISE)  # as labels of parts
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
        results += budgets.budget_sentences(budget, effects_in(causes))
    if any(cause[0].effect != UNNAMED for cause in causes):  # what has a name is put into a model
        if gains is None:
            results.append("What it does to the result is not known: run `bsip extend`.")
        else:
            results += [gain_sentence(gains), "" if changes is None else change_sentence(changes)]
    if everywhere:
        results.append(f"Recordings analysed: {listing([*map(trial_label, everywhere)])}.")
    places = [(cause[0].label, stem) for cause in causes for stem in cause[0].trials]
    twice = dict.fromkeys(label for label, stem in places if places.count((label, stem)) > 1)
    warning = [say("named_twice", labels=list(twice))] if twice else []
    return Verdict(
        f"{light.title}. {light.text}".rstrip(),
        (*before, *(cause_text(cause, everywhere) for cause in causes)),
        tuple(filter(None, results)),
        (*warning, *consequences(causes, 1 + len(before))),
        unseen(detection, diagnosis),
    )


def unseen(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> str:
    """What might have been missed; empty where that is not known."""
    if any(is_large(cause) for cause in causes_of(candidates_of(diagnosis))):
        return "Faults of any size may hide behind so large an error."
    return of_causes.limits_sentence(of_causes.limits_of(detection, diagnosis))


# --- whether anything is wrong --------------------------------------------------------------------


def light_of(
    diagnosis: pd.DataFrame | None,
    detection: pd.DataFrame | None,
    budget: pd.DataFrame | None = None,
    large: Sequence[str] | None = None,
    use: str = RM,
    alone: Sequence[str] = (),
    before: int = 0,
    even_with_om: bool = False,
) -> Light:
    """Whether anything is wrong with a person's recordings: fine, a cause named, a large error that
    nothing explains, or inconclusive. ``large``: the yardsticks beyond which the errors are with
    the method ``use``, None where that is not known; ``alone``: the recordings whose own errors
    are; ``budget`` is of RM's; ``before``: findings of the report besides the diagnosis';
    ``even_with_om``: they are large with OM, too."""
    if diagnosis is None or detection is None:
        return Light("inconclusive", "Not examined", NOT_RUN)
    if diagnosis.empty:
        no_trial = "No recording has motion with every contact on a plate."
        return Light("inconclusive", "Inconclusive", no_trial)
    causes = causes_of(candidates_of(diagnosis))
    for one, *_ in causes:
        if one.effect == "inconclusive":
            return Light("inconclusive", "Inconclusive", f"{capital(one.words.what)}.")
    looked = count(len(analysed(detection, diagnosis)), "recording")
    nothing = f"{capital(NONE_FOUND)} in {looked}."
    effects, titles = effects_in(causes), {effect_title(x) for x in effects_in(causes)}
    n = len(causes) + before
    found = count(n, "finding")
    if large or any(is_large(cause) for cause in causes):
        title = f"Large error{mostly(budget, effects, even_with_om)}"
        title += f"; {found}" if n > 1 else ""  # one is the error itself
        said = f"Large with {METHODS[use]}: {listing(large)}." if large else ""
        return Light("large", title, " ".join(filter(None, (said, "" if causes else nothing))))
    no_large = f"no large error{f' except in {listing(alone)}' if alone else ''}"
    if not causes:
        title = "No fault found" if large is None else f"Fine: no fault found, {no_large}"
        return Light("fine", title, nothing)
    share = np.nan if budget is None else budgets.found_share(budget, effects)
    size = f"{number(share, 0)} %" if share >= 1.0 else "less than 1 %"
    makes = f"What was found makes {size} of the {budgets.BEFORE}."
    title = f"{found}: {titles.pop()}" if len(titles) == 1 else found
    title += "" if large is None else f"; {no_large}"
    return Light("cause", title, f"Searched: {looked}." if np.isnan(share) else makes)


def mostly(budget: pd.DataFrame | None, found: Collection[str], even_with_om: bool) -> str:
    """Of a large error, what makes most of it, one part or two; what was not found only goes along
    with it: ``, most of it along with soft tissue (56 %)``; else the largest part."""
    ranked, is_left = ranked_parts(budget, found, even_with_om)
    parts = [(one.label, one.share) for one in ranked[:2]] + [("", 0.0)] * 2
    sure = bool(ranked) and {*ranked[0].terms} <= {f"{budgets.FAULT}:{x}" for x in found}
    return say("mostly", is_left=is_left, parts=parts, sure=sure, nameless=("", *NO_CAUSE))


def ranked_parts(
    budget: pd.DataFrame | None, found: Collection[str], even_with_om: bool
) -> tuple[list[Piece], bool]:
    """What makes a large error, the largest part first, and whether that is only what the table's
    parameters leave, which OM should have taken away."""
    parts = () if budget is None or budget.empty else budgets.overall_pieces(budget, found)
    whole = [one for one in parts if one.label != budgets.REST]  # which has no name
    ranked = sorted(whole, key=lambda one: -one.share)
    is_left = even_with_om and bool(ranked) and budgets.PARAMETERS in ranked[0].label
    return ranked[is_left:], is_left


# --- a cause --------------------------------------------------------------------------------------


def cause_line(cause: Sequence[Candidate], everywhere: Sequence[str], at_joints: str = "") -> str:
    """What, how large compared with what laboratories meet, where and how sure, as short as
    possible; ``at_joints``: what it changes there."""
    sure = probability_words(probability_of(cause))
    if cause[0].class_id == OF_THE_WEIGHT and len(cause) > 1:
        wrong = probability_words(1 - probability_of(cause))
        return say("line_of_weight", group=cause, mass=wrong)
    if len(cause) > 1:
        members, where = [*_members(cause)], _common_place(cause, everywhere)
        return say("line_of_group", n=len(cause), members=members, where=where, sure=sure)
    (one,) = cause
    some = _MOST_NAMED < len(one.trials) < len(everywhere) and not one.is_of_all
    where = where_seen(one, everywhere)
    where = f"in {len(one.trials)} of {len(everywhere)} recordings" if some else where
    what = one.in_words(brief=True).removeprefix("of unknown cause: ")
    title = effect_title(one.effect)  # as the error budget calls it
    known = {"title": title, "where": where, "what": what, "sure": sure, "at_joints": at_joints}
    return say("line", one=one, large=is_large(cause), **known)


def _members(cause: Sequence[Candidate]) -> Iterator[str]:
    """Of a group: the first, or both of two, with their sizes; then the titles of the others."""
    ranked = sorted(cause, key=lambda one: one.effect == UNNAMED)
    most = _MOST_MEMBERS if len(cause) == _MOST_MEMBERS else 1
    for one in ranked[:most]:
        size = "" if one.effect == UNNAMED else f" ({one.words.short or one.words.what})"
        yield f"{effect_title(one.effect)}{size}"
    places = Counter(effect_title(one.effect) for one in ranked[most:])
    yield from (f"{title} ({n} places)" if n > 1 else title for title, n in places.items())


def cause_text(cause: Sequence[Candidate], everywhere: Sequence[str]) -> str:
    """A cause, or a group of which one is there: what, how large, where and how probable."""
    is_group = len(cause) > 1
    of_the_weight = cause[0].class_id == OF_THE_WEIGHT
    sure = []
    if words := probability_words(probability_of(cause)):
        rest = ", else the stated mass is wrong" if of_the_weight else ""
        sure.append(f"together {words}{rest}" if is_group else f"probability {words}")
    for letter, one in zip(ascii_lowercase, cause, strict=False):
        if np.isfinite(one.gain[0]):  # else it was not tested
            digits, which = 0 if one.gain[0] >= 10 else 1, letter if is_group else ""
            sure.append(say("explains", gain=one.gain, letter=which, digits=digits))
    members = [(one.effect, one.target) for one in cause]
    return say(
        "cause",
        group=cause,
        places=[where_seen(one, everywhere) for one in cause],
        common=_common_place(cause, everywhere),
        sure=sure,
        letters=ascii_lowercase,
        of_the_weight=of_the_weight,
        steps=of_causes.separating_recording(members, _MOST_STEPS) if is_group else "",
    )


def _common_place(cause: Sequence[Candidate], everywhere: Sequence[str]) -> str:
    """Where all of a group are seen; empty if in different recordings."""
    places = {where_seen(one, everywhere) for one in cause}
    return places.pop() if len(places) == 1 else ""


def where_seen(one: Candidate, everywhere: Sequence[str]) -> str:
    """``in all 4 recordings analysed`` or ``only in squat (run 3)``; ``everywhere``: those."""
    if one.is_of_all:
        return f"in the recordings of {one.persons} persons"
    names = [trial_label(stem) for stem in one.trials]
    if len(everywhere) > 1 and {*one.trials} >= {*everywhere}:
        every = "both" if len(everywhere) == 2 else f"all {len(everywhere)}"
        return f"in {every} recordings analysed"
    return f"{'only ' if {*one.trials} < {*everywhere} else ''}in {listing(names)}"


def probability_of(cause: Sequence[Candidate]) -> float:
    """That one of them is there; NaN where the diagnosis gives none."""
    return float(sum(one.probability for one in cause))


# --- what it does ---------------------------------------------------------------------------------


def gain_sentence(gains: pd.DataFrame) -> str:
    """What the causes do to the forces: the components that improve most, and those that lose.

    ``gains`` is a ``gain`` table; empty text where it has no number. The vertical force, which it
    has twice, counts once.
    """
    whole = gains[np.isfinite(gains["gain_percent"]) & (gains["component"] != "fz")]
    if whole.empty:
        return ""
    best = whole[whole["gain_percent"] > 0].nlargest(_MOST_GAINS, "gain_percent")
    worse = list(whole.loc[whole["ci_high"] < 0, "component"])
    return say("gain", best=best.to_dict("records"), worse=worse)


def change_sentence(changes: pd.DataFrame) -> str:
    """What the causes do to the person's parameters; ``changes`` is a ``bsip-change`` table."""
    if changes.empty:
        return ""
    large = changes["mass_change_kg"].abs() >= _WORTH_KG
    worth = changes[large | (1000.0 * changes["com_change_m"] >= _WORTH_MM)]
    by_mass = worth.loc[worth["mass_change_kg"].abs().nlargest(_MOST_CHANGES).index]
    by_place = worth.loc[worth["com_change_m"].nlargest(1).index]
    rows = pd.concat([by_mass, by_place]).drop_duplicates("segment").to_dict("records")
    return say("change", rows=rows, kg=f"{_WORTH_KG:g}", mm=f"{_WORTH_MM:g}")


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
    """What it means, and what to do; both of every family once."""
    if cause[0].class_id == OF_THE_WEIGHT:  # quiet stance contradicts a stated mass
        return (tuple(TEXTS["weight"]),)
    words = of_causes.EFFECT_WORDS
    known = [words[one.effect] for one in cause if one.effect in words]
    if len(cause) == 1 and cause[0].effect == UNNAMED:
        check = of_causes.check_for(cause[0].target, [size.name for size in cause[0].numbers])
        known = [replace(known[0], action=check or known[0].action)]
    said = [*dict.fromkeys((words.meaning, words.action) for words in known)]
    if all(one.scope == "laboratory" for one in cause):
        said.append((TEXTS["of_the_laboratory"], ""))
    return tuple(said)
