"""From what the selection kept to what is said: causes, classes of causes, or none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from string import ascii_uppercase
from typing import Literal

import numpy as np

from bsip_cli.diagnosis.explanation import Explanation
from bsip_cli.diagnosis.intervals import drawn_explanations
from bsip_cli.diagnosis.judging import NAMELESS_LEAST, NAMELESS_WORTH, TINY_WORTH, Tried
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.refitting import alike
from bsip_cli.diagnosis.rounds import Round, Selection
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.readable import digits_of, readable_unit, with_unit

Verdict = Literal["named", "ambiguous", "rejected"]
_MOMENTS = {"start", "end", "from_time", "release_time"}
_LETTERS = ascii_uppercase.replace("W", "")  # W is the class of the stated mass


@dataclass(frozen=True)
class Number:
    """A parameter as the diagnosis prints it; NaN where no interval was computed."""

    name: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Finding:
    """A candidate and what is made of it.

    trials : their names. class_id : of causes that cannot be told apart; empty for a single one.
    gain : percent of the squared white residual on data held out, and its interval.
    """

    effect: str
    target: str
    trials: tuple[str, ...]
    verdict: Verdict
    class_id: str
    p_value: float
    gain: tuple[float, float, float]
    numbers: tuple[Number, ...]
    sentence: str


def findings_of(selection: Selection, rng: np.random.Generator) -> tuple[Finding, ...]:
    """All candidates that were looked at in full: those kept first, with their rivals."""
    evidence = selection.signatures.evidence
    kept = list(_kept(selection))
    said = {_key(cause.explanation) for _, cause, _ in kept}
    findings = []
    told: set[int] = set()
    names = (a + b for a, b in product(("", *_LETTERS), _LETTERS))  # A, B, ... Z, AA, AB ...
    for one, cause, number in kept:
        numbers = _numbers(evidence, cause, _draws(evidence, cause, number, rng))
        rivals = [
            rival
            for rival in cause.rivals
            if not any(_same(rival.explanation, other.explanation) for _, other, _ in kept)
        ]
        said.update(_key(rival.explanation) for rival in rivals)
        class_id = next(names) if rivals else ""
        remedy = cause.explanation.effect.remedy
        findings.append(_finding(evidence, cause, numbers, class_id, remedy))
        told.update(cause.trials)
        for rival in rivals:
            its = _numbers(one.evidence, rival, _draws(one.evidence, rival, -1, rng))
            findings.append(_finding(one.evidence, rival, its, class_id, remedy))
    findings += _without_name(selection, told)
    tried_in_all = (tried for one in selection.rounds for tried in one.tried)
    for tried in sorted(tried_in_all, key=lambda t: t.given_up is None):
        if _key(tried.explanation) not in said:
            said.add(_key(tried.explanation))
            findings.append(_rejected(evidence, tried))
    return tuple(findings)


def _without_name(selection: Selection, told: set[int]) -> Iterator[Finding]:
    """Trials of which nothing else is told, though a cause was found there and given up: what is
    wrong has no name. Each trial once, with the cause that came nearest."""
    given_up = [
        (tried, tried.given_up.nearest)
        for one in selection.rounds
        for tried in one.tried
        if tried.given_up and tried.given_up.nearest and not tried.is_too_little_unnamed
    ]
    for tried, why in sorted(given_up, key=lambda one: -one[0].score):
        left = tuple(t for t in tried.trials if t not in told)
        if left:
            told = told | set(left)
            yield _nearest(selection.signatures.evidence, tried, why, left)


def _nearest(evidence: Evidence, tried: Tried, why: str, trials: tuple[int, ...]) -> Finding:
    one = tried.explanation
    sentence = one.sentence(evidence)
    if one.effect.name != UNEXPLAINED:
        sentence = f"something without a name; the nearest cause {why} ({sentence})"
    numbers = (Number("explained", "1", tried.gain.percent / 100, np.nan, np.nan),)
    without_name = _with(evidence, tried, "named", "", numbers, sentence)
    names = tuple(evidence.trials[t].name for t in trials)
    return replace(without_name, effect=UNEXPLAINED, target="", trials=names)


def _kept(selection: Selection) -> Iterator[tuple[Round, Tried, int]]:
    """Rounds and what they kept, with the numbers of the last fit and the place in it."""
    kept = ((one, one.kept) for one in selection.rounds if one.kept is not None)
    last = zip(kept, selection.fit.explanations, strict=True)
    for number, ((one, cause), explanation) in enumerate(last):
        yield one, replace(cause, explanation=explanation, fit=selection.fit), number


def _key(one: Explanation) -> tuple:
    return one.effect, one.target, one.place.trials


def _same(one: Explanation, other: Explanation) -> bool:
    """The same cause, looked at in fewer or more trials."""
    return alike(one, other) and not set(one.place.trials).isdisjoint(other.place.trials)


def _finding(
    evidence: Evidence,
    tried: Tried,
    numbers: tuple[Number, ...],
    class_id: str,
    remedy: str,
) -> Finding:
    """A cause that is kept, or with a ``class_id`` one of several."""
    sentence = _plainest(evidence, tried).sentence(evidence) + interval_words(numbers)
    verdict: Verdict = "ambiguous" if class_id else "named"
    if class_id:
        sentence += f"; other causes look alike here: to tell them apart, {remedy}"
    return _with(evidence, tried, verdict, class_id, numbers, sentence)


def _plainest(evidence: Evidence, tried: Tried) -> Explanation:
    return tried.explanation.alike(evidence)[0]


def _why_not(tried: Tried) -> str:
    """Why a candidate is not told."""
    if not tried.is_rare:
        percent = 100 * tried.p_value
        often = f"{percent:.0f}" if percent >= 1 else f"{percent:.1g}"
        return f"chance brings as much in {often} % of cases"
    if tried.is_leftover:
        return "it is no more than what a larger cause leaves behind"
    if tried.given_up:
        return tried.given_up.why
    if not tried.is_good:
        helps = (
            "makes the error larger" if tried.gain.percent < 0 else "hardly helps, or not for sure"
        )
        return f"on data held out it {helps}"
    if tried.is_slight and tried.is_tiny:
        least = 100 * NAMELESS_LEAST
        why = f"it has no name, changes the forces by less than {least:g} % of body weight"
        enough = f"explains less than {100 * TINY_WORTH:.0f} %"
        return f"{why}, and {enough if tried.is_first else 'another cause is there'}"
    if tried.is_slight:
        return f"it has no name and explains less than {100 * NAMELESS_WORTH:.0f} %, as skin may"
    return "another cause explains it better"


def _rejected(evidence: Evidence, tried: Tried) -> Finding:
    sentence = f"not so: {tried.explanation.sentence(evidence)} ({_why_not(tried)})"
    return _with(evidence, tried, "rejected", "", _bare(evidence, tried), sentence)


def _with(
    evidence: Evidence,
    tried: Tried,
    verdict: Verdict,
    class_id: str,
    numbers: tuple[Number, ...],
    sentence: str,
) -> Finding:
    one = tried.explanation
    trials = tuple(evidence.trials[t].name for t in one.place.trials)
    return Finding(
        one.effect.name,
        one.target,
        trials,
        verdict,
        class_id,
        tried.p_value,
        tried.gain.interval(),
        numbers,
        sentence,
    )


def _draws(
    evidence: Evidence, tried: Tried, number: int, rng: np.random.Generator
) -> list[Explanation]:
    """The explanation with that number in its fit, as it might as well be."""
    return drawn_explanations(evidence, tried.fit, number % len(tried.fit.explanations), rng)


def _numbers(evidence: Evidence, tried: Tried, draws: list[Explanation]) -> tuple[Number, ...]:
    """What is reported of a cause, with intervals."""
    reported = _plainest(evidence, tried).reported(evidence)
    return numbers_of(reported, [draw.reported(evidence) for draw in draws])


def _bare(evidence: Evidence, tried: Tried) -> tuple[Number, ...]:
    """What is reported of it, without intervals."""
    reported = tried.explanation.reported(evidence)
    return tuple(Number(name, unit, x, np.nan, np.nan) for name, unit, x in reported)


Reported = tuple[tuple[str, str, float], ...]


def numbers_of(reported: Reported, drawn: Sequence[Reported]) -> tuple[Number, ...]:
    """What is reported, with the 95 % intervals of draws."""
    values = np.array([[x for *_, x in one] for one in drawn])
    low, high = np.percentile(values, [2.5, 97.5], axis=0)
    return tuple(
        Number(n, u, x, min(float(a), x), max(float(b), x))
        for (n, u, x), a, b in zip(reported, low, high, strict=True)
    )


def interval_words(numbers: tuple[Number, ...]) -> str:
    """Of the surest size, with the digits that its interval deserves."""
    first = max(_sizes(numbers), key=lambda x: abs(x.value) / max(x.high - x.low, 1e-12))
    factor, unit = readable_unit(first.name, first.unit)
    low, high = factor * first.low, factor * first.high
    digits = digits_of(high - low if high > low else factor * first.value)
    interval = with_unit(f"{low:.{digits}f} to {high:.{digits}f}", unit)
    return f" ({first.name.replace('_', ' ')}: 95 % interval {interval})"


def _sizes(numbers: tuple[Number, ...]) -> list[Number]:
    """Those that are neither moments nor parts of another one; all where nothing else is told."""
    names = {one.name for one in numbers}
    parts = {f"{name}_{axis}" for name in names for axis in "xyz"}
    return [one for one in numbers if one.name not in _MOMENTS | parts] or list(numbers)
