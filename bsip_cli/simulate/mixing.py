"""Faster and safer fixed-point iterations (Anderson mixing).

Walker and Ni, Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 2011.
"""

from __future__ import annotations

import numpy as np

DEPTH = 6


class Mixer:
    """Remembers the last steps of an iteration x -> x + step(x) and proposes better ones."""

    def __init__(self) -> None:
        self._points: list[np.ndarray] = []
        self._steps: list[np.ndarray] = []

    def step(self, point: np.ndarray, plain: np.ndarray) -> np.ndarray:
        """The step to take from a point (N,) where the plain iteration would take `plain` (N,).

        Of the remembered points that combination is left whose plain step would be smallest.
        """
        self._points = [*self._points[-DEPTH:], point]
        self._steps = [*self._steps[-DEPTH:], plain]
        if len(self._steps) == 1:
            return plain
        moved = np.diff(np.stack(self._points), axis=0)
        changed = np.diff(np.stack(self._steps), axis=0)
        share, *_ = np.linalg.lstsq(changed.T, plain, rcond=1e-10)
        return plain - share @ (moved + changed)
