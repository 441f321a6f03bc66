"""The white signatures of all candidates, computed once and scored against any residual.

A candidate's score is what its best linear size takes off the squared white residual; under the
null a chi-square with as many degrees of freedom as it has free parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from bsip_cli.diagnosis.candidates import Candidate, candidates_of
from bsip_cli.diagnosis.evidence import TrialEvidence
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.effect import Effect
from bsip_cli.statistics.chi_square import minus_log_p

_RIDGE = 1e-9
_BATCH = 60  # candidates at a time


@dataclass(frozen=True)
class Place:
    """A candidate in some of the trials, by their numbers."""

    candidate: Candidate
    trials: tuple[int, ...]


@dataclass(frozen=True)
class _Filtered:
    """Signatures in one trial (n, 6, K), and which part of them is a candidate's."""

    columns: np.ndarray
    parts: dict[Candidate, slice]


@dataclass(frozen=True)
class _Stored:
    """The same, white: columns (6 n, K), in the shared space (p, K), and each candidate's Gram
    matrix (k, k)."""

    columns: np.ndarray
    shared: np.ndarray
    grams: dict[Candidate, np.ndarray]
    parts: dict[Candidate, slice]


@dataclass(frozen=True)
class Signatures:
    """All places of all effects: each trial alone, and all together where an effect lasts."""

    evidence: Evidence
    filtered: tuple[_Filtered, ...]
    stored: tuple[_Stored, ...]
    places: tuple[Place, ...]

    def on(self, evidence: Evidence) -> Signatures:
        """The same in the coordinates of other noise."""
        return _on(evidence, self.filtered)

    def trials_of(self, candidate: Candidate) -> set[int]:
        """In which trials a candidate is possible."""
        return {t for t, one in enumerate(self.stored) if candidate in one.parts}

    def scores(
        self, residuals: np.ndarray, known: np.ndarray
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """-log p (K, f) of every place for residuals (R, f), and the likeliest sizes of the first
        [typical]. What the columns ``known`` (R, q) can explain is taken off both."""
        basis, _ = np.linalg.qr(known)
        left = residuals - basis @ (basis.T @ residuals)
        products = self._products(np.column_stack([left, basis]))
        count = residuals.shape[1]
        logs, sizes = np.empty((len(self.places), count)), []
        for k, place in enumerate(self.places):
            gram, shared, product = self._sums(place, products)
            right = product[:, :count]
            whole = self._whole(gram, shared, product[:, count:])
            whole += _RIDGE * np.diag(np.diag(gram) + 1e-300)
            size = np.linalg.solve(whole, right)
            logs[k] = minus_log_p(np.einsum("kf,kf->f", right, size), len(gram))
            sizes.append(size[:, 0])
        return logs, sizes

    def information(self, known: np.ndarray) -> list[np.ndarray]:
        """(k, k) of every place, about its sizes [1/typical^2], beside the columns ``known``."""
        basis, _ = np.linalg.qr(known)
        products = self._products(basis)
        return [self._whole(*self._sums(place, products)) for place in self.places]

    def _products(self, courses: np.ndarray) -> list[np.ndarray]:
        """Per trial (K, f) of all signatures with courses (R, f)."""
        turned = self.evidence.turned(courses).astype(np.float32)
        return [one.columns.T @ turned[self.evidence.rows(t)] for t, one in enumerate(self.stored)]

    def _whole(self, gram: np.ndarray, shared: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """(k, k) information: the Gram matrix less what parameters and known columns take."""
        kept = 1 - (1 - self.evidence.shrink) ** 2
        return gram - shared.T @ (kept[:, None] * shared) - inside @ inside.T

    def _sums(
        self, place: Place, products: list[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Over the trials: Gram matrix, part in the shared space, products."""
        parts = [(t, self.stored[t], self.stored[t].parts[place.candidate]) for t in place.trials]
        gram = sum(one.grams[place.candidate] for _, one, _ in parts)
        shared = sum(one.shared[:, part] for _, one, part in parts)
        product = sum(products[t][part].astype(float) for t, _, part in parts)
        return np.asarray(gram), np.asarray(shared), np.asarray(product)


def signatures_of(evidence: Evidence, effects: Sequence[Effect]) -> Signatures:
    """Compute the signatures of all candidates of these effects."""
    return _on(evidence, tuple(_filtered(one, effects) for one in evidence.trials))


def _filtered(one: TrialEvidence, effects: Sequence[Effect]) -> _Filtered:
    candidates = (c for effect in effects for c in candidates_of(effect, one.scene))
    columns, parts, end = [], {}, 0
    while batch := tuple(islice(candidates, _BATCH)):
        signatures = [candidate.signature(one.scene) for candidate in batch]
        filtered = one.filtered.filter(np.concatenate(signatures, axis=2))
        ends = end + np.cumsum([0, *(s.shape[2] for s in signatures)])
        for candidate, (start, stop) in zip(batch, pairwise(ends), strict=True):
            mine = filtered[..., start - end : stop - end]
            if mine.any(axis=(0, 1)).all():  # else it touches no valid frame
                parts[candidate] = slice(int(start), int(stop))
        columns.append(filtered.astype(np.float32))
        end = int(ends[-1])
    return _Filtered(np.concatenate(columns, axis=2), parts)


def _on(evidence: Evidence, filtered: tuple[_Filtered, ...]) -> Signatures:
    stored = tuple(_stored(evidence, t, one) for t, one in enumerate(filtered))
    return Signatures(evidence, filtered, stored, tuple(_places(stored)))


def _stored(evidence: Evidence, trial: int, filtered: _Filtered) -> _Stored:
    columns = evidence.trials[trial].whitening.of_filtered(filtered.columns)
    left = evidence.left[evidence.rows(trial)].astype(np.float32)
    shared = (left.T @ columns).astype(float)
    grams = {}
    for candidate, part in filtered.parts.items():
        mine = columns[:, part].astype(float)
        grams[candidate] = mine.T @ mine
    return _Stored(columns, shared, grams, filtered.parts)


def _places(stored: tuple[_Stored, ...]) -> Iterator[Place]:
    for t, one in enumerate(stored):
        for candidate in one.parts:
            yield Place(candidate, (t,))
    for candidate in dict.fromkeys(c for one in stored for c in one.parts):
        holding = tuple(t for t, one in enumerate(stored) if candidate in one.parts)
        if candidate.effect.lasts and len(holding) > 1:
            yield Place(candidate, holding)
