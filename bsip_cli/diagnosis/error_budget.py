"""The error budget: what each term of the error does to forces, moments and centre of pressure.

A term's share of a component is its contribution projected on the residual, over the residual's
square; with noise and unknown, which share what no term explains, the shares add up to the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.error_model import ErrorModel, Part, TrialErrors
from bsip_cli.diagnosis.findings import Finding, interval_words
from bsip_cli.effects.effect import Number, Words
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.plates import OF_THE_LAB
from bsip_cli.statistics.choice import ErrorGain, block_errors, error_gain, pooled
from bsip_cli.statistics.samples import Z95, effective_samples

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")
UNKNOWN, NOISE, TOTAL = "unknown", "noise", "total"
_SURER = 0.5  # of the smaller spread, that the sum of two terms has which stand in for each other


@dataclass(frozen=True, eq=False)
class Ground:
    """From a trial's filtered wrench to its components: (n, 8, 6), NaN where there is no centre of
    pressure; the measured ones (n, 8); and the block (n,) of time that each sample is in."""

    components: np.ndarray
    measured: np.ndarray
    blocks: np.ndarray

    def seen(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 8) of a change (n, 6) of the wrench [N, N m, m]."""
        return np.einsum("nij,nj->ni", self.components, wrench)


def ground_of(
    measured: np.ndarray,
    residual: np.ndarray,
    anterior: np.ndarray,
    least_N: float,
    blocks: np.ndarray,
) -> Ground:
    """What a change of the simulated wrench does to all components.

    With moment m and vertical force f, m / f - m' / f' = (dm - m' / f' df) / f for any change d of
    the wrench, so that terms add up in the centre of pressure too.

    measured, residual : (n, 6) about a point of the plates' surface, the latter less what is
    simulated. anterior : (2,) where the person faces. least_N : vertical force of a contact.
    """
    simulated = measured - residual
    loaded = (measured[:, 2] > least_N) & (simulated[:, 2] > least_N)
    force, its = (np.where(loaded, x[:, 2], np.nan) for x in (measured, simulated))
    lab = np.zeros((len(force), 2, 6))
    lab[:, 0, 4], lab[:, 1, 3] = -1 / force, 1 / force
    lab[:, 0, 2], lab[:, 1, 2] = simulated[:, 4] / its / force, -simulated[:, 3] / its / force
    person = np.stack([anterior, [anterior[1], -anterior[0]]])
    six = np.broadcast_to(np.eye(6), (len(force), 6, 6))
    place = np.stack([-measured[:, 4] / force, measured[:, 3] / force], axis=1) @ person.T
    components = np.concatenate([six, person @ lab], axis=1)
    return Ground(components, np.concatenate([measured, place], axis=1), blocks)


@dataclass(frozen=True)
class Line:
    """What a term does to a component: root mean square [N, N m, m], share with its 95 % interval,
    and by how much the error is smaller on data held out; as parts of one.

    scale : how many times as large as usual; NaN where nothing is usual. alike : other terms from
    which these recordings hardly decide it.
    """

    term: str
    target: str
    component: str
    rms: float
    share: float
    share_low: float
    share_high: float
    gain: ErrorGain
    scale: float
    alike: tuple[str, ...] = ()


_NO_GAIN = ErrorGain(*[np.nan] * 5)


def budget_of(
    model: ErrorModel, grounds: Sequence[Ground], trials: Sequence[int], rng: np.random.Generator
) -> tuple[Line, ...]:
    """Lines of some trials together: every term, and its targets; unknown, noise and the total."""
    return tuple(_Budget(model, tuple(grounds), tuple(trials), rng).lines())


@dataclass(frozen=True, eq=False)
class _Budget:
    model: ErrorModel
    grounds: tuple[Ground, ...]
    trials: tuple[int, ...]
    rng: np.random.Generator

    @cached_property
    def errors(self) -> dict[int, TrialErrors]:
        """By trial, of those that are asked."""
        return {t: self.model.session.trials[t] for t in self.trials}

    @cached_property
    def residual(self) -> dict[int, np.ndarray]:
        """By trial (n, 8)."""
        return {t: self.grounds[t].seen(one.residual) for t, one in self.errors.items()}

    @cached_property
    def squares(self) -> np.ndarray:
        """(8,) of the residual."""
        return _sum(x**2 for x in self.residual.values())

    @cached_property
    def count(self) -> np.ndarray:
        """(8,) samples."""
        return sum(np.isfinite(x).sum(axis=0) for x in self.residual.values())

    @cached_property
    def weights(self) -> np.ndarray:
        """(8, K) what each coefficient adds to the shares."""
        weights = np.zeros((len(COMPONENTS), len(self.model.mean)))
        for t in self.trials:
            weights[:, self.model.session.used[t]] += self._shares(t, self.model.session.columns[t])
        return weights

    def _shares(self, trial: int, columns: np.ndarray) -> np.ndarray:
        """(8, k) of a trial's columns (n, 6, k)."""
        seen = np.nan_to_num(self.grounds[trial].components * self.residual[trial][:, :, None])
        return np.tensordot(seen, columns, axes=([0, 2], [0, 1])) / self.squares[:, None]

    def lines(self) -> Iterator[Line]:
        here = tuple(p for p in self.model.session.parts if p.trial in (-1, *self.trials))
        terms = list(dict.fromkeys(p.term for p in here))
        alike = self._alike(here, terms)
        for term in terms:
            whole = tuple(p for p in here if p.term == term)
            targets = dict.fromkeys(p.target for p in whole)
            yield from self._inside(term, tuple(p for p in whole if p in self.model.session.mixed))
            for target in ("", *(t for t in targets if t and len(targets) > 1)):
                parts = tuple(p for p in whole if not target or p.target == target)
                changes = {t: self.grounds[t].seen(self._change(parts, t)) for t in self.trials}
                known = self._spread(parts), self._scale(parts), self._gains(parts)
                for one in self._lines(term, target, changes, *known):
                    yield replace(one, alike=alike.get((term, one.component), ()))
        yield from self._rest()
        gains, rms = self._gains(here), np.sqrt(self.squares / self.count)
        for k, name in enumerate(COMPONENTS):
            yield Line(TOTAL, "", name, float(rms[k]), 1.0, 1.0, 1.0, gains[k], np.nan)

    def _lines(
        self,
        term: str,
        target: str,
        changes: Mapping[int, np.ndarray],
        spread: np.ndarray,
        scale: float,
        gains: Sequence[ErrorGain] = (_NO_GAIN,) * len(COMPONENTS),
    ) -> Iterator[Line]:
        """Of all components, of what it changes (n, 8) in the trials; spread (8,) : standard
        deviations of the shares."""
        rms = np.sqrt(_sum(x**2 for x in changes.values()) / self.count)
        share = _sum(x * self.residual[t] for t, x in changes.items()) / self.squares
        half = Z95 * spread
        for k, name in enumerate(COMPONENTS):
            interval = share[k] - half[k], share[k] + half[k]
            yield Line(term, target, name, rms[k], share[k], *interval, gains[k], scale)

    def _scale(self, parts: tuple[Part, ...]) -> float:
        return float(np.mean([self.model.scales[p.scale] for p in parts]))

    def _inside(self, term: str, parts: tuple[Part, ...]) -> Iterator[Line]:
        """The targets of terms whose coefficients are several targets' at once."""
        if not parts:
            return
        model, mine = self.model, _coefficients(parts)
        mixed = np.concatenate([model.session.mixed[p] for p in parts], axis=1)
        inside = model.solution.covariance[np.ix_(mine, mine)]
        bare = {
            t: next(x for x in one.terms if x.scale == parts[0].scale)
            for t, one in self.errors.items()
        }
        targets = next(iter(bare.values())).targets
        wide = len(mixed) // len(targets)
        for k, target in enumerate(targets):
            rows = slice(wide * k, wide * (k + 1))
            columns = {t: one.columns[..., rows] for t, one in bare.items()}
            sizes = mixed[rows] @ model.mean[mine]
            changes = {t: self.grounds[t].seen(x @ sizes) for t, x in columns.items()}
            weights = sum(self._shares(t, x) for t, x in columns.items()) @ mixed[rows]
            spread = np.sqrt(np.einsum("ik,kl,il->i", weights, inside, weights))
            yield from self._lines(term, target, changes, spread, self._scale(parts))

    def _rest(self) -> Iterator[Line]:
        """What no term explains: as much of it as the instruments' noise makes, and the unknown."""
        left = {t: self.grounds[t].seen(self.model.left[t]) for t in self.trials}
        noisy = _sum(self.grounds[t].components ** 2 @ x.noise**2 for t, x in self.errors.items())
        found = self._lines(UNKNOWN, "", left, self._spread(self.model.session.parts), np.nan)
        unknown = np.sqrt(np.maximum(_sum(x**2 for x in left.values()) - noisy, 0.0) / self.count)
        noise = np.sqrt(noisy / self.count)
        for k, one in enumerate(found):
            share = np.clip(noisy[k] / self.squares[k], 0.0, max(one.share, 0.0))
            low, high = one.share_low - share, one.share_high - share
            known = {"rms": unknown[k], "share_low": low, "share_high": high}
            yield replace(one, share=one.share - share, **known)
            yield Line(NOISE, "", one.component, noise[k], share, share, share, _NO_GAIN, np.nan)

    def _change(
        self, parts: Sequence[Part], trial: int, mean: np.ndarray | None = None
    ) -> np.ndarray:
        none = np.zeros_like(self.errors[trial].residual)
        return sum((self.model.of(part, trial, mean) for part in parts), none)

    def _spread(self, parts: Sequence[Part]) -> np.ndarray:
        """(8,) standard deviation of a share: it is linear in the coefficients."""
        mine = _coefficients(parts)
        weights, inside = self.weights[:, mine], self.model.solution.covariance[np.ix_(mine, mine)]
        return np.sqrt(np.einsum("ik,kl,il->i", weights, inside, weights))

    def _gains(self, parts: Sequence[Part]) -> list[ErrorGain]:
        """Per component, from coefficients that rest on the other folds; none of what is a trial's
        own where the trial is held out as a whole."""
        folds = [(f, x) for f, x in zip(self.model.folds, self.model.without, strict=True)]
        folds = [(f, x) for f, x in folds if f.trial in self.trials]
        if len(self.model.folds) < 2 or not any(
            p.trial == -1 or sum(f.trial == p.trial for f, _ in folds) > 1 for p in parts
        ):
            return [_NO_GAIN] * len(COMPONENTS)
        errors = []
        for fold, mean in folds:
            ground, before = self.grounds[fold.trial], self.residual[fold.trial][fold.rows]
            change = ground.seen(self._change(parts, fold.trial, mean))[fold.rows]
            blocks = ground.blocks[fold.rows]
            pairs = zip(before.T, change.T, strict=True)
            errors.append([block_errors(0 * x, x, x - c, blocks) for x, c in pairs])
        return [error_gain(pooled([*one]), self.rng) for one in zip(*errors, strict=True)]

    def _alike(
        self, here: Sequence[Part], terms: Sequence[str]
    ) -> dict[tuple[str, str], tuple[str, ...]]:
        """By term and component, the terms with which its sum is surer than either alone: they
        stand in for each other."""
        of = {term: [p for p in here if p.term == term] for term in terms}
        spread = {term: self._spread(parts) for term, parts in of.items()}
        found: dict[tuple[str, str], tuple[str, ...]] = {}
        for a, b in permutations(terms, 2):
            both = self._spread([*of[a], *of[b]])
            surer = both < _SURER * np.minimum(spread[a], spread[b])
            for component in np.array(COMPONENTS)[surer].tolist():
                found[a, component] = (*found.get((a, component), ()), b)
        return found


def _coefficients(parts: Sequence[Part]) -> np.ndarray:
    return np.concatenate([p.coefficients for p in parts])


def _sum(parts: Iterable[np.ndarray]) -> np.ndarray:
    """Over samples and trials, where they are known."""
    return np.sum([np.nansum(one, axis=0) for one in parts], axis=0)


# --- errors that are too large to be passed over --------------------------------------------------
# Asked is what named faults and ordinary errors of ordinary size leave: were their size free, soft
# tissue or a body could swallow a plate that is turned round.

_LOUD = 0.5  # of the yardstick, by which a component varies at least for its correlation to count
_WORDS = {
    **{name: words.replace("horizontal force", "force") for name, words in OF_THE_LAB.items()},
    "cop_ap": "the centre of pressure forwards",
    "cop_ml": "the centre of pressure sideways",
}


@dataclass(frozen=True)
class Yardsticks:
    """What no good laboratory has: error of the centre of pressure [m]; of a force, part of body
    weight [N]; and the correlation below which a signal does not follow the measured one."""

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
    the yardstick; correlation of what is simulated with what is measured; p-value of noise."""

    trial: str
    component: str
    error: float
    standard_error: float
    part: float
    correlation: float
    p_value: float


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
    one = usual.session.trials[trial]
    left, measured = ground.seen(usual.left[trial]), ground.measured
    noise = np.sqrt(np.nanmean(ground.components**2 @ one.noise**2, axis=0))
    for k, name in enumerate(COMPONENTS):
        known = np.isfinite(left[:, k])
        if not known.any():
            continue
        error, seen, yardstick = left[known, k], measured[known, k], yardsticks.of(name)
        size = float(np.sqrt((error**2).mean()))
        correlation = np.nan
        if seen.std() > _LOUD * yardstick and (seen - error).std() > 0:
            correlation = float(np.corrcoef(seen, seen - error)[0, 1])
        if size > yardstick or correlation < yardsticks.correlation:
            samples = max(effective_samples(error), 1.0)
            p_value = float(chi2.sf(samples * (size / noise[k]) ** 2, samples))
            spread = size / np.sqrt(2 * samples)
            yield _Large(one.name, name, size, spread, size / yardstick, correlation, p_value)


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
        f", and simulated and measured hardly go together (correlation {worst.correlation:.2f})"
        if worst.correlation < yardsticks.correlation
        else ""
    )
    size = (
        f"{factor * worst.error:.3g} {read} of {_WORDS[worst.component]} (RMS) remain "
        f"unexplained{follows}"
    )
    large = f"large is {factor * yardsticks.of(worst.component):.3g} {read} and more"
    what = f"large error, cause unknown: {size}; {large}; {along(trials, worst.component)}"
    said = UNEXPLAINED, "", trials, (number,), Words(what, size, large)
    closing = interval_words((number,))
    return Finding(*said, worst.p_value, 1 - worst.p_value, closing=closing)
