"""Errors that are too large to be passed over, whatever else is said.

Asked is what named faults and ordinary errors of ordinary size leave: were their size free, soft
tissue or a body could swallow a plate that is turned round.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.error_budget import COMPONENTS, Ground
from bsip_cli.diagnosis.error_model import ErrorModel
from bsip_cli.diagnosis.findings import Finding, Number, interval_words
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.statistics.effective_samples import effective_samples
from bsip_cli.statistics.samples import Z95

_LOUD = 0.5  # of the yardstick, by which a component varies at least for its course to count
_WORDS = {
    "fx": "the force along the lab's X axis",
    "fy": "the force along the lab's Y axis",
    "fz": "the vertical force",
    "mx": "the moment about the lab's X axis",
    "my": "the moment about the lab's Y axis",
    "mz": "the moment about the vertical",
    "cop_ap": "the centre of pressure, forwards,",
    "cop_ml": "the centre of pressure, sideways,",
}


@dataclass(frozen=True)
class Yardsticks:
    """What no good laboratory has: error of the centre of pressure [m]; of a force, part of body
    weight [N]; and the correlation below which a course does not follow the measured one."""

    cop_m: float
    force: float
    correlation: float
    weight_N: float

    def of(self, component: str) -> float:
        """Of a component [N, N m, m]: moments are body weight at the centre of pressure's arm."""
        if component.startswith("cop"):
            return self.cop_m
        return self.weight_N * (self.cop_m if component.startswith("m") else self.force)


@dataclass(frozen=True)
class _Large:
    """An error of a component in a trial: its size [N, N m, m] with standard error, as a part of
    the yardstick; correlation of what is simulated with what is measured; chance of noise."""

    trial: str
    component: str
    error: float
    standard_error: float
    part: float
    correlation: float
    chance: float


def large_errors(
    usual: ErrorModel,
    grounds: Sequence[Ground],
    trials: Sequence[int],
    yardsticks: Yardsticks,
    along: Callable[[Sequence[str], str], str],
) -> tuple[Finding, ...]:
    """One finding for all trials with such errors, by the largest of them.

    usual : the model with everything as large as usual. along : what an error of some trials and a
    component goes along with, in words.
    """
    found = [one for t in trials for one in _of_trial(usual, grounds[t], t, yardsticks)]
    return (_finding(found, yardsticks, along),) if found else ()


def _of_trial(
    usual: ErrorModel, ground: Ground, trial: int, yardsticks: Yardsticks
) -> Iterator[_Large]:
    one = usual.trials[trial]
    left, course = ground.seen(usual.left[trial]), ground.measured
    noise = np.sqrt(np.nanmean(ground.components**2 @ one.noise**2, axis=0))
    for k, name in enumerate(COMPONENTS):
        known = np.isfinite(left[:, k])
        if not known.any():
            continue
        error, seen, yardstick = left[known, k], course[known, k], yardsticks.of(name)
        size = float(np.sqrt((error**2).mean()))
        correlation = np.nan
        if seen.std() > _LOUD * yardstick and (seen - error).std() > 0:
            correlation = float(np.corrcoef(seen, seen - error)[0, 1])
        if size > yardstick or correlation < yardsticks.correlation:
            samples = max(effective_samples(error), 1.0)
            chance = float(chi2.sf(samples * (size / noise[k]) ** 2, samples))
            spread = size / np.sqrt(2 * samples)
            yield _Large(one.name, name, size, spread, size / yardstick, correlation, chance)


def _finding(
    found: Sequence[_Large], yardsticks: Yardsticks, along: Callable[[Sequence[str], str], str]
) -> Finding:
    worst = max(found, key=lambda one: one.part)
    unit = "m" if worst.component.startswith("cop") else "N m" if worst.component[0] == "m" else "N"
    half = Z95 * worst.standard_error
    number = Number("error", unit, worst.error, max(worst.error - half, 0.0), worst.error + half)
    factor, read = (1000.0, "mm") if unit == "m" else (1.0, unit)
    trials = tuple(dict.fromkeys(one.trial for one in found))
    follows = (
        f", and what is simulated follows it with a correlation of {worst.correlation:.2f}"
        if worst.correlation < yardsticks.correlation
        else ""
    )
    sentence = (
        f"large error, cause unknown: beside all that is named, and ordinary errors of ordinary "
        f"size, {_WORDS[worst.component]} errs by {factor * worst.error:.3g} {read}{follows}; "
        f"no good recording has more than {factor * yardsticks.of(worst.component):.3g} {read}; "
        f"{along(trials, worst.component)}{interval_words((number,))}"
    )
    none = (np.nan, np.nan, np.nan)
    return Finding(
        UNEXPLAINED,
        "",
        trials,
        "named",
        "",
        worst.chance,
        none,
        (number,),
        sentence,
        1 - worst.chance,
        "trial",
    )
