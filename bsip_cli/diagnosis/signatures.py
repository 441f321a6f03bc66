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
class _Batch:
    """Places (n,) with as many free parameters k: their numbers, information (n, k, k) beside what
    the trials share, and per trial which signatures are theirs (n, k), -1 for none."""

    numbers: np.ndarray
    information: np.ndarray
    columns: tuple[np.ndarray, ...]

    def sums(self, products: Sequence[np.ndarray]) -> np.ndarray:
        """(n, k, f) over the trials of products (K + 1, f), whose last row is zero."""
        return sum(
            (one[columns] for one, columns in zip(products, self.columns, strict=True)),
            np.zeros(()),
        )


@dataclass(frozen=True)
class Signatures:
    """All places of all effects: each trial alone, and all together where an effect lasts."""

    evidence: Evidence
    filtered: tuple[_Filtered, ...]
    stored: tuple[_Stored, ...]
    places: tuple[Place, ...]
    batches: tuple[_Batch, ...]

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
        logs = np.empty((len(self.places), count))
        sizes = [np.zeros(0)] * len(self.places)
        for batch in self.batches:
            sums = batch.sums(products)
            right, inside = sums[..., :count], sums[..., count:]
            whole = batch.information - inside @ inside.swapaxes(1, 2)
            whole += _RIDGE * _diagonal(batch.information)
            likeliest = np.linalg.solve(whole, right)
            lost = np.einsum("nkf,nkf->nf", right, likeliest)
            logs[batch.numbers] = minus_log_p(lost, right.shape[1])
            for k, size in zip(batch.numbers, likeliest[..., 0], strict=True):
                sizes[k] = size
        return logs, sizes

    def information(self, known: np.ndarray) -> list[np.ndarray]:
        """(k, k) of every place, about its sizes [1/typical^2], beside the columns ``known``."""
        basis, _ = np.linalg.qr(known)
        products = self._products(basis)
        found = [np.zeros((0, 0))] * len(self.places)
        for batch in self.batches:
            inside = batch.sums(products)
            whole = batch.information - inside @ inside.swapaxes(1, 2)
            for k, one in zip(batch.numbers, whole, strict=True):
                found[k] = one
        return found

    def _products(self, courses: np.ndarray) -> list[np.ndarray]:
        """Per trial (K + 1, f) of all signatures, and of none, with courses (R, f)."""
        turned = self.evidence.turned(courses).astype(np.float32)
        none = np.zeros((1, courses.shape[1]))
        return [
            np.concatenate([one.columns.T @ turned[self.evidence.rows(t)], none])
            for t, one in enumerate(self.stored)
        ]


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
    places = tuple(_places(stored))
    return Signatures(evidence, filtered, stored, places, tuple(_batches(evidence, stored, places)))


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


def _batches(
    evidence: Evidence, stored: tuple[_Stored, ...], places: Sequence[Place]
) -> Iterator[_Batch]:
    numbers: dict[int, list[int]] = {}
    for number, place in enumerate(places):
        part = stored[place.trials[0]].parts[place.candidate]
        numbers.setdefault(part.stop - part.start, []).append(number)
    for width, mine in numbers.items():
        members = [places[k] for k in mine]
        columns = tuple(_columns_of(t, one, members, width) for t, one in enumerate(stored))
        information = np.stack([_information(evidence, stored, place) for place in members])
        yield _Batch(np.array(mine), information, columns)


def _columns_of(trial: int, one: _Stored, members: Sequence[Place], width: int) -> np.ndarray:
    """(n, k) which of a trial's signatures belong to places, -1 for none."""
    columns = np.full((len(members), width), -1)
    for k, place in enumerate(members):
        if trial in place.trials:
            part = one.parts[place.candidate]
            columns[k] = np.arange(part.start, part.stop)
    return columns


def _information(evidence: Evidence, stored: tuple[_Stored, ...], place: Place) -> np.ndarray:
    """(k, k) Gram matrix less what the trials' shared parameters take."""
    parts = [(stored[t], stored[t].parts[place.candidate]) for t in place.trials]
    gram = np.sum([one.grams[place.candidate] for one, _ in parts], axis=0)
    shared = np.sum([one.shared[:, part] for one, part in parts], axis=0)
    kept = 1 - (1 - evidence.shrink) ** 2
    return gram - shared.T @ (kept[:, None] * shared)


def _diagonal(matrices: np.ndarray) -> np.ndarray:
    """(n, k, k) with nothing but the diagonals of (n, k, k), and never quite zero."""
    size = matrices.shape[1]
    return np.eye(size) * (np.einsum("nkk->nk", matrices) + 1e-300)[:, None, :]
