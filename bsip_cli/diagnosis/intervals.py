"""How well the numbers of an explanation are known."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.explanation import Explanation, Fit
from bsip_cli.diagnosis.fair_sizes import known_to
from bsip_cli.diagnosis.together import Evidence

DRAWS = 200
DIFFERENCE = 1e-3  # of the typical size
SCALE_ERROR = 0.03  # of every size: the simulated motion is neither free of noise nor unsmoothed


def drawn_explanations(
    evidence: Evidence, fit: Fit, number: int, rng: np.random.Generator
) -> list[Explanation]:
    """The explanation as it might as well be: DRAWS of all parameters of all explanations.

    Stretches of time are drawn with replacement and everything is fitted anew by one linear step,
    beside the same noise. The spread is never less than what the nuisances leave open, which is the
    same in every stretch, together with what no recording betters.
    """
    tangent, mine = _tangent(evidence, fit), _columns(fit, number)
    steps = _bootstrap(evidence, fit.residual, tangent, rng)[:, mine]
    one = fit.explanations[number]
    least = np.diag(_covariance(tangent))[mine] + _beyond_recordings(evidence, one)
    steps = _at_least(steps - np.median(steps, axis=0), least, rng)
    drawn = (one.all_moved(evidence, step).alike(evidence) for step in steps)
    return [alike[rng.integers(len(alike))] for alike in drawn]


def has_size(evidence: Evidence, fit: Fit, number: int, rng: np.random.Generator) -> bool:
    """Whether it is sure that not all sizes of an explanation are zero (Wald, 5 %); moments,
    frequencies and windows, which are no sizes, are held."""
    one, mine = fit.explanations[number], fit.columns(number, evidence)
    steps = _bootstrap(evidence, fit.residual, fit.tangent, rng)[:, mine]
    spread = np.cov(steps, rowvar=False, ddof=0).reshape(steps.shape[1], -1)
    free = one.is_free(evidence)
    least = np.diag(_covariance(fit.tangent))[mine] + _beyond_recordings(evidence, one)[free]
    spread += np.diag(np.maximum(least - np.diag(spread), 0.0))
    sizes = one.values[free] / one.typical(evidence)
    return bool(sizes @ np.linalg.solve(spread, sizes) > chi2.ppf(0.95, len(sizes)))


def _beyond_recordings(evidence: Evidence, one: Explanation) -> np.ndarray:
    """(K,) variance of all parameters that no recording betters [typical]."""
    scale = SCALE_ERROR * one.values * one.is_free(evidence)
    simple = np.array([p.known_to for p in one.parameters(evidence)])
    weighed = known_to(evidence, one.place)
    return (scale**2 + simple**2 + weighed**2) / one.all_typical(evidence) ** 2


def bounds(evidence: Evidence, fit: Fit, number: int) -> dict[str, float]:
    """Standard deviation that no unbiased estimate betters, of all that an explanation reports.

    The bound of Cramér and Rao in these recordings, their noise taken as known.
    """
    mine = _columns(fit, number)
    covariance = _covariance(_tangent(evidence, fit))[mine, mine]
    one = fit.explanations[number]
    slope = np.stack(
        [_reported(evidence, one, step) for step in DIFFERENCE * np.eye(len(one.values))], axis=1
    )
    spread = np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
    names = [name for name, *_ in one.reported(evidence)]
    return dict(zip(names, spread.tolist(), strict=True))


def _reported(evidence: Evidence, one: Explanation, step: np.ndarray) -> np.ndarray:
    """(r,) derivative of the reported numbers along a small step of all parameters [typical]."""
    ahead, behind = (
        np.array([x for *_, x in one.all_moved(evidence, sign * step).reported(evidence)])
        for sign in (1, -1)
    )
    return (ahead - behind) / (2 * np.abs(step).sum())


def _tangent(evidence: Evidence, fit: Fit) -> np.ndarray:
    """(R, K) of all parameters of all explanations."""
    return np.concatenate([one.full_tangent(evidence) for one in fit.explanations], axis=1)


def _columns(fit: Fit, number: int) -> slice:
    """Which of them are an explanation's."""
    ends = np.cumsum([0, *(len(one.values) for one in fit.explanations)])
    return slice(int(ends[number]), int(ends[number + 1]))


def _covariance(tangent: np.ndarray) -> np.ndarray:
    """(K, K) of all parameters [typical]; what the data do not decide, a moment in a gap for
    instance, is known to its typical size."""
    return np.linalg.inv(tangent.T @ tangent + np.eye(tangent.shape[1]))


def _bootstrap(
    evidence: Evidence, residual: np.ndarray, tangent: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """(DRAWS, K) steps of all parameters [typical]."""
    blocks = evidence.blocks()
    numbers = np.unique(blocks)
    grams = np.stack([tangent[blocks == b].T @ tangent[blocks == b] for b in numbers])
    rights = np.stack([tangent[blocks == b].T @ residual[blocks == b] for b in numbers])
    ridge = 1e-6 * np.diag(np.diag(grams.sum(axis=0)) + 1e-12)
    steps = []
    for _ in range(DRAWS):
        times = np.bincount(rng.integers(len(numbers), size=len(numbers)), minlength=len(numbers))
        gram = np.einsum("b,bij->ij", times, grams) + ridge
        steps.append(np.linalg.solve(gram, times @ rights))
    return np.array(steps)


def _at_least(steps: np.ndarray, variance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Steps (DRAWS, k) whose spread is no smaller than that of a variance (k,)."""
    missing = np.maximum(variance - steps.var(axis=0), 0.0)
    return steps + np.sqrt(missing) * rng.standard_normal(steps.shape)
