"""Faults over intervals of time: what one is worth where it did not help to find its size, and
whether it is of one size throughout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from bsip_cli.diagnosis.error_model import posterior
from bsip_cli.diagnosis.fault_model import Fitted, Session, columns_of, summed
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.nameless import UNEXPLAINED, Nameless
from bsip_cli.effects.scene import Scene
from bsip_cli.statistics.samples import Z95

FOLDS = 5
BLOCK_S = 1.0  # intervals of time that stand for independent ones


@dataclass(frozen=True, eq=False)
class Gain:
    """Squared white residual that goes, per block (b,) of the trials concerned.

    before : their squared white residual without the fault.

    percent : of the squared residual, and its standard error over the blocks.
    """

    blocks: np.ndarray
    before: float

    @property
    def percent(self) -> float:
        return 100 * float(self.blocks.sum()) / self.before

    @property
    def error_percent(self) -> float:
        count = len(self.blocks)
        spread = np.sqrt(count) * self.blocks.std(ddof=1) if count > 1 else np.inf
        return 100 * float(spread) / self.before

    def is_real(self) -> bool:
        """Larger than its standard error."""
        return self.percent > self.error_percent

    def interval(self) -> tuple[float, float, float]:
        """Percent, and its 95 % interval."""
        half = Z95 * self.error_percent
        return self.percent, self.percent - half, self.percent + half


def first_blocks(session: Session) -> list[int]:
    """Number of each trial's first block, counted through all of them."""
    counts = [int(own_blocks(session, t).max()) + 1 for t in range(len(session.trials))]
    return np.cumsum([0, *counts[:-1]]).tolist()


def start_s(session: Session, trial: int) -> float:
    """When a trial's first block begins."""
    one = session.trials[trial]
    return float(one.scene.times_s[one.errors.filter.frames][0])


def own_blocks(session: Session, trial: int) -> np.ndarray:
    """(n,) block of each sample of a trial."""
    one = session.trials[trial]
    times = one.scene.times_s[one.errors.filter.frames]
    return ((times - start_s(session, trial)) / BLOCK_S).astype(int)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A fit without each fold in turn: coefficients (FOLDS, K); rows are the trials' blocks."""

    fit: Fitted
    blocks: tuple[np.ndarray, ...]
    means: np.ndarray

    def values(self, number: int) -> np.ndarray:
        """(FOLDS, k) all parameters of a fault."""
        return np.array([self.fit.values_at(number, mean) for mean in self.means])

    def gain(self, number: int) -> Gain:
        """Of a fault given the others: both with and without it, every block is judged by the
        other folds."""
        fit, one = self.fit, self.fit.faults[number]
        kept = _linear(fit)
        kept[fit.coefficients(number)] = False
        offsets = {
            t: fit.whitened(t, columns_of(fit.session, one, t)[1][..., None])[:, 0]
            for t in one.trials
        }
        without = _means(fit, self.blocks, kept, offsets)
        saved: list[np.ndarray] = []
        before = 0.0
        for t in one.trials:
            piece, fold = fit.pieces[t], self.blocks[t] % FOLDS
            at = piece.used[None, :], fold[:, None]
            own = (x[at[1], at[0]] for x in (self.means, without))
            full, fewer = (np.einsum("rk,rk->r", piece.white, x) for x in own)
            squares = (piece.right + offsets[t] - fewer) ** 2
            before += float(squares.sum())
            gone = squares - (piece.right - full) ** 2
            saved.append(np.bincount(self.blocks[t] - self.blocks[t].min(), gone))
        return Gain(np.concatenate(saved), before)


def held_out(fit: Fitted) -> HeldOut:
    """Every fifth block of all trials is left out in turn."""
    firsts = first_blocks(fit.session)
    blocks = tuple(
        np.repeat(first + own_blocks(fit.session, t), 6) for t, first in enumerate(firsts)
    )
    return HeldOut(fit, blocks, _means(fit, blocks, _linear(fit), {}))


def _linear(fit: Fitted) -> np.ndarray:
    """(K,) False for moments, frequencies and windows: without the second that shows them nothing
    does, so they stay as all seconds have them."""
    kept = np.ones(len(fit.mean), dtype=bool)
    for number, one in enumerate(fit.faults):
        kept[fit.coefficients(number)] = one.is_free(fit.session)
    return kept


def _means(
    fit: Fitted, blocks: tuple[np.ndarray, ...], kept: np.ndarray, more: dict[int, np.ndarray]
) -> np.ndarray:
    """(FOLDS, K) coefficients without each fold, those that are not ``kept`` zero; ``more`` is
    added to a trial's white residual."""
    count = len(fit.mean)
    gram, against = summed(fit.pieces, count)
    for t, offset in more.items():
        against[fit.pieces[t].used] += fit.pieces[t].white.T @ offset
    means = np.zeros((FOLDS, count))
    for fold in range(FOLDS):
        its, to = gram.copy(), against.copy()
        for t, piece in enumerate(fit.pieces):
            rows = blocks[t] % FOLDS == fold
            white = piece.white[rows]
            right = (piece.right + more.get(t, 0.0))[rows]
            its[np.ix_(piece.used, piece.used)] -= white.T @ white
            to[piece.used] -= white.T @ right
        block = np.ix_(kept, kept)
        means[fold, kept] = posterior(its[block], to[kept], fit.root[kept])[0]
    return means


# --- is a fault of one size throughout, or something else that only acts like it? -----------------

# A plate turned by a degree is so in every second. What differs from second to second by a third of
# itself or more has another cause, which no catalogue knows.

_SHARES = np.geomspace(0.3, 1.0, 3)  # of itself, by which an uneven fault differs
# A step, of itself: what begins or ends within a trial changes by its mean at least. The spreads
# overlap.
_STEPS, _SPREAD = np.geomspace(1.0, 3.0, 3), 0.3


class Uneven(Nameless):
    """Like another effect, but of another size in every interval of time."""

    is_of_laboratory = False

    def __init__(self, effect: Effect) -> None:
        self.effect = effect

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return self.effect.targets(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return self.effect.parameters(scene, target)

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        return self.effect.scans(scene, target)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return self.effect.change(scene, target, values)

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return self.effect.tangent(scene, target, values)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return self.effect.reported(scene, target, values)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        known = self.effect.words(scene, target, values)
        return replace(known, what=f"of unknown cause: {known.what}, but not evenly", short="")


def plain(effect: Effect) -> Effect:
    """What an uneven effect acts like; another one itself."""
    return effect.effect if isinstance(effect, Uneven) else effect


def can_be_uneven(effect: Effect) -> bool:
    """A rail is touched now more, now less; what trials share is as it is."""
    return effect.is_shared and effect.name != UNEXPLAINED


def unevenness(fit: Fitted, number: int, inflation: np.ndarray) -> float:
    """Logarithm of the Bayes factor of a size that is not the same throughout, against one size:
    it differs from block to block, or is there from a block of a trial on, or until then.

    inflation (T,) : the trials' likelihoods count by so much less.
    """
    session, one, root = fit.session, fit.faults[number], fit.root_of_covariance
    pulls, grams, shared = [], [], []
    for t in one.trials:
        trial, piece = session.trials[t], fit.pieces[t]
        change = trial.errors.filter.one(one.effect.change(trial.simulated, one.target, one.values))
        block = own_blocks(session, t)
        mine = block[:, None, None] == np.arange(block.max() + 1)
        white = fit.whitened(t, np.where(mine, change[..., None], 0.0))
        pulls.append(white.T @ fit.left(t) / inflation[t])
        grams.append(white.T @ white / inflation[t])
        shared.append(root[piece.used].T @ (piece.white.T @ white) / np.sqrt(inflation[t]))
    taken = np.concatenate(shared, axis=1)
    gram, pull = block_diag(*grams) - taken.T @ taken, np.concatenate(pulls)
    within: list[float] = []  # logarithms of the Bayes factors of a step in each trial
    first = 0
    for count in map(len, pulls):
        mine = slice(first, first := first + count)
        if count > 1:
            own_pull, own_gram = _beside_the_mean(pull[mine], gram[mine, mine])
            later = np.tril(np.ones((count, count)))[:, 1:]
            information = np.diag(later.T @ own_gram @ later)
            within.append(_mean(_of_steps(later.T @ own_pull, information)))
    pull, gram = _beside_the_mean(pull, gram)
    values, vectors = np.linalg.eigh(gram)
    along, added = vectors.T @ pull, 1 + _SHARES[:, None] ** 2 * np.maximum(values, 0.0)
    shares = 0.5 * (_SHARES[:, None] ** 2 * along**2 / added - np.log(added)).sum(axis=1)
    everywhere = _mean(shares)
    if not within:
        return everywhere
    some = float(np.logaddexp(0.0, within).sum())  # of all choices of trials with a step
    steps = some + np.log(-np.expm1(-some)) - np.log(2.0 ** len(within) - 1)  # but for none
    return _mean(np.array([everywhere, steps]))


def _beside_the_mean(pull: np.ndarray, gram: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pull (b,) and information (b, b) of blocks, whatever size they share: it is the fault's."""
    shared = gram.sum(axis=1)
    weight = max(float(gram.sum()), 1e-9)
    return pull - shared * pull.sum() / weight, gram - np.outer(shared, shared) / weight


def _of_steps(pull: np.ndarray, information: np.ndarray) -> np.ndarray:
    """Logarithms of the Bayes factors of steps of all sizes, up and down, against none, from their
    pull (b,) and information (b,)."""
    information = np.maximum(information, 1e-9)
    found, variance = pull / information, 1 / information
    size = np.concatenate([_STEPS, -_STEPS])[:, None]
    total = variance + (_SPREAD * size) ** 2
    return np.asarray(
        0.5 * (found**2 / variance - (found - size) ** 2 / total - np.log(total / variance))
    )


def _mean(logs: np.ndarray) -> float:
    """Logarithm of the mean of what has these logarithms."""
    return float(logsumexp(logs) - np.log(logs.size))
