"""How large a score chance brings: the residual with the signs of whole stretches turned.

Real residuals are not quite white, so no chi-square says what is rare. A stretch whose signs are
turned keeps its size and its course, but no longer goes along with the stretches beside it, and so
with no cause that lasts.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.together import Evidence

FLIPS = 199
BLOCK_S = 1.0


def flipped(evidence: Evidence, residual: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(R, FLIPS) of a residual (R,)."""
    blocks = evidence.blocks(BLOCK_S)
    signs = rng.choice([-1.0, 1.0], size=(blocks.max() + 1, FLIPS))
    return residual[:, None] * signs[blocks]


def p_value(evidence: float, by_chance: np.ndarray) -> float:
    """Family-wise, of a score beside the largest scores (FLIPS,) that chance brings."""
    return float((1 + (by_chance >= evidence).sum()) / (1 + len(by_chance)))
