"""The error budget: what each term of the error does to forces, moments and centre of pressure.

A term's share of a component is its contribution projected on the residual, over the residual's
square; with noise and unknown, which share what no term explains, the shares add up to the whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from bsip_cli.diagnosis.error_gain import ErrorGain, block_errors, error_gain, pooled
from bsip_cli.diagnosis.error_model import ErrorModel, Part, Term
from bsip_cli.statistics.samples import Z95

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
    which these recordings hardly tell it.
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

    def lines(self) -> Iterator[Line]:
        model = self.model
        here = tuple(p for p in model.parts if p.trial in (-1, *self.trials))
        residual = {t: self.grounds[t].seen(model.trials[t].residual) for t in self.trials}
        squares = _sum(x**2 for x in residual.values())
        count = sum(np.isfinite(x).sum(axis=0) for x in residual.values())
        weights = self._weights(residual) / squares[:, None]
        terms = list(dict.fromkeys(p.term for p in here))
        alike = self._alike(weights, here, terms)
        for term in terms:
            whole = tuple(p for p in here if p.term == term)
            targets = dict.fromkeys(p.target for p in whole)
            yield from self._inside(term, whole, residual, squares, count)
            for target in ("", *(t for t in targets if t and len(targets) > 1)):
                parts = tuple(p for p in whole if not target or p.target == target)
                lines = self._of(parts, residual, squares, count, weights)
                for one in lines:
                    like = alike.get((term, one.component), ())
                    yield replace(one, term=term, target=target, alike=like)
        yield from self._rest(residual, squares, count, weights)
        gains = self._gains(here, residual)
        for k, name in enumerate(COMPONENTS):
            rms = float(np.sqrt(squares[k] / count[k]))
            yield Line(TOTAL, "", name, rms, 1.0, 1.0, 1.0, gains[k], np.nan)

    def _weights(self, residual: dict[int, np.ndarray]) -> np.ndarray:
        """(8, K) what each coefficient adds to the projections on the residual."""
        weights = np.zeros((len(COMPONENTS), len(self.model.mean)))
        for t, one in residual.items():
            seen = np.nan_to_num(self.grounds[t].components * one[:, :, None])
            used, columns = self.model.used[t], self.model.columns[t]
            weights[:, used] += np.tensordot(seen, columns, axes=([0, 2], [0, 1]))
        return weights

    def _of(
        self,
        parts: tuple[Part, ...],
        residual: dict[int, np.ndarray],
        squares: np.ndarray,
        count: np.ndarray,
        weights: np.ndarray,
    ) -> Iterator[Line]:
        changes = {t: self.grounds[t].seen(self._change(parts, t)) for t in residual}
        rms = np.sqrt(_sum(x**2 for x in changes.values()) / count)
        share = _sum(changes[t] * residual[t] for t in residual) / squares
        half = Z95 * self._spread(parts, weights)
        gains = self._gains(parts, residual)
        scale = float(np.mean([self.model.scales[p.scale] for p in parts]))
        for k, name in enumerate(COMPONENTS):
            low, high = share[k] - half[k], share[k] + half[k]
            yield Line("", "", name, rms[k], share[k], low, high, gains[k], scale)

    def _inside(
        self,
        term: str,
        parts: tuple[Part, ...],
        residual: dict[int, np.ndarray],
        squares: np.ndarray,
        count: np.ndarray,
    ) -> Iterator[Line]:
        """The targets of terms whose coefficients are several targets' at once."""
        parts = tuple(p for p in parts if p in self.model.mixed)
        if not parts:
            return
        mine = np.concatenate([np.arange(p.start, p.stop) for p in parts])
        mixed = np.concatenate([self.model.mixed[p] for p in parts], axis=1)
        mean, inside = self.model.mean[mine], self.model.covariance[np.ix_(mine, mine)]
        scale = float(np.mean([self.model.scales[p.scale] for p in parts]))
        bare = {t: self._bare(parts[0], t) for t in residual}
        targets = next(iter(bare.values())).targets
        wide = len(mixed) // len(targets)
        for k, target in enumerate(targets):
            at = slice(wide * k, wide * (k + 1))
            changes, weights = [], np.zeros((len(COMPONENTS), wide))
            for t, one in residual.items():
                ground, columns = self.grounds[t], bare[t].columns[..., at]
                changes.append(ground.seen(columns @ (mixed[at] @ mean)))
                seen = np.nan_to_num(ground.components * one[:, :, None])
                weights += np.tensordot(seen, columns, axes=([0, 2], [0, 1]))
            rms = np.sqrt(_sum(x**2 for x in changes) / count)
            weights = weights @ mixed[at] / squares[:, None]
            share = weights @ mean
            half = Z95 * np.sqrt(np.einsum("ik,kl,il->i", weights, inside, weights))
            for c, name in enumerate(COMPONENTS):
                low, high = share[c] - half[c], share[c] + half[c]
                yield Line(term, target, name, rms[c], share[c], low, high, _NO_GAIN, scale)

    def _bare(self, part: Part, trial: int) -> Term:
        return next(x for x in self.model.trials[trial].terms if x.scale == part.scale)

    def _rest(
        self,
        residual: dict[int, np.ndarray],
        squares: np.ndarray,
        count: np.ndarray,
        weights: np.ndarray,
    ) -> Iterator[Line]:
        """What no term explains: as much of it as the instruments' noise makes, and the unknown."""
        left = {t: self.grounds[t].seen(self.model.left[t]) for t in residual}
        share = _sum(left[t] * residual[t] for t in residual) / squares
        noisy = _sum(
            self.grounds[t].components ** 2 @ self.model.trials[t].noise ** 2 for t in left
        )
        noise = np.clip(noisy / squares, 0.0, np.maximum(share, 0.0))
        unknown = np.sqrt(np.maximum(_sum(x**2 for x in left.values()) - noisy, 0.0) / count)
        half = Z95 * self._spread(self.model.parts, weights)
        for k, name in enumerate(COMPONENTS):
            rest = share[k] - noise[k]
            low, high = rest - half[k], rest + half[k]
            yield Line(UNKNOWN, "", name, unknown[k], rest, low, high, _NO_GAIN, np.nan)
            rms = np.sqrt(noisy[k] / count[k])
            yield Line(NOISE, "", name, rms, noise[k], noise[k], noise[k], _NO_GAIN, np.nan)

    def _change(
        self, parts: Sequence[Part], trial: int, mean: np.ndarray | None = None
    ) -> np.ndarray:
        none = np.zeros_like(self.model.trials[trial].residual)
        return sum((self.model.of(part, trial, mean) for part in parts), none)

    def _spread(self, parts: Sequence[Part], weights: np.ndarray) -> np.ndarray:
        """(8,) standard deviation of a share: it is linear in the coefficients."""
        mine = np.concatenate([np.arange(p.start, p.stop) for p in parts])
        inside = self.model.covariance[np.ix_(mine, mine)]
        return np.sqrt(np.einsum("ik,kl,il->i", weights[:, mine], inside, weights[:, mine]))

    def _gains(self, parts: Sequence[Part], residual: dict[int, np.ndarray]) -> list[ErrorGain]:
        """Per component, from coefficients that rest on the other folds; none of what is a trial's
        own where the trial is held out as a whole."""
        folds = [(f, x) for f, x in zip(self.model.folds, self.model.without, strict=True)]
        folds = [(f, x) for f, x in folds if f.trial in residual]
        if len(self.model.folds) < 2 or not any(
            p.trial == -1 or sum(f.trial == p.trial for f, _ in folds) > 1 for p in parts
        ):
            return [_NO_GAIN] * len(COMPONENTS)
        errors = []
        for fold, mean in folds:
            ground, before = self.grounds[fold.trial], residual[fold.trial][fold.rows]
            change = ground.seen(self._change(parts, fold.trial, mean))[fold.rows]
            blocks = ground.blocks[fold.rows]
            errors.append([(x, x - c, blocks) for x, c in zip(before.T, change.T, strict=True)])
        return [
            error_gain(pooled([block_errors(0 * x, x, y, b) for x, y, b in one]), self.rng)
            for one in zip(*errors, strict=True)
        ]

    def _alike(
        self, weights: np.ndarray, here: Sequence[Part], terms: Sequence[str]
    ) -> dict[tuple[str, str], tuple[str, ...]]:
        """By term and component, the terms with which its sum is surer than either alone: they
        stand in for each other."""
        of = {term: [p for p in here if p.term == term] for term in terms}
        spread = {term: self._spread(parts, weights) for term, parts in of.items()}
        found: dict[tuple[str, str], tuple[str, ...]] = {}
        for a, b in permutations(terms, 2):
            both = self._spread([*of[a], *of[b]], weights)
            surer = both < _SURER * np.minimum(spread[a], spread[b])
            for component in np.array(COMPONENTS)[surer].tolist():
                found[a, component] = (*found.get((a, component), ()), b)
        return found


def _sum(parts: Iterable[np.ndarray]) -> np.ndarray:
    """Over samples and trials, where they are known."""
    return np.sum([np.nansum(one, axis=0) for one in parts], axis=0)
