"""Where all bodies are over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.rotations import rotate


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies in one world frame.

    rotation : (T, 3, 3) by body. origin_m : (T, 3) by body.
    excess_reach_m : (T,) how far the feet were out of the legs' reach (0 = reachable).
    """

    rotation: dict[str, np.ndarray]
    origin_m: dict[str, np.ndarray]
    excess_reach_m: np.ndarray

    def point(self, body: str, position_m: np.ndarray) -> np.ndarray:
        """(T, 3) world path of a point (3,) of a body."""
        return self.origin_m[body] + rotate(self.rotation[body], position_m)

    def part(self, samples: slice) -> Poses:
        """The same poses at some of the samples."""
        return Poses(
            {name: R[samples] for name, R in self.rotation.items()},
            {name: p[samples] for name, p in self.origin_m.items()},
            self.excess_reach_m[samples],
        )
