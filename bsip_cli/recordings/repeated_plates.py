"""Plates that are copies or sums of others, as treadmills and virtual plates export them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from bsip_cli.recordings.plate_source import PlateSource, lift_N

_SAME = 0.01  # of the force: two plates never read alike so nearly
_MOST_TERMS = 4  # of a sum


def repeated_plates(
    trials: Sequence[Mapping[str, PlateSource]],
) -> dict[str, tuple[str, ...]]:
    """Names of plates whose force is that of another, or the sum of others, in every trial.

    A sum is known by three plates that are loaded; of two copies the later one repeats.
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
    """In every trial that has them all, at least one of which loads each term."""
    common = [trial for trial in trials if name in trial and all(t in trial for t in terms)]
    if not common:
        return False
    forces = [np.concatenate([trial[n] for trial in common]) for n in (name, *terms)]
    size = np.linalg.norm(forces[0])
    is_loaded = all(np.linalg.norm(force) > _SAME * 5 * size for force in forces[1:])
    gap = np.linalg.norm(forces[0] - np.sum(forces[1:], axis=0))
    return bool(size > 0 and is_loaded and gap < _SAME * size)


def _force(source: PlateSource) -> np.ndarray:
    """Size of the vertical force, whichever way the plate lies and its signs are, (n,)."""
    return np.where(source.usable, np.abs(lift_N(source)), 0.0)
