"""Faults over intervals of time: what one is worth where it did not help to find its size, and
whether it is of one size throughout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from bsip_cli.diagnosis.error_model import Session
from bsip_cli.diagnosis.fault_model import Fitted
from bsip_cli.diagnosis.normal_equations import Equations, solved
from bsip_cli.statistics.samples import Z95

FOLDS = 5


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
    counts = [int(one.blocks.max()) + 1 for one in session.trials]
    return np.cumsum([0, *counts[:-1]]).tolist()


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
        offsets = {t: fit.pieces[t].noise.white_one(one.columns(t)[1]) for t in one.trials}
        without = _means(fit, self.blocks, offsets, but=number)
        saved, before = [], 0.0
        for t in one.trials:
            piece, blocks = fit.pieces[t], self.blocks[t]
            own = np.ix_(blocks % FOLDS, piece.used)
            full, fewer = (
                np.einsum("rk,rk->r", piece.white, x[own]) for x in (self.means, without)
            )
            squares = (piece.right + offsets[t] - fewer) ** 2
            before += float(squares.sum())
            saved.append(np.bincount(blocks - blocks.min(), squares - (piece.right - full) ** 2))
        return Gain(np.concatenate(saved), before)


def held_out(fit: Fitted) -> HeldOut:
    """Every fifth block of all trials is left out in turn."""
    trials = zip(first_blocks(fit.session), fit.session.trials, strict=True)
    blocks = tuple(np.repeat(first + one.blocks, 6) for first, one in trials)
    return HeldOut(fit, blocks, _means(fit, blocks, {}))


def _means(
    fit: Fitted,
    blocks: tuple[np.ndarray, ...],
    more: Mapping[int, np.ndarray],
    but: int | None = None,
) -> np.ndarray:
    """(FOLDS, K) coefficients without each fold, those of a fault zero; ``more`` is added to a
    trial's white residual. Moments, frequencies and windows stay as all seconds have them: without
    the second that shows them nothing does."""
    root, means = fit.root.copy(), np.zeros((FOLDS, len(fit.mean)))
    for number, one in enumerate(fit.faults):
        root[fit.coefficients(number)] *= one.is_free & (number != but)
    for fold in range(FOLDS):
        equations = []
        for t, piece in enumerate(fit.pieces):
            offset, rows = more.get(t, np.zeros(len(piece.right))), blocks[t] % FOLDS == fold
            white, right = piece.white[rows], (piece.right + offset)[rows]
            against = piece.against + piece.white.T @ offset - white.T @ right
            equations.append(Equations(piece.used, piece.gram - white.T @ white, against))
        means[fold] = solved(equations, root).mean
    return means


# --- is a fault of one size throughout, or something else that only acts like it? -----------------

# A plate turned by a degree is so in every second. What differs from second to second by a third of
# itself or more has another cause, which no catalogue knows.

_SHARES = np.geomspace(0.3, 1.0, 3)  # of itself, by which an uneven fault differs
# A step, of itself: what begins or ends within a trial changes by its mean at least. The spreads
# overlap.
_STEPS, _SPREAD = np.geomspace(1.0, 3.0, 3), 0.3


def unevenness(fit: Fitted, number: int, inflation: np.ndarray) -> float:
    """Logarithm of the Bayes factor of a size that is not the same throughout, against one size:
    it differs from block to block, or is there from a block of a trial on, or until then.

    inflation (T,) : the trials' likelihoods count by so much less.
    """
    one = fit.faults[number]
    pulls, grams, shared = [], [], []
    pairs = zip(fit.pieces, inflation.tolist(), strict=True)
    # the likeliest coefficients where trials count so: with others the blocks' pulls do not agree
    less = [Equations(piece.used, piece.gram / x, piece.against / x) for piece, x in pairs]
    posterior = solved(less, fit.root)
    for t, trial in zip(one.trials, one.in_trials, strict=True):
        piece, block = fit.pieces[t], trial.blocks
        mine = block[:, None, None] == np.arange(block.max() + 1)
        change = one.columns(t)[0][..., one.is_free] @ (one.values / one.typical)[one.is_free]
        white = piece.noise.white(np.where(mine, change[..., None], 0.0))
        counted = white / inflation[t]
        pulls.append(counted.T @ piece.left(posterior.mean))
        alone, together = (x @ (piece.white.T @ counted) for x in posterior.roots(t))
        grams.append(white.T @ counted - alone.T @ alone)
        shared.append(together)
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
