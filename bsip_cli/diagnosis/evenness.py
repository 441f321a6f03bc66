"""Whether a fault is of one size throughout, or something else that only acts like it.

A plate turned by a degree is so in every second. What differs from second to second by a third of
itself or more has another cause, which no catalogue knows.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from bsip_cli.diagnosis.fault_model import Fitted
from bsip_cli.diagnosis.held_out import own_blocks
from bsip_cli.diagnosis.patterns import UNEXPLAINED, Nameless
from bsip_cli.effects.effect import Effect, Parameter, Reported
from bsip_cli.effects.scene import Scene

_SHARES = np.geomspace(0.3, 1.0, 3)  # of itself, by which an uneven fault differs


class Uneven(Nameless):
    """Like another effect, but of another size in every stretch of time."""

    of_the_lab = False

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

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        told = self.effect.sentence(scene, target, values)
        return f"no known fault makes what the forces show: {told}, but not evenly"


def plain(effect: Effect) -> Effect:
    """What an uneven effect acts like; another one itself."""
    return effect.effect if isinstance(effect, Uneven) else effect


def can_be_uneven(effect: Effect) -> bool:
    """A rail is touched now more, now less; what lasts is as it is."""
    return effect.lasts and effect.name != UNEXPLAINED


def unevenness(fit: Fitted, number: int, inflation: np.ndarray) -> float:
    """Logarithm of the Bayes factor of a size that differs from block to block, against one size.

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
    values, vectors = np.linalg.eigh(block_diag(*grams) - taken.T @ taken)
    along, values = vectors.T @ np.concatenate(pulls), np.maximum(values, 0.0)
    added = 1 + _SHARES[:, None] ** 2 * values
    logs = 0.5 * (_SHARES[:, None] ** 2 * along**2 / added - np.log(added)).sum(axis=1)
    return float(logsumexp(logs) - np.log(len(logs)))
