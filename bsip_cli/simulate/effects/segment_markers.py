"""Which of a recording's markers sit on a segment, from the shipped marker sets."""

from __future__ import annotations

from collections.abc import Sequence

from bsip_cli.body.markersets import MarkerSet, load_marker_set, shipped_names


def markers_of(where: str, labels: Sequence[str]) -> list[str]:
    """The recording's labels that are meant: themselves joined by "+", or those of a segment.

    Prefixes (``Subject:RASI``) need not be given. For a segment the shipped marker set that
    knows most of the labels decides. Empty if there are none.
    """
    bare = {label.rpartition(":")[2]: label for label in labels} | {x: x for x in labels}
    asked = where.split("+")
    if all(name in bare for name in asked):
        return [bare[name] for name in asked]
    sets = [_found(load_marker_set(name), bare) for name in shipped_names()]
    best = max(sets, key=lambda found: sum(map(len, found.values())))
    return best.get(where, [])


def _found(markers: MarkerSet, bare: dict[str, str]) -> dict[str, list[str]]:
    """By segment, the recording's labels that a marker set knows."""
    found: dict[str, list[str]] = {}
    for marker in markers.markers:
        names = [name for name in (marker.label, *marker.aliases) if name in bare]
        if names:
            found.setdefault(marker.segment, []).append(bare[names[0]])
    return found
