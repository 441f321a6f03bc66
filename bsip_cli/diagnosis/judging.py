"""Whether a candidate that was refitted in full is a cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.chance import Chance
from bsip_cli.diagnosis.explanation import Explanation, Fit
from bsip_cli.diagnosis.held_out import Gain, gain_of
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.together import Evidence

ALPHA = 0.01  # in every round; with the chance's own errors one null in twenty has an alarm
ALPHA_BESIDE = 1e-5  # beside another cause in the same trial, since no model of a cause is exact
BEYOND_DOUBT = 1e-20  # so rare by chance that a gain above its standard error is enough
# Of the squared residual of its trials: skin, and a body unlike the table's, go along with the
# movement and bring some percent.
WORTH = 0.03
NAMELESS_WORTH = 0.1  # of what has no name
# Of body weight, moments at an arm of ARM_M: what has no name is larger, root mean square.
NAMELESS_LEAST, ARM_M = 0.003, 0.3
# Of the squared residual, from which on it may be smaller: 7 % at most where nothing was wrong.
TINY_WORTH = 0.2
# What a large cause leaves behind, since no model of it is exact, is no other cause.
LEFTOVER = 0.005  # of the squared residual that earlier causes took from the same trials
BESIDE = 0.75  # of what a cause explains, that another one does not


@dataclass(frozen=True)
class GivenUp:
    """Why a cause that was kept is none in the end. why : of itself. nearest : where nothing else
    is told of its trials; empty if that is no reason to say that something is wrong there."""

    why: str
    nearest: str


DROWNED = GivenUp(
    "more than it explains remains without a cause", "explains less than it leaves over"
)
IMPOSSIBLE = GivenUp(
    "beside the other causes its size cannot be", "would have a size that cannot be"
)
SIZELESS = GivenUp("its size may as well be none", "may as well have no size")
NEGLIGIBLE = GivenUp("beside the other causes it is too small to matter", "")


@dataclass(frozen=True)
class Tried:
    """A candidate that was refitted in full, beside the causes found before it.

    is_first : none of its trials holds one of them. is_tiny : it hardly changes the forces.
    given_up : why it is none in the end. rivals : of a cause that is kept, what cannot be told from
    it.
    """

    explanation: Explanation
    score: float
    p_value: float
    gain: Gain
    fit: Fit
    is_leftover: bool
    is_first: bool
    is_tiny: bool
    given_up: GivenUp | None = None
    rivals: tuple[Tried, ...] = ()

    @property
    def trials(self) -> tuple[int, ...]:
        """Where it is."""
        return self.explanation.place.trials

    @property
    def is_without_name(self) -> bool:
        """Whether it has no name, and nothing that has one is like it."""
        return self.explanation.effect.name == UNEXPLAINED and not self.rivals

    @property
    def is_rare(self) -> bool:
        """Whether chance hardly ever brings as much."""
        return self.p_value <= (ALPHA if self.is_first else ALPHA_BESIDE)

    @property
    def is_too_little_unnamed(self) -> bool:
        """Whether it explains or changes too little to be told without a name. What hardly changes
        the forces must explain the more, and never stands beside a cause."""
        if self.is_tiny and not self.is_first:
            return True
        worth = TINY_WORTH if self.is_tiny else NAMELESS_WORTH
        return self.gain.percent < 100 * worth

    @property
    def is_slight(self) -> bool:
        """Whether it has no name and explains too little to be told."""
        return self.explanation.effect.name == UNEXPLAINED and self.is_too_little_unnamed

    @property
    def is_good(self) -> bool:
        """Rare by chance, better on what it has not seen, worth a name, not what is left over of a
        larger cause, and more than what remains. What has no name, comes after another cause, or is
        not far beyond chance, must be better for sure."""
        if not self.is_rare or self.is_leftover or self.given_up is not None:
            return False
        if self.gain.percent < 100 * WORTH:
            return False
        unnamed = self.explanation.effect.name == UNEXPLAINED
        doubtful = unnamed or not self.is_first or self.p_value > BEYOND_DOUBT
        return self.gain.is_sure() if doubtful else self.gain.is_real()


def judged_by(
    evidence: Evidence,
    before: Fit,
    found: Explanation,
    fit: Fit,
    score: float,
    chance: Chance,
) -> Tried:
    """A candidate that was refitted, against chance and on what it has not seen.

    before, fit : without it and with it. score : of what the residual loses by it.
    """
    trials = found.place.trials
    gain = gain_of(evidence, trials, before.residual, fit.residual, fit.tangent)
    touched = {t for e in before.explanations for t in e.place.trials}
    first = touched.isdisjoint(trials)
    leftover = not first and _is_leftover(evidence, trials, before.residual, fit.residual)
    tiny = _largest_change(evidence, found) < NAMELESS_LEAST
    return Tried(found, score, chance.p_value(score, trials), gain, fit, leftover, first, tiny)


def _largest_change(evidence: Evidence, found: Explanation) -> float:
    """Root mean square of the change in the component and trial where it is largest, over body
    weight."""
    arms = np.repeat([1.0, ARM_M], 3)
    return max(
        float((_rms(one.filtered.filter.one(found.wrench(one.scene))) / arms).max())
        / (one.scene.mass_kg * GRAVITY_M_S2)
        for one in (evidence.trials[t] for t in found.place.trials)
    )


def _rms(course: np.ndarray) -> np.ndarray:
    return np.sqrt((course**2).mean(axis=0))


def stands_beside(one: Tried, other: Tried, before: Fit) -> bool:
    """Whether hardly any of what a cause explains is explained by another one as well. Trials share
    a body: what is too heavy in one of them passes for too light in the others.

    before : fit without either.
    """
    left = other.fit.residual
    both = np.column_stack([other.fit.tangent, one.fit.tangent])
    step = np.linalg.lstsq(both, left, rcond=None)[0]
    beside = _squares(left) - _squares(left - both @ step)
    return beside > BESIDE * (before.squares - one.fit.squares)


def _squares(residual: np.ndarray) -> float:
    return float((residual**2).sum())


def _is_leftover(
    evidence: Evidence, trials: tuple[int, ...], before: np.ndarray, after: np.ndarray
) -> bool:
    rows = np.concatenate([np.arange(len(before))[evidence.rows(t)] for t in trials])
    nothing, without, beside = (
        _squares(residual[rows]) for residual in (evidence.residual, before, after)
    )
    return without - beside < LEFTOVER * (nothing - without)
