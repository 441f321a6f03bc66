"""Are left and right on their sides? A mirrored laboratory makes a person that cannot be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.label_words import meanings

_FEW = 50  # frames that are looked at
_CLEAR = 0.6  # sine of the angle from ahead to the right: 1 in a person who stands square

# What is in front and behind, and what has a left and a right one, by landmarks without sides.
_PARTS = {
    "pelvis": (("asis",), ("psis", "sacrum"), ("asis", "psis")),
    "trunk": (("suprasternale", "xiphoid"), ("c7", "t10"), ("acromion",)),
    "head": (("forehead", "temple"), ("occiput",), ("forehead", "temple", "occiput")),
    "feet": (
        ("metatarsal_1", "metatarsal_2", "metatarsal_5"),
        ("calcaneus",),
        ("calcaneus", "metatarsal_1", "metatarsal_2", "metatarsal_5"),
    ),
}


@dataclass(frozen=True)
class Handedness:
    """Sine of the angle from ahead to the right, from above, by part of the body; -1: mirrored."""

    parts: Mapping[str, float]

    @property
    def is_mirrored(self) -> bool:
        """Every part that is clear, and at least two, has left and right exchanged."""
        clear = self._clear()
        return len(clear) >= 2 and all(value < 0 for value in clear.values())

    def exchanged(self) -> list[str]:
        """Parts with left and right exchanged, where not all have."""
        wrong = [name for name, value in self._clear().items() if value < 0]
        return [] if self.is_mirrored else wrong

    def _clear(self) -> dict[str, float]:
        """Without those that do not stand square: feet one before the other."""
        return {name: value for name, value in self.parts.items() if abs(value) > _CLEAR}

    @classmethod
    def of_all(cls, trials: Sequence[Handedness]) -> Handedness:
        """Median over the trials."""
        names = dict.fromkeys(name for trial in trials for name in trial.parts)
        return cls(
            {n: float(np.median([t.parts[n] for t in trials if n in t.parts])) for n in names}
        )


def handedness(labels: Sequence[str], markers_m: np.ndarray) -> Handedness:
    """Of a trial's markers (n_frames, n_markers, 3), world frame, by what their labels mean."""
    meant = meanings(labels)
    known = {meant[n].landmark: k for k, n in enumerate(labels) if n in meant}
    frames = markers_m[:: max(1, len(markers_m) // _FEW)]

    def mean(names: Sequence[str]) -> np.ndarray | None:
        there = [known[name] for name in names if name in known]
        return frames[:, there, :2].mean(axis=1) if there else None

    found = {}
    for part, (front, back, sides) in _PARTS.items():
        ahead = _difference(mean(_both(front)), mean(_both(back)))
        both = [n for n in sides if f"{n}_l" in known and f"{n}_r" in known]
        right = _difference(mean([f"{n}_r" for n in both]), mean([f"{n}_l" for n in both]))
        if ahead is None or right is None:
            continue
        sine = ahead[:, 1] * right[:, 0] - ahead[:, 0] * right[:, 1]
        sine = sine / (np.linalg.norm(ahead, axis=1) * np.linalg.norm(right, axis=1))
        if np.isfinite(sine).any():
            found[part] = float(np.nanmedian(sine))
    return Handedness(found)


def _both(names: Sequence[str]) -> list[str]:
    return [name + side for name in names for side in ("", "_l", "_r")]


def _difference(one: np.ndarray | None, other: np.ndarray | None) -> np.ndarray | None:
    return None if one is None or other is None else one - other
