"""How tall the markers' person is: a unit that is wrong makes a dwarf or a giant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bsip_cli.recordings.label_words import meanings

_FEW = 100  # frames that are looked at
_LEAST, _MOST = 0.65, 1.5  # of the stated height: people sit, and markers sit on hats
PEOPLE_M = (0.6, 2.4)  # from one year on
# The highest marker's distance from the feet over the stature, by the part that it sits on.
_PARTS = {"head": 0.95, "upper_torso": 0.82, "lower_torso": 0.56}
_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "dm": 0.1, "ft": 0.3048, "m": 1.0}


def by_segment(labels: Sequence[str], markers: np.ndarray) -> dict[str, np.ndarray]:
    """The markers (n_frames, n_markers, 3) of each segment, by what their labels mean."""
    known = meanings(labels)
    columns: dict[str, list[int]] = {}
    for k, label in enumerate(labels):
        if label in known:
            columns.setdefault(known[label].segment, []).append(k)
    return {segment: markers[:, some] for segment, some in columns.items()}


def height_m(markers_m: Mapping[str, np.ndarray]) -> float | None:
    """From a trial's markers (n_frames, k, 3) per segment: the longest way from the feet to the
    highest part that is seen, nearly always; None without feet or trunk."""
    feet = [markers_m[name] for name in ("foot_l", "foot_r") if name in markers_m]
    part = next((name for name in _PARTS if name in markers_m), None)
    if not feet or part is None:
        return None
    low = np.concatenate(feet, axis=1)
    step = max(1, len(low) // _FEW)
    gaps = markers_m[part][::step, :, None] - low[::step, None]
    distance = np.linalg.norm(gaps, axis=-1).reshape(len(gaps), -1)
    seen = distance[np.isfinite(distance).any(axis=1)]
    if not len(seen):
        return None
    return float(np.percentile(np.nanmax(seen, axis=1), 90)) / _PARTS[part]


def no_person(height_m: float, stated_m: float | None) -> tuple[str, str, str] | None:
    """What was found, what was expected, what to do; None where it may be a person."""
    low, high = PEOPLE_M if stated_m is None else (_LEAST * stated_m, _MOST * stated_m)
    if low <= height_m <= high:
        return None
    expected = "0.6 to 2.4 m" if stated_m is None else f"the stated {stated_m:.2f} m"
    wanted = (stated_m or 1.7) / height_m
    pairs = {
        f"{one} for {other}": abs(np.log(_UNITS_M[one] / _UNITS_M[other] / wanted))
        for one in _UNITS_M
        for other in _UNITS_M
        if one != other
    }
    near = min(pairs, key=pairs.__getitem__)
    cause = "correct the unit of length in the recordings, or the height in participants.tsv"
    if pairs[near] < np.log(1.2):
        cause += f" (it looks like {near})"
    return f"markers of a person {height_m:.2f} m tall", expected, cause
