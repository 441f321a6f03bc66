"""Are all trials of a session one person's? By how far markers of one segment lie apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.scene import by_segment

Sizes = Mapping[str, Mapping[str, float]]
"""Per segment the distances [m] of its markers, by their labels."""

# Medians over the segments of 51 pairs of trials of 13 people in seven public laboratories differ
# by at most 1.2 %, sitting and standing too; those of two people of btk_pig by 12 to 16 %.
_SAME_PERCENT = 4.0
_FEWEST_SEGMENTS = 4  # those of a leg and the pelvis
_SHORTEST_M = 0.05  # skin moves by centimetres
_FEW = 100  # frames


def sizes_of(labels: Sequence[str], markers_m: np.ndarray) -> Sizes:
    """Medians over a trial's markers (n_frames, n_markers, 3)."""
    some = markers_m[:: max(1, len(markers_m) // _FEW)]
    known = meanings(labels)
    found: dict[str, dict[str, float]] = {}
    for segment, places in by_segment(labels, some).items():
        names = [label for label in labels if label in known and known[label].segment == segment]
        for j, k in combinations(range(len(names)), 2):
            ways = np.linalg.norm(places[:, j] - places[:, k], axis=-1)
            ways = ways[np.isfinite(ways)]
            if len(ways) and (way := float(np.median(ways))) > _SHORTEST_M:
                found.setdefault(segment, {})[f"{names[j]} to {names[k]}"] = way
    return found


def odd_ones(names: Sequence[str], are_apart: Callable[[str, str], bool]) -> tuple[str, list[str]]:
    """The first of those that most are like, and which are not like it."""
    alike = {one: [two for two in names if not are_apart(one, two)] for one in names}
    usual = max(names, key=lambda one: len(alike[one]))
    return usual, [name for name in names if name not in alike[usual]]


def other_bodies(trials: Mapping[str, Sizes]) -> str:
    """Which trials show other lengths than the others, for sure; empty if none."""
    if len(trials) < 2:
        return ""
    usual, odd = odd_ones([*trials], lambda one, two: bool(_unlike(trials[one], trials[two])))
    told = [f"in {name} {words}" for name in odd if (words := _unlike(trials[name], trials[usual]))]
    if not told:
        return ""
    return (
        f"its trials are not of one body: {' and '.join(told)} as in {usual}; one person's are the "
        f"same to {_SAME_PERCENT:g} %: what follows mixes both; remove the trials of another "
        "person, or correct their unit of length"
    )


def _unlike(one: Sizes, other: Sizes) -> str:
    """How many per cent larger or smaller one body is, with an example; empty if it may be the
    same."""
    ratios = {
        segment: {pair: way / other[segment][pair] for pair, way in ways.items() if pair in common}
        for segment, ways in one.items()
        if (common := ways.keys() & other.get(segment, {}).keys())
    }
    if len(ratios) < _FEWEST_SEGMENTS:
        return ""
    times = float(np.median([np.median([*some.values()]) for some in ratios.values()]))
    if abs(np.log(times)) <= np.log1p(_SAME_PERCENT / 100):
        return ""
    every = [
        (abs(x - times), segment, pair) for segment in ratios for pair, x in ratios[segment].items()
    ]
    _, segment, pair = min(every)
    return (
        f"markers of one segment lie {100 * times:.0f} % as far apart "
        f"({pair} {1e3 * one[segment][pair]:.0f} mm, not {1e3 * other[segment][pair]:.0f} mm)"
    )
