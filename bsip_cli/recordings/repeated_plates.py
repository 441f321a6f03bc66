"""Plates that are copies or sums of others, as treadmills and virtual plates export them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from bsip_cli.recordings.plate_source import PlateSource, lift_N

# Of the force: what makers state for a plate's linearity and cross talk. A copy or a sum is the
# same reading and differs by rounding; the loads of two feet differ by tens of per cent mostly.
_SAME, _MOSTLY = 0.01, 0.9
_BEARS = 0.05
_MOST_TERMS = 4  # of a sum


def repeated_plates(
    trials: Sequence[Mapping[str, PlateSource]],
) -> dict[str, tuple[str, ...]]:
    """Names of plates whose force is that of another, or the sum of others, in every trial.

    Fewer terms are tried first, so that each is needed; of two copies the later one repeats.
    """
    repeated: dict[str, tuple[str, ...]] = {}
    forces = [{name: _force(source) for name, source in trial.items()} for trial in trials]
    names = list(dict.fromkeys(n for trial in trials for n in trial))
    for name in reversed(names):
        others = [n for n in names if n != name and n not in repeated]
        for count in range(1, min(len(others), _MOST_TERMS) + 1):
            for terms in combinations(others, count):
                if count == 1 and names.index(terms[0]) > names.index(name):
                    continue
                if _is_sum(forces, name, terms):
                    repeated[name] = terms
                    break
            if name in repeated:
                break
    return repeated


def _is_sum(trials: Sequence[Mapping[str, np.ndarray]], name: str, terms: Sequence[str]) -> bool:
    """In every trial that has them all."""
    common = [trial for trial in trials if name in trial and all(t in trial for t in terms)]
    if not common:
        return False
    forces = np.stack([np.concatenate([t[n] for t in common]) for n in (name, *terms)])
    forces = forces[:, np.isfinite(forces).all(axis=0)]
    if not forces[0].any():
        return False
    # Plates that bear nothing are alike; a few samples may be damaged on one of them.
    loaded = forces.max(axis=0) > _BEARS * forces.max()
    gap = np.abs(forces[0] - forces[1:].sum(axis=0))[loaded]
    return bool(np.mean(gap < _SAME * forces[0, loaded]) > _MOSTLY)


def _force(source: PlateSource) -> np.ndarray:
    """Size of the vertical force, whichever way the plate lies and its signs are, (n,)."""
    return np.where(source.usable, np.abs(lift_N(source)), np.nan)
