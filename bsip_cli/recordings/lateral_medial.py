"""Two markers of a joint under one label, as cut labels are: which is the lateral one?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from bsip_cli.body.markersets import Marker, MarkerSet
from bsip_cli.body.names import TRUNK
from bsip_cli.recordings.labels import count_of, person_of, spelling_of
from bsip_cli.recordings.model import Finding

_MOSTLY = 0.8  # of the frames in which both are seen


def with_pairs_named(
    labels: Sequence[str], markers_m: np.ndarray, marker_set: MarkerSet, prefix: str = ""
) -> tuple[tuple[str, ...], list[Finding]]:
    """Labels in which the lateral and the medial marker of a joint have names of their own, where
    two columns share the one that both are spelt as: the lateral one is further out, as left and
    right of the trunk are. ``markers_m`` (n_frames, n_markers, 3), NaN = missing."""
    there = np.isfinite(markers_m).all(axis=2).any(axis=0).tolist()
    names = person_of(labels, count_of(marker_set.wanted()), prefix, there).names
    names = {column: name for column, name in names.items() if there[column]}
    spelling = spelling_of(list(names.values()))
    meant = {
        name: [m for m in marker_set.markers if spelling(name) in map(spelling, _spelt(m))]
        for name in names.values()
    }
    to_right = _to_right(markers_m, {c: meant[one] for c, one in names.items()})
    named = list(labels)
    outer_ones: dict[str, str] = {}
    inner_ones: list[str] = []
    for name, count in Counter(names.values()).items():
        pair = _pair(meant[name])
        if pair is None or count != 2:
            continue
        lateral, medial = pair
        two = [column for column, one in names.items() if one == name]
        out = to_right if lateral.segment.endswith("_r") else -to_right
        outer = _outer(markers_m[:, two], out)
        if outer is None:
            continue
        for column, marker in zip((two[outer], two[1 - outer]), pair, strict=True):
            named[column] = labels[column].replace(name, marker.label)
        outer_ones[name] = lateral.label
        inner_ones.append(medial.label)
    if not outer_ones:
        return tuple(labels), []
    found, expected = "a label that two columns share", "one column per marker"
    action = f"took the outer ones for {', '.join(outer_ones.values())}, the inner ones for "
    action += ", ".join(inner_ones)
    subject = ", ".join(outer_ones)
    return tuple(named), [Finding("labels", subject, found, expected, action, "corrected")]


def _spelt(marker: Marker) -> tuple[str, ...]:
    return (marker.label, *marker.aliases)


def _pair(markers: Sequence[Marker]) -> tuple[Marker, Marker] | None:
    """The lateral and the medial marker of one joint, if these are all."""
    by_landmark = {marker.landmark: marker for marker in markers}
    lateral = next((m for m in markers if "_lateral_" in m.landmark), None)
    if lateral is None or len(markers) != 2:
        return None
    medial = by_landmark.get(lateral.landmark.replace("_lateral_", "_medial_"))
    return None if medial is None else (lateral, medial)


def _to_right(markers_m: np.ndarray, meant: Mapping[int, Sequence[Marker]]) -> np.ndarray:
    """From left to right of the trunk, (n_frames, 3); NaN where that is not seen."""
    ends = []
    for side in ("_r", "_l"):
        columns = [
            column
            for column, markers in meant.items()
            if len(markers) == 1
            and markers[0].segment in TRUNK
            and markers[0].landmark.endswith(side)
        ]
        if not columns:
            return np.full((len(markers_m), 3), np.nan)
        ends.append(markers_m[:, columns].mean(axis=1))
    return np.asarray(ends[0] - ends[1])


def _outer(two: np.ndarray, out: np.ndarray) -> int | None:
    """Which of two markers (n_frames, 2, 3) is further in a direction (n_frames, 3); None if that
    is not nearly always the same one."""
    ahead = ((two[:, 0] - two[:, 1]) * out).sum(axis=1)
    ahead = ahead[np.isfinite(ahead)]
    if not len(ahead):
        return None
    first = float(np.mean(ahead > 0))
    return 0 if first >= _MOSTLY else 1 if first <= 1 - _MOSTLY else None
