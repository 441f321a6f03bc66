"""What is said of a marker that is not where the model may expect it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.motion.level_change import two_levels
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH, MarkerFit, best_source

# --- markers that sit elsewhere than in the calibration, throughout a trial or from a moment on ---


_OFFSET = 3.0  # trusted distances, and spreads of the marker about its median
_STANDS_OUT = 5.0  # over the median of all markers' median residuals
_LEAST_SHARE = 0.1  # of the frames show the marker
_STAYS_S = 0.5  # at the calibrated place before, and elsewhere after
_IN_PLACE = 0.3  # of the later residual at most, while the marker is in its place


def offsets(fit: MarkerFit, residual: np.ndarray) -> list[MarkerEvent]:
    """Events; residuals (N, m, 3) without jumps and slips.

    The median residual of a marker must exceed ``_OFFSET`` times what it is trusted to and its
    spread, and stand out from the median residuals of the others. Marker after marker is named
    whose displacement explains most of all markers' median residuals. One that was in its place
    first has slipped: where the pose follows a slip, joint angles seem to explain it, and the
    search for slips is blind to it.
    """
    seen = np.isfinite(residual[..., 0])
    enough = seen.sum(axis=0) >= max(3, _LEAST_SHARE * len(residual))
    if not enough.any():
        return []
    mean, spread = np.full(residual.shape[1:], np.nan), np.zeros(residual.shape[1])
    mean[enough] = np.nanmedian(residual[:, enough], axis=0)
    about = np.linalg.norm(residual[:, enough] - mean[enough], axis=2)
    spread[enough] = np.nanmedian(about, axis=0) / MEDIAN_LENGTH
    usual = float(np.median(np.linalg.norm(mean[enough], axis=1)))
    limit = np.maximum(_OFFSET * np.maximum(fit.trusted_m, spread), _STANDS_OUT * usual)
    sd = np.where(enough, np.hypot(max(usual, 1e-4), spread), np.nan)
    # Where two markers make a segment's pose, it takes up most of an offset.
    least = BEYOND * fit.trusted_m
    least = np.minimum(least, np.maximum(0.5 * least, _STANDS_OUT * usual))
    events: list[MarkerEvent] = []
    for _ in range(len(mean)):
        shown = np.linalg.norm(mean, axis=1)
        candidates = [int(m) for m in np.flatnonzero(enough) if shown[m] > least[m]]
        if not candidates:
            break
        m, vector = best_source(fit.response, mean, sd, candidates)
        size = float(np.linalg.norm(vector))
        if size < limit[m]:
            break
        start = _leaves_its_place(residual[:, m], mean[m], round(_STAYS_S / fit.step_s()))
        kind: Kind = "slip" if start else "offset"
        frames = slice(start, len(residual))
        events.append(event(fit, kind, m, frames, size, float(_OFFSET * size / limit[m])))
        mean = mean - np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        mean[m] = 0.0
    return events


def _leaves_its_place(residual: np.ndarray, level: np.ndarray, least: int) -> int:
    """Frame from which a marker's residual (N, 3) is at a level (3,) and not near zero; 0 where
    it never was."""
    along = residual @ level / (level @ level)
    seen = np.flatnonzero(np.isfinite(along))
    if len(seen) < 2 * least:
        return 0
    x = along[seen]
    split = two_levels(x[:, None], least, least)
    in_place = abs(x[:split].mean()) < _IN_PLACE * x[split:].mean()
    return int(seen[split]) if in_place else 0


# --------------------------------------------------------------------------------------------------


Kind = Literal["jump", "slip", "swap", "offset"]

_ORDER: tuple[Kind, ...] = ("swap", "offset", "slip", "jump")
# Nothing is reported that stays within this many times what a marker is trusted to.
BEYOND = 1.5
_BEAR = "bear each other's labels"
_DONE = {True: "corrected", False: "not clear enough to correct, left as recorded"}


@dataclass(frozen=True)
class MarkerEvent:
    """One marker that is not where the model may expect it.

    Attributes
    ----------
    partner : the other marker of a swap, else empty.
    start_s, end_s : a slip lasts until the trial's end, an offset fills the trial.
    size_m : length of the jump, the slip or the offset on the segment; of a swap the distance
        between the two places.
    statistic : residual over the spread it is judged against (jump, offset, a slip found as one),
        unlikeliness as the length of a normal vector (other slips), residual as labelled over
        residual exchanged, or the line between the two over what it lacks of an exact reversal
        (swap).
    put_right : the labels of a swap were exchanged back before the poses were fitted.
    """

    kind: Kind
    marker: str
    partner: str
    start_s: float
    end_s: float
    size_m: float
    statistic: float
    sentence: str
    put_right: bool = False


def event(
    fit: MarkerFit,
    kind: Kind,
    m: int,
    frames: slice,
    size_m: float,
    statistic: float,
    *,
    partner: int | None = None,
    put_right: bool = False,
    note: str = "",
) -> MarkerEvent:
    """An event of marker number ``m`` over a stretch of frames."""
    marker, segment = fit.labels[m], f"the {in_words(fit.segments[m])}"
    other = "" if partner is None else fit.labels[partner]
    start, end = float(fit.times_s[frames.start]), float(fit.times_s[frames.stop - 1])
    whole = frames.start == 0 and frames.stop == len(fit.times_s)
    when = "throughout the trial" if whole else f"from {start:.2f} to {end:.2f} s"
    mm = f"{1000 * size_m:.0f} mm"
    sentence = {
        "jump": f"{marker} jumps {mm} away {when} and comes back",
        "slip": f"{marker} slips {mm} on {segment} at {start:.2f} s and stays there",
        "swap": f"{marker} and {other}, {mm} apart, {_BEAR} {when}; {_DONE[put_right]}",
        "offset": f"{marker} sits {mm} from its calibrated place on {segment} {when}",
    }[kind]
    sentence += note
    return MarkerEvent(kind, marker, other, start, end, size_m, statistic, sentence, put_right)


def summaries(events: Sequence[MarkerEvent], most: int) -> list[str]:
    """Sentences for people: jumps of one marker, and swaps of one time, in one; then how many more.

    Swaps first, then offsets, slips and jumps, the largest first.
    """
    groups: dict[tuple, list[MarkerEvent]] = {}
    for one in events:
        same = (one.start_s, one.end_s, one.put_right)
        key = same if one.kind == "swap" else (one.marker,)
        groups.setdefault((_ORDER.index(one.kind), *key), []).append(one)
    ranked = sorted(groups.items(), key=lambda item: (item[0][0], -max(e.size_m for e in item[1])))
    said = [_of_group(group) for _, group in ranked]
    left = len(said) - most
    return said if left <= 0 else [*said[:most], f"and {left} more, see marker-events"]


def _of_group(group: list[MarkerEvent]) -> str:
    first = group[0]
    if len(group) == 1 or first.kind in ("offset", "slip"):
        return "; ".join(one.sentence for one in group)
    if first.kind == "swap":
        mine, others = (
            ", ".join(getattr(e, name) for e in group) for name in ("marker", "partner")
        )
        return f"{mine} and {others} {_BEAR}{first.sentence.split(_BEAR)[1]}"
    mm = 1000 * max(one.size_m for one in group)
    return (
        f"{first.marker} jumps {len(group)} times, by up to {mm:.0f} mm, "
        f"first at {first.start_s:.2f} s"
    )


def pieces(hit: np.ndarray, joined: np.ndarray, longest_break: int) -> list[slice]:
    """Stretches of hits (N,); ``joined`` frames and short breaks hold two of them together."""
    found: list[slice] = []
    for k in hit.nonzero()[0]:
        stop = found[-1].stop if found else 0
        near = k - stop < longest_break or joined[stop:k].all()
        if found and near:
            found[-1] = slice(found[-1].start, int(k) + 1)
        else:
            found.append(slice(int(k), int(k) + 1))
    return found
