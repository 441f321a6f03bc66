"""The noise beside what the likeliest candidates explain.

A cause must not be taken for noise: whitening would hide it, and the noise of a trial with a large
cause would make all causes look alike. So the candidates that chance alone hardly ever brings are
taken off, in each trial its own, before the noise is estimated; which of them are causes is judged
later.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.diagnosis.background import new_places
from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.evidence import FLOOR
from bsip_cli.diagnosis.explanation import Fit, fit_together, with_noise_beside
from bsip_cli.diagnosis.signatures import Signatures

MOST = 3  # candidates in one trial
SURE = 20.0  # -log p of a candidate that is taken off
# While causes are looked for, the noise is taken to have this many times its power in white noise
# besides: else the slow course of a hand that leans on something would pass for noise.
LOOKING = 1.0


def with_likely_noise(signatures: Signatures, before: Fit) -> tuple[Signatures, Fit]:
    """Signatures and fit in the coordinates of the noise beside a fit and the likeliest else."""
    looking, beside = noise_beside_fit(signatures, before, floor=LOOKING)
    return noise_beside_fit(signatures, beside, _likely_changes(looking, beside))


def noise_beside_fit(
    signatures: Signatures,
    fit: Fit,
    more: Sequence[np.ndarray] | None = None,
    floor: float = FLOOR,
) -> tuple[Signatures, Fit]:
    """The same beside a fit, and beside more changes (n, 6), filtered, of each trial."""
    evidence = with_noise_beside(signatures.evidence, fit.explanations, more, floor)
    return signatures.on(evidence), fit_together(evidence, fit.explanations)


def likely_columns(signatures: Signatures, fit: Fit) -> np.ndarray:
    """(R, q) white signatures of what is likely beside a fit, in each trial its own."""
    return _chosen(signatures, fit)[1]


def _likely_changes(signatures: Signatures, before: Fit) -> list[np.ndarray]:
    """(n, 6) of each trial, filtered: what its own likeliest candidates change, and what the known
    causes change as they give way to them."""
    chosen, columns = _chosen(signatures, before)
    evidence = signatures.evidence
    known = np.column_stack([before.tangent, columns])
    sizes = np.linalg.lstsq(known, before.residual, rcond=None)[0]
    changes = [np.zeros_like(one.filtered.residual) for one in evidence.trials]
    for cause in before.explanations:
        step, sizes = np.split(sizes, [len(cause.typical(evidence))])
        for t in cause.place.trials:
            one = evidence.trials[t]
            change = cause.effect.tangent(one.scene, cause.target, cause.values)
            changes[t] += one.filtered.filter.one(change @ (step * cause.typical(evidence)))
    for t, candidate in chosen:
        mine = signatures.filtered[t]
        part = mine.columns[..., mine.parts[candidate]]
        step, sizes = np.split(sizes, [part.shape[2]])
        changes[t] += part @ step
    return changes


def _chosen(signatures: Signatures, before: Fit) -> tuple[list[tuple[int, Candidate]], np.ndarray]:
    """The likely candidates, each in its trial, one after the other; their signatures (R, q)."""
    evidence = signatures.evidence
    columns = np.zeros((len(before.residual), 0))
    chosen: list[tuple[int, Candidate]] = []
    asked = new_places(signatures, before)
    for _ in range(MOST):
        known = np.column_stack([before.tangent, columns])
        new = _likeliest(signatures, asked, before.residual, known)
        if not new:
            break
        for t, candidate in new:
            mine = evidence.white({t: signatures.white(t, candidate)})
            columns = np.column_stack([columns, mine])
        chosen += new
    return chosen, columns


def _likeliest(
    signatures: Signatures, asked: Sequence[int], residual: np.ndarray, known: np.ndarray
) -> list[tuple[int, Candidate]]:
    """The best candidate of each trial, if it is a sure one."""
    scores, _ = signatures.scores(residual[:, None], known)
    best: dict[int, int] = {}
    for k in asked:
        place = signatures.places[k]
        if len(place.trials) == 1 and scores[k, 0] > SURE:
            (t,) = place.trials
            if t not in best or scores[k, 0] > scores[best[t], 0]:
                best[t] = k
    return [(t, signatures.places[k].candidate) for t, k in best.items()]
