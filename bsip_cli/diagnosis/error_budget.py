"""The error budget: what each term of the error does to forces, moments and centre of pressure.

A term's share of a component is its contribution projected on the residual, over the residual's
square; with noise and unknown, which share what no term explains, the shares add up to the whole.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.error_model import ErrorModel, Part
from bsip_cli.diagnosis.findings import Finding, interval_words
from bsip_cli.effects.effect import Number, Words
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.plates import OF_THE_LAB, unit_of
from bsip_cli.statistics.choice import ErrorGain, block_errors, error_gain, pooled
from bsip_cli.statistics.samples import Z95, effective_samples

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")
UNKNOWN, NOISE, TOTAL = "unknown", "noise", "total"
_NO_GAIN = ErrorGain(*[np.nan] * 5)
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
    gain: ErrorGain = _NO_GAIN
    scale: float = np.nan
    alike: tuple[str, ...] = ()


def budget_of(
    model: ErrorModel, grounds: Sequence[Ground], trials: Sequence[int], rng: np.random.Generator
) -> tuple[Line, ...]:
    """Lines of some trials together: every term, and its targets; unknown, noise and the total."""
    return tuple(_Budget(model, tuple(grounds), tuple(trials), rng).lines())


@dataclass(frozen=True, eq=False)
class _Budget:
    """Arrays (n, 8) of a trial's components are by trial, of those that are asked."""

    model: ErrorModel
    grounds: tuple[Ground, ...]
    trials: tuple[int, ...]
    rng: np.random.Generator

    @cached_property
    def residual(self) -> dict[int, np.ndarray]:
        return {t: self.grounds[t].seen(self.model.session.trials[t].residual) for t in self.trials}

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

    def _spread(self, coefficients: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        """(8,) standard deviation of a share: it is linear in the coefficients."""
        inside = self.model.solution.covariance[np.ix_(coefficients, coefficients)]
        weights = self.weights[:, coefficients] if weights is None else weights
        return np.sqrt(np.einsum("ik,kl,il->i", weights, inside, weights))

    def lines(self) -> Iterator[Line]:
        here = [p for p in self.model.session.parts if p.trial in (-1, *self.trials)]
        terms: dict[str, list[Part]] = {}
        for part in here:
            terms.setdefault(part.term, []).append(part)
        alike = self._alike(terms)
        for term, whole in terms.items():
            yield from self._inside(term, [p for p in whole if p.mixing is not None])
            targets = dict.fromkeys(p.target for p in whole)
            for target in ("", *(t for t in targets if t and len(targets) > 1)):
                parts = [p for p in whole if not target or p.target == target]
                changes = {t: self._change(parts, t) for t in self.trials}
                lines = self._lines(term, target, changes, self._spread(_coefficients(parts)))
                for one, gain in zip(lines, self._gains(parts), strict=True):
                    others, scale = alike.get((term, one.component), ()), self._scale(parts)
                    yield replace(one, gain=gain, scale=scale, alike=others)
        yield from self._rest()
        rms = np.sqrt(self.squares / self.count)
        for name, size, gain in zip(COMPONENTS, rms, self._gains(here), strict=True):
            yield Line(TOTAL, "", name, float(size), 1.0, 1.0, 1.0, gain)

    def _lines(
        self, term: str, target: str, changes: Mapping[int, np.ndarray], spread: np.ndarray
    ) -> Iterator[Line]:
        """Of all components, of what it changes (n, 8) in the trials; spread (8,) : standard
        deviations of the shares."""
        rms = np.sqrt(_sum(x**2 for x in changes.values()) / self.count)
        share = _sum(x * self.residual[t] for t, x in changes.items()) / self.squares
        numbers = zip(rms, share, share - Z95 * spread, share + Z95 * spread, strict=True)
        for name, of_component in zip(COMPONENTS, numbers, strict=True):
            yield Line(term, target, name, *of_component)

    def _inside(self, term: str, parts: Sequence[Part]) -> Iterator[Line]:
        """The targets of terms whose coefficients are several targets' at once."""
        if not parts:
            return
        mine, scale, trials = _coefficients(parts), parts[0].scale, self.model.session.trials
        mixing = np.concatenate([p.mixing for p in parts], axis=1)
        own = {t: next(x for x in trials[t].terms if x.scale == scale) for t in self.trials}
        targets = next(iter(own.values())).targets
        for k, rows in enumerate(np.split(np.arange(len(mixing)), len(targets))):
            columns = {t: x.columns[..., rows] @ mixing[rows] for t, x in own.items()}
            sizes = self.model.mean[mine]
            changes = {t: self.grounds[t].seen(x @ sizes) for t, x in columns.items()}
            weights = np.sum([self._shares(t, x) for t, x in columns.items()], axis=0)
            for one in self._lines(term, targets[k], changes, self._spread(mine, weights)):
                yield replace(one, scale=self._scale(parts))

    def _rest(self) -> Iterator[Line]:
        """What no term explains: as much of it as the instruments' noise makes, and the unknown."""
        left = {t: self.grounds[t].seen(self.model.left[t]) for t in self.trials}
        own = {t: self.model.session.trials[t].noise for t in self.trials}
        noisy = _sum(self.grounds[t].components ** 2 @ x**2 for t, x in own.items())
        unknown = np.sqrt(np.maximum(_sum(x**2 for x in left.values()) - noisy, 0.0) / self.count)
        noise = np.sqrt(noisy / self.count)
        spread = self._spread(np.arange(len(self.model.mean)))
        for k, one in enumerate(self._lines(UNKNOWN, "", left, spread)):
            share = np.clip(noisy[k] / self.squares[k], 0.0, max(one.share, 0.0))
            low, high = one.share_low - share, one.share_high - share
            yield Line(UNKNOWN, "", one.component, unknown[k], one.share - share, low, high)
            yield Line(NOISE, "", one.component, noise[k], share, share, share)

    def _scale(self, parts: Sequence[Part]) -> float:
        return float(np.mean([self.model.scales[p.scale] for p in parts]))

    def _change(
        self, parts: Sequence[Part], trial: int, mean: np.ndarray | None = None
    ) -> np.ndarray:
        each = [self.model.of(part, trial, mean) for part in parts]
        return self.grounds[trial].seen(np.sum(each, axis=0))

    def _gains(self, parts: Sequence[Part]) -> list[ErrorGain]:
        """Per component, from coefficients that rest on the other folds; none of what is a trial's
        own where the trial is held out as a whole."""
        folds = [
            (fold, mean)
            for fold, mean in zip(self.model.folds, self.model.without, strict=True)
            if fold.trial in self.trials
        ]
        count = Counter(fold.trial for fold, _ in folds)
        if len(self.model.folds) < 2 or not any(p.trial == -1 or count[p.trial] > 1 for p in parts):
            return [_NO_GAIN] * len(COMPONENTS)
        errors = []
        for fold, mean in folds:
            before = self.residual[fold.trial][fold.rows]
            after = before - self._change(parts, fold.trial, mean)[fold.rows]
            blocks = self.grounds[fold.trial].blocks[fold.rows]
            pairs = zip(before.T, after.T, strict=True)
            errors.append([block_errors(0 * x, x, y, blocks) for x, y in pairs])
        return [error_gain(pooled([*one]), self.rng) for one in zip(*errors, strict=True)]

    def _alike(self, terms: Mapping[str, Sequence[Part]]) -> dict[tuple[str, str], tuple[str, ...]]:
        """By term and component, the terms with which its sum is surer than either alone: they
        stand in for each other."""
        spread = {term: self._spread(_coefficients(parts)) for term, parts in terms.items()}
        found: dict[tuple[str, str], tuple[str, ...]] = {}
        for a, b in permutations(terms, 2):
            both = self._spread(_coefficients([*terms[a], *terms[b]]))
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
# tissue or a body could swallow a plate that is turned round. What they explain counts up to what
# they make in 95 % of persons: noise is so small that they would stretch tenfold to explain all.

_NOTHING = np.finfo(float).tiny
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
    """An error of a component in a trial: its size [N, N m, m] with interval, and as a part of the
    yardstick; correlation of what is simulated with what is measured; p-value of noise."""

    trial: str
    component: str
    size: Number
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
    if not found:
        return ()
    worst = max(found, key=lambda one: one.part)
    factor, read = (1000.0, "mm") if worst.size.unit == "m" else (1.0, worst.size.unit)
    trials_with = tuple(dict.fromkeys(one.trial for one in found))
    follows = (
        f", and simulated and measured hardly go together (correlation {worst.correlation:.2f})"
        if worst.correlation < yardsticks.correlation
        else ""
    )
    size = (
        f"{factor * worst.size.value:.3g} {read} of {_WORDS[worst.component]} (RMS) remain "
        f"unexplained{follows}"
    )
    large = f"large is {factor * yardsticks.of(worst.component):.3g} {read} and more"
    what = f"large error, cause unknown: {size}; {large}; {along(trials_with, worst.component)}"
    said = UNEXPLAINED, "", trials_with, (worst.size,), Words(what, size, large)
    closing = interval_words((worst.size,))
    return (Finding(*said, worst.p_value, 1 - worst.p_value, closing=closing),)


def _of_trial(
    usual: ErrorModel, ground: Ground, trial: int, yardsticks: Yardsticks
) -> Iterator[_Large]:
    one, columns = usual.session.trials[trial], usual.session.columns[trial]
    left = ground.seen(usual.left[trial])
    explained = ground.seen(columns @ usual.mean[usual.session.used[trial]])
    noise = np.sqrt(np.nanmean(ground.components**2 @ one.noise**2, axis=0))
    for k, name in enumerate(COMPONENTS):
        known, yardstick, quiet = np.isfinite(left[:, k]), yardsticks.of(name), noise[k]
        if not known.any():
            continue
        error, measured, terms = (x[known, k] for x in (left, ground.measured, explained))
        usually = np.einsum("nj,njk->nk", ground.components[known, k], columns[known])
        most, much = Z95 * np.sqrt((usually**2).sum(axis=1).mean()), np.sqrt((terms**2).mean())
        error = error + terms * (1.0 - min(most / max(much, _NOTHING), 1.0))
        size, correlation = float(np.sqrt((error**2).mean())), np.nan
        if measured.std() > _LOUD * yardstick and (measured - error).std() > 0:
            correlation = float(np.corrcoef(measured, measured - error)[0, 1])
        if size > yardstick or correlation < yardsticks.correlation:
            samples = max(effective_samples(error), 1.0)
            p_value = float(chi2.sf(samples * (size / quiet) ** 2, samples))
            half = Z95 * (size / np.sqrt(2 * samples))
            unit = "m" if name.startswith("cop") else unit_of(name)
            number = Number("error", unit, size, max(size - half, 0.0), size + half)
            yield _Large(one.name, name, number, size / yardstick, correlation, p_value)
