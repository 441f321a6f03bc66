"""How large a score chance brings: the residual with the signs of whole stretches turned.

Real residuals are not quite white, so no chi-square says what is rare. A stretch whose signs are
turned keeps its size and its course, but no longer goes along with the stretches beside it, and so
with no cause that lasts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import gumbel_r

from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence

FLIPS = 199
_LEAST_SPREAD = 1.3  # of the logarithm of a p-value: what white noise has


def flipped(evidence: Evidence, residual: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(R, FLIPS) of a residual (R,)."""
    blocks = evidence.blocks()
    signs = rng.choice([-1.0, 1.0], size=(blocks.max() + 1, FLIPS))
    return residual[:, None] * signs[blocks]


@dataclass(frozen=True)
class Chance:
    """Of the largest score by chance: a Gumbel distribution per group of places.

    Every trial, and the trials together, are a group with a chance of its own, so that what is
    still unexplained in one trial does not hide what another shows.
    """

    location: dict[tuple[int, ...], float]
    scale: dict[tuple[int, ...], float]

    def p_value(self, score: float, trials: tuple[int, ...]) -> float:
        """Family-wise: chance brings as much somewhere."""
        group = group_of(trials)
        own = gumbel_r.sf(score, self.location[group], self.scale[group])
        return float(min(1.0, own * len(self.location)))

    def limit(self, trials: tuple[int, ...], alpha: float) -> float:
        """The score whose p-value is alpha."""
        group = group_of(trials)
        part = alpha / len(self.location)
        return float(gumbel_r.isf(part, self.location[group], self.scale[group]))


def chance_of(scores: np.ndarray, places: Sequence[Place]) -> Chance:
    """From the scores (K, FLIPS) of flipped residuals."""
    groups = [group_of(place.trials) for place in places]
    location, scale = {}, {}
    for group in dict.fromkeys(groups):
        mine = np.array([one == group for one in groups])
        largest = scores[mine].max(axis=0)
        scale[group] = max(float(largest.std()), _LEAST_SPREAD) * np.sqrt(6) / np.pi
        location[group] = float(largest.mean()) - np.euler_gamma * scale[group]
    return Chance(location, scale)


def group_of(trials: tuple[int, ...]) -> tuple[int, ...]:
    """A trial alone, or () for the trials together."""
    return trials if len(trials) == 1 else ()
