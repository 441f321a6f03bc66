"""The signatures of all candidates, computed once and scored against any white residual.

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

_RIDGE = 1e-6  # of the information: as much is rounding
_BATCH = 60  # candidates at a time
_OF_ITS_OWN = 0.2  # of the square of a signature, that what is known leaves of it at least


@dataclass(frozen=True)
class Place:
    """A candidate in some of the trials, by their numbers."""

    candidate: Candidate
    trials: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Filtered:
    """Signatures in one trial (n, 6, K), and which part of them is a candidate's.

    White ones are not kept beside them: these are by far the most that a diagnosis holds.
    """

    columns: np.ndarray
    parts: dict[Candidate, slice]


@dataclass(frozen=True, eq=False)
class _Products:
    """Of the white signatures: those with the shared space (p, K), and each candidate's Gram matrix
    (k, k)."""

    shared: np.ndarray
    grams: dict[Candidate, np.ndarray]


@dataclass(frozen=True, eq=False)
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
    places: tuple[Place, ...]
    batches: tuple[_Batch, ...]

    def on(self, evidence: Evidence) -> Signatures:
        """The same in the coordinates of other noise."""
        return _on(evidence, self.filtered)

    def trials_of(self, candidate: Candidate) -> set[int]:
        """In which trials a candidate is possible."""
        return {t for t, one in enumerate(self.filtered) if candidate in one.parts}

    def white(self, trial: int, candidate: Candidate) -> np.ndarray:
        """(6 n, k) of a candidate, in the coordinates of one trial."""
        one = self.filtered[trial]
        mine = one.columns[..., one.parts[candidate]].astype(float)
        return self.evidence.trials[trial].whitening.of_filtered(mine)

    def scores(
        self, residuals: np.ndarray, known: np.ndarray
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """-log p (K, f) of every place for residuals (R, f), and the likeliest sizes of the first
        [typical]. What the columns ``known`` (R, q) can explain is taken off both; 0 where hardly
        anything of a signature is left, as of a jump of the clock beside a delay."""
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
            alone = np.einsum("nkf,nkf->nf", likeliest, batch.information @ likeliest)
            logs[batch.numbers] = minus_log_p(lost, right.shape[1]) * (lost > _OF_ITS_OWN * alone)
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
        turned = self.evidence.turned(courses)
        none = np.zeros((1, courses.shape[1]))
        found = []
        for t, (one, trial) in enumerate(zip(self.filtered, self.evidence.trials, strict=True)):
            rows = trial.whitening.transposed(turned[self.evidence.rows(t)]).astype(np.float32)
            products = _flat(one.columns).T @ _flat(rows)
            found.append(np.concatenate([products, none]))
        return found


def signatures_of(evidence: Evidence, effects: Sequence[Effect]) -> Signatures:
    """Compute the signatures of all candidates of these effects."""
    return _on(evidence, tuple(_filtered(one, effects) for one in evidence.trials))


def _filtered(one: TrialEvidence, effects: Sequence[Effect]) -> _Filtered:
    candidates = [c for effect in effects for c in candidates_of(effect, one.scene)]
    ends = np.cumsum([0, *(len(candidate.free(one.scene)) for candidate in candidates)])
    columns = np.empty((*one.filtered.residual.shape, ends[-1]), np.float32)
    parts = {}
    for first in range(0, len(candidates), _BATCH):
        batch = candidates[first : first + _BATCH]
        wrenches = np.concatenate([c.signature(one.scene) for c in batch], axis=2)
        filtered = one.filtered.filter(wrenches)
        mine = ends[first : first + len(batch) + 1]
        columns[..., mine[0] : mine[-1]] = filtered
        for candidate, (start, stop) in zip(batch, pairwise(mine), strict=True):
            touched = filtered[..., start - mine[0] : stop - mine[0]].any(axis=(0, 1))
            if touched.all():  # else it touches no valid frame
                parts[candidate] = slice(int(start), int(stop))
    return _Filtered(columns, parts)


def _on(evidence: Evidence, filtered: tuple[_Filtered, ...]) -> Signatures:
    products = tuple(_products(evidence, t, one) for t, one in enumerate(filtered))
    places = tuple(_places(filtered))
    batches = tuple(_batches(evidence, filtered, products, places))
    return Signatures(evidence, filtered, places, batches)


def _products(evidence: Evidence, trial: int, filtered: _Filtered) -> _Products:
    whitening = evidence.trials[trial].whitening
    left = evidence.left[evidence.rows(trial)].astype(np.float32)
    shared = np.zeros((left.shape[1], filtered.columns.shape[2]))
    grams = {}
    candidates = iter(filtered.parts.items())
    while batch := tuple(islice(candidates, _BATCH)):
        start, stop = batch[0][1].start, batch[-1][1].stop
        white = whitening.of_filtered(filtered.columns[..., start:stop])
        shared[:, start:stop] = left.T @ white
        for candidate, part in batch:
            mine = white[:, part.start - start : part.stop - start].astype(float)
            grams[candidate] = mine.T @ mine
    return _Products(shared, grams)


def _places(filtered: tuple[_Filtered, ...]) -> Iterator[Place]:
    for t, one in enumerate(filtered):
        for candidate in one.parts:
            yield Place(candidate, (t,))
    for candidate in dict.fromkeys(c for one in filtered for c in one.parts):
        holding = tuple(t for t, one in enumerate(filtered) if candidate in one.parts)
        if candidate.effect.lasts and len(holding) > 1:
            yield Place(candidate, holding)


def _batches(
    evidence: Evidence,
    filtered: tuple[_Filtered, ...],
    products: tuple[_Products, ...],
    places: Sequence[Place],
) -> Iterator[_Batch]:
    numbers: dict[int, list[int]] = {}
    for number, place in enumerate(places):
        part = filtered[place.trials[0]].parts[place.candidate]
        numbers.setdefault(part.stop - part.start, []).append(number)
    for width, mine in numbers.items():
        members = [places[k] for k in mine]
        columns = tuple(_columns_of(t, one, members, width) for t, one in enumerate(filtered))
        found = (_information(evidence, filtered, products, place) for place in members)
        information = np.stack(list(found))
        yield _Batch(np.array(mine), information, columns)


def _columns_of(trial: int, one: _Filtered, members: Sequence[Place], width: int) -> np.ndarray:
    """(n, k) which of a trial's signatures belong to places, -1 for none."""
    columns = np.full((len(members), width), -1)
    for k, place in enumerate(members):
        if trial in place.trials:
            part = one.parts[place.candidate]
            columns[k] = np.arange(part.start, part.stop)
    return columns


def _information(
    evidence: Evidence,
    filtered: tuple[_Filtered, ...],
    products: tuple[_Products, ...],
    place: Place,
) -> np.ndarray:
    """(k, k) Gram matrix less what the trials' shared parameters take."""
    grams = [products[t].grams[place.candidate] for t in place.trials]
    parts = [products[t].shared[:, filtered[t].parts[place.candidate]] for t in place.trials]
    shared = np.sum(parts, axis=0)
    kept = 1 - (1 - evidence.shrink) ** 2
    return np.sum(grams, axis=0) - shared.T @ (kept[:, None] * shared)


def _flat(courses: np.ndarray) -> np.ndarray:
    """(6 n, k) of (n, 6, k)."""
    return courses.reshape(6 * len(courses), courses.shape[2])


def _diagonal(matrices: np.ndarray) -> np.ndarray:
    """(n, k, k) with nothing but the diagonals of (n, k, k), and never quite zero."""
    size = matrices.shape[1]
    return np.eye(size) * (np.einsum("nkk->nk", matrices) + 1e-300)[:, None, :]
