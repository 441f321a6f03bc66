"""From the faults' probabilities to what is said: one name, a group of names, or not so."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from string import ascii_uppercase
from typing import Any

import numpy as np

from bsip_cli.diagnosis.fault_model import Fitted, Hypothesis
from bsip_cli.diagnosis.fault_search import Found, Verdict
from bsip_cli.diagnosis.held_out import HeldOut
from bsip_cli.effects.effect import Judged, Number, Reported, Words

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
    for one, probability in found.rejected:
        numbers = tuple(Number(*x) for x in one.reported())
        findings.append(_finding(one, numbers, one.words(), probability, verdict="rejected"))
    return tuple(findings)


def _members(
    found: Found, held: HeldOut, verdict: Verdict, class_id: str, rng: np.random.Generator
) -> Iterator[Finding]:
    """One of a name of its own, or all of a group."""
    mine = found.fit.faults[verdict.number]
    for tried, probability in verdict.members:
        more: dict[str, Any] = {}
        fit, number, one = tried.fit, len(tried.fit.faults) - 1, tried.fault
        if (one.effect, one.target, one.trials) == (mine.effect, mine.target, mine.trials):
            fit, number = found.fit, verdict.number
            one = replace(mine, is_even=one.is_even)
            more["gain"] = held.gain(number).interval()
        numbers = _numbers(fit, number, found.scores.inflation_in(one.trials), rng)
        more["closing"] = interval_words(numbers)
        if class_id:
            alike = f"; other causes look alike here: to distinguish them, {mine.effect.remedy}"
            more["closing"] += alike
            more |= {"verdict": "ambiguous", "class_id": class_id}
        else:
            probability = verdict.probability
        yield _finding(one, numbers, one.alike()[0].words(), probability, **more)


def _finding(
    one: Hypothesis, numbers: tuple[Number, ...], words: Words, probability: float, **more: Any
) -> Finding:
    """With the change of the component that changes most, in its trial of the largest change."""
    changes = [one.filtered_change(trial) for trial in one.in_trials]
    rms = np.array([np.sqrt((x**2).mean(axis=0)) for x in changes])
    most = float(rms.flat[int(np.argmax(rms / np.repeat([1.0, _ARM_M], 3)))])
    said = one.name, one.target, tuple(x.name for x in one.in_trials), numbers, words
    more |= {"scope": one.effect.scope if one.is_even else "trial", "rms_change": most}
    return Finding(*said, 1 - probability, probability, **more)


def _numbers(
    fit: Fitted, number: int, inflation: float, rng: np.random.Generator
) -> tuple[Number, ...]:
    """What is reported of a fault, with the intervals of draws from the posterior.

    Its variance counts as many times as the trials' candidates explain more than chance; what no
    recording betters comes on top.
    """
    one, covariance = fit.faults[number], fit.covariance_of(number) * inflation
    known_to = np.array([p.known_to for p in one.parameters])
    spread = np.hypot(known_to, SCALE_ERROR * one.values * one.is_free)
    none = np.zeros(len(one.values))
    steps = rng.multivariate_normal(none, covariance, DRAWS, check_valid="ignore")
    noise = spread * rng.standard_normal(steps.shape)
    drawn = [one.with_values(x).alike() for x in one.values + steps * one.typical + noise]
    alike = [each[rng.integers(len(each))].reported() for each in drawn]
    return numbers_of(one.alike()[0].reported(), alike)


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
