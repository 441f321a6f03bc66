"""From the faults' probabilities to what is said: one name, a group of names, or not so."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from string import ascii_uppercase
from typing import Any

import numpy as np

from bsip_cli.diagnosis.fault_model import Fitted
from bsip_cli.diagnosis.fault_search import Found, Verdict
from bsip_cli.diagnosis.held_out import HeldOut, plain
from bsip_cli.diagnosis.hypothesis import Hypothesis
from bsip_cli.effects.effect import Effect, Judged, Number, Reported, Words

DRAWS = 200
SCALE_ERROR = 0.03  # of every size: the simulated motion is neither free of noise nor unsmoothed
_MOMENTS = {"start", "end", "from_time", "release_time"}
_LETTERS = ascii_uppercase.replace("W", "")  # W is the group of the stated mass
_ARM_M = 0.3  # at which a moment counts as much as a force, to find the component that changes most


@dataclass(frozen=True)
class Finding(Judged):
    """What the diagnosis writes; ``closing`` ends its sentence."""

    closing: str = ""

    @property
    def sentence(self) -> str:
        """All of it, for people."""
        if self.verdict != "rejected":
            return f"{self.words.what}{self.closing}"
        return (
            f"{'not so' if self.probability < 0.5 else 'not sure'}: {self.words.what} "
            f"(probability {self.probability:.2g} given what is found)"
        )


def scope_of(effect: Effect) -> str:
    """How far a fault reaches, if it is there."""
    if effect.is_of_laboratory:
        return "laboratory"
    return "person" if effect.is_of_person else "trial"


def findings_of(
    found: Found, held: HeldOut, named_from: float, rng: np.random.Generator
) -> tuple[Finding, ...]:
    """What is there first, with the members of each group; then what is not so."""
    names = (a + b for a, b in product(("", *_LETTERS), _LETTERS))  # A, B, ... Z, AA, AB ...
    findings: list[Finding] = []
    for verdict in found.verdicts:
        if verdict.probability >= named_from:  # else it stands with those that are not said
            class_id = "" if len(verdict.members) == 1 else next(names)
            findings += _members(found, held, verdict, class_id, rng)
    return (*findings, *(_rejected(found.fit, *one) for one in found.rejected))


def _members(
    found: Found, held: HeldOut, verdict: Verdict, class_id: str, rng: np.random.Generator
) -> Iterator[Finding]:
    """One of a name of its own, or all of a group."""
    mine = found.fit.faults[verdict.number]
    mine = replace(mine, effect=plain(mine.effect))
    for tried, probability in verdict.members:
        plainly = replace(tried.fault, effect=plain(tried.fault.effect))
        more: dict[str, Any] = {}
        fit, number = tried.fit, len(tried.fit.faults) - 1
        if (*plainly.key, plainly.trials) == (*mine.key, mine.trials):
            fit, number = found.fit, verdict.number
            more["gain"] = held.gain(number).interval()
        numbers = _numbers(fit, number, found.scores.inflation, rng)
        one = replace(fit.faults[number], effect=tried.fault.effect)
        closing = interval_words(numbers)
        if class_id:
            closing += f"; other causes look alike here: to distinguish them, {mine.effect.remedy}"
            more |= {"verdict": "ambiguous", "class_id": class_id}
        else:
            probability = verdict.probability
        words = one.alike(fit.session)[0].words(fit.session)
        yield _finding(fit, one, numbers, words, probability, closing=closing, **more)


def _rejected(fit: Fitted, one: Hypothesis, probability: float) -> Finding:
    numbers = tuple(Number(*x) for x in one.reported(fit.session))
    return _finding(fit, one, numbers, one.words(fit.session), probability, verdict="rejected")


def _finding(
    fit: Fitted,
    one: Hypothesis,
    numbers: tuple[Number, ...],
    words: Words,
    probability: float,
    **more: Any,
) -> Finding:
    """With the change of the component that changes most, in its trial of the largest change."""
    trials = [fit.session.trials[t] for t in one.trials]
    changes = [
        x.errors.filter.one(one.effect.change(x.simulated, one.target, one.values)) for x in trials
    ]
    rms = np.array([np.sqrt((x**2).mean(axis=0)) for x in changes])
    most = float(rms.flat[int(np.argmax(rms / np.repeat([1.0, _ARM_M], 3)))])
    said = one.effect.name, one.target, tuple(x.name for x in trials), numbers, words
    more |= {"scope": scope_of(one.effect), "rms_change": most}
    return Finding(*said, 1 - probability, probability, **more)


def _numbers(
    fit: Fitted, number: int, inflation: np.ndarray, rng: np.random.Generator
) -> tuple[Number, ...]:
    """What is reported of a fault, with the intervals of draws from the posterior.

    Its variance counts as many times as the trials' candidates explain more than chance; what no
    recording betters comes on top.
    """
    session, one = fit.session, fit.faults[number]
    mine = fit.coefficients(number)
    covariance = fit.covariance[mine, mine] * inflation[list(one.trials)].mean()
    free, typical = one.is_free(session), one.typical(session)
    known_to = np.array([p.known_to for p in one.parameters(session)])
    spread = np.hypot(known_to, SCALE_ERROR * one.values * free)
    steps = rng.multivariate_normal(np.zeros(len(typical)), covariance, DRAWS, check_valid="ignore")
    noise = spread * rng.standard_normal(steps.shape)
    drawn = [
        one.with_values(session, one.values + step * typical + more).alike(session)
        for step, more in zip(steps, noise, strict=True)
    ]
    alike = [each[rng.integers(len(each))].reported(session) for each in drawn]
    return numbers_of(one.alike(session)[0].reported(session), alike)


def numbers_of(reported: Reported, drawn: Sequence[Reported]) -> tuple[Number, ...]:
    """What is reported, with the 95 % intervals of draws."""
    values = np.array([[x for *_, x in one] for one in drawn])
    low, high = np.percentile(values, [2.5, 97.5], axis=0)
    return tuple(
        Number(n, u, x, min(float(a), x), max(float(b), x))
        for (n, u, x), a, b in zip(reported, low, high, strict=True)
    )


def interval_words(numbers: tuple[Number, ...]) -> str:
    """Of the surest size, with the digits that its interval deserves; a size is neither a moment
    nor a part of another one, if anything else is reported."""
    names = {one.name for one in numbers}
    parts = {f"{name}_{axis}" for name in names for axis in "xyz"}
    sizes = [one for one in numbers if one.name not in _MOMENTS | parts] or numbers
    first = max(sizes, key=Number.certainty)
    return f" ({first.name.replace('_', ' ')}: 95 % interval {first.interval()})"
