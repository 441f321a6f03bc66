"""Markers that jump, slip, exchange labels or sit wrong, as the residuals of one trial show them.

Everything is measured against three scales: what a marker is trusted to in the inverse kinematics
(skin motion included), the noise of the recording, and the spread of the marker's own residual in
its segment. The limits below are multiples of these.

swap
    Both markers lie at least twice as near to the other's place in the model as to their own, and
    both are far from their own: beyond ``_FAR`` times the trusted distance and the trial's
    typical residual. Pairs on one segment and on mirrored segments are tried, frame by frame.
jump
    A marker leaves the running median of its residual for less than half a window and comes back:
    by more than ``_JUMP`` times its own spread about that median, the noise and the trusted
    distance, within two frames, and the measured position itself shows the step (else it is the
    pose that jumps, bent by another marker).
slip
    The mean residual goes to another level and stays (level_change.py): beyond chance, by more
    than the trusted distance, and by ``_SLIP`` times what the pose does not explain of it. Skin
    that follows the joint angles is explained by them and their squares.
offset
    The median residual of the whole trial is beyond ``_OFFSET`` times the trusted distance and
    the marker's spread, and stands out from the median residuals of all markers.

A marker that slips or sits wrong drags the pose, and its neighbours' residuals with it. The
linear response of the fit tells which marker explains the residuals of all; only that one is
reported, with the size it moved by on its segment and not the smaller residual it leaves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import median_filter

from bsip_cli.motion.level_change import LevelChange, find_level_change
from bsip_cli.motion.marker_fit import MarkerFit

Kind = Literal["jump", "slip", "swap", "offset"]

_FAR = 3.0  # of a swap: own residual over the trusted distance
_NEARER = 0.5  # of a swap: distance to the other's place over that to the own
_BRIDGE_S = 0.1  # frames between two pieces of one swap
_WINDOW_S = 0.5  # of the running median: jumps last at most half of it
_JUMP = 8.0
_BLOCK_S = 0.1  # residuals are averaged over blocks before a slip is looked for
_STAYS_S = 0.5  # on each side of a slip
_SLIP = 3.0
# A chi distribution of three directions passes this once in 7e5 places: 40 markers at 600 places
# give one false alarm in 30 trials, were the errors as the model says.
_CHANCE = 6.0
_OFFSET = 3.0
_STANDS_OUT = 5.0  # over the median of all markers
_USUAL_M = 0.03  # a slip or offset is of this size, before the data speak
_ROUNDS = 12
# Median and mean-square length of a three-dimensional normal vector of unit spread.
_MEDIAN_LENGTH = 1.538


@dataclass(frozen=True)
class MarkerEvent:
    """One marker that is not where the model may expect it.

    Attributes
    ----------
    partner : the other marker of a swap, else empty.
    start_s, end_s : a slip lasts until the trial's end, an offset and a swap may fill it.
    size_m : length of the jump, the slip or the offset on the segment; of a swap the distance
        between the two places.
    statistic : size over the spread it is judged against (jump, offset), gain in likelihood as a
        number of standard deviations (slip), own over exchanged residual (swap).
    """

    kind: Kind
    marker: str
    partner: str
    start_s: float
    end_s: float
    size_m: float
    statistic: float
    sentence: str


def marker_evidence(fit: MarkerFit, noise_m: float) -> tuple[MarkerEvent, ...]:
    """All events of one trial, in the order of time; ``noise_m`` per direction of a marker."""
    swaps, exchanged = _swaps(fit)
    residual = np.where(exchanged[..., None], np.nan, fit.residual_m)
    jumps, astray = _jumps(fit, residual, noise_m)
    residual = np.where(astray[..., None], np.nan, residual)
    slips, level = _slips(fit, residual)
    offsets = _offsets(fit, level)
    events = [*swaps, *jumps, *_returns(slips), *offsets]
    return tuple(sorted(events, key=lambda event: (event.start_s, event.kind, -event.size_m)))


# --- swaps ------------------------------------------------------------------------------------


def _swaps(fit: MarkerFit) -> tuple[list[MarkerEvent], np.ndarray]:
    """Events, and (N, m) frames in which a marker bears another's label."""
    own = np.linalg.norm(fit.measured_m - fit.model_m, axis=2)
    seen = np.isfinite(own)
    far = _FAR * max(float(fit.trusted_m.min()), float(np.median(own[seen])) if seen.any() else 0)
    found = []
    for a, b in _pairs(fit.segments):
        across = np.linalg.norm(fit.measured_m[:, [a, b]] - fit.model_m[:, [b, a]], axis=2)
        with np.errstate(invalid="ignore"):
            hit = (own[:, [a, b]] > far).all(axis=1)
            hit &= (across < _NEARER * own[:, [a, b]]).all(axis=1)
        if hit.any():
            gain = (own[:, [a, b]] - across)[hit].sum()
            found.append((gain, a, b, hit, across))
    taken = np.zeros(own.shape, dtype=bool)
    events = []
    for _, a, b, hit, across in sorted(found, key=lambda one: -one[0]):
        hit = hit & ~taken[:, a] & ~taken[:, b]
        unseen = ~(seen[:, a] & seen[:, b])
        for piece in _pieces(hit, fit.times_s, unseen):
            taken[piece, a] = taken[piece, b] = True
            inside = np.arange(piece.start, piece.stop)[hit[piece]]
            ratio = np.median(own[inside][:, [a, b]] / np.maximum(across[inside], 1e-6))
            apart = float(np.median(np.linalg.norm(fit.model_m[inside, a] - fit.model_m[inside, b], axis=1)))
            events.append(_event(fit, "swap", a, b, piece, apart, float(ratio)))
    return events, taken


def _pairs(segments: tuple[str, ...]) -> Iterator[tuple[int, int]]:
    for a, first in enumerate(segments):
        for b in range(a + 1, len(segments)):
            if segments[b] in (first, _mirrored(first)):
                yield a, b


def _mirrored(segment: str) -> str:
    other = {"_l": "_r", "_r": "_l"}.get(segment[-2:])
    return segment[:-2] + other if other else segment


def _pieces(hit: np.ndarray, times_s: np.ndarray, between: np.ndarray) -> list[slice]:
    """Stretches of hits; frames that tell nothing and short breaks join two of them."""
    frames = np.flatnonzero(hit)
    pieces: list[slice] = []
    for k in frames:
        last = pieces[-1].stop - 1 if pieces else -1
        near = pieces and (times_s[k] - times_s[last] <= _BRIDGE_S or between[last + 1 : k].all())
        if near:
            pieces[-1] = slice(pieces[-1].start, int(k) + 1)
        else:
            pieces.append(slice(int(k), int(k) + 1))
    return pieces


# --- jumps ------------------------------------------------------------------------------------


def _jumps(
    fit: MarkerFit, residual: np.ndarray, noise_m: float
) -> tuple[list[MarkerEvent], np.ndarray]:
    """Events, and (N, m) frames in which a marker is astray."""
    astray = np.zeros(residual.shape[:2], dtype=bool)
    events: list[MarkerEvent] = []
    if len(fit.times_s) < 5:
        return events, astray
    width = 2 * max(2, round(0.5 * _WINDOW_S / _step_s(fit))) + 1
    for m in range(residual.shape[1]):
        seen = np.flatnonzero(np.isfinite(residual[:, m, 0]))
        if len(seen) < 5:
            continue
        own = residual[seen, m]
        away = own - median_filter(own, size=(min(width, len(seen) | 1), 1), mode="nearest")
        distance = np.linalg.norm(away, axis=1)
        spread = max(float(np.median(distance)) / _MEDIAN_LENGTH, noise_m)
        limit = max(_JUMP * spread, float(fit.trusted_m[m]))
        for piece in _pieces(distance > limit, np.arange(len(seen)) * 1.0, np.zeros(len(seen), bool)):
            if piece.stop - piece.start > width // 2 or not _is_own(fit, m, seen, piece, away):
                continue
            size = float(distance[piece].max())
            astray[seen[piece], m] = True
            frames = slice(int(seen[piece.start]), int(seen[piece.stop - 1]) + 1)
            events.append(_event(fit, "jump", m, None, frames, size, size / spread))
    return events, astray


def _is_own(
    fit: MarkerFit, m: int, seen: np.ndarray, piece: slice, away: np.ndarray
) -> bool:
    """The marker comes or goes within two frames, and its measured path shows it.

    The measured path is compared with the straight line through the frames before: a pose that
    another marker bends leaves it smooth.
    """
    path, model = fit.measured_m[seen, m], fit.model_m[seen, m]
    for edge, back in ((piece.start, -1), (piece.stop - 1, 1)):
        before, earlier = edge + back, edge + 2 * back
        if not (0 <= before < len(seen) and 0 <= earlier < len(seen)):
            continue
        inside = [k for k in (edge, edge - back) if piece.start <= k < piece.stop]
        k = max(inside, key=lambda one: np.linalg.norm(away[one]))
        step = (path[k] - model[k]) - (path[before] - model[before])
        length = float(np.linalg.norm(step))
        expected = path[before] + (path[before] - path[earlier]) * abs(k - before)
        shown = float((path[k] - expected) @ step) / max(length, 1e-9)
        if length > 0.5 * np.linalg.norm(away[k]) and shown > 0.5 * length:
            return True
    return False


# --- slips ------------------------------------------------------------------------------------


def _slips(fit: MarkerFit, residual: np.ndarray) -> tuple[list[tuple], np.ndarray]:
    """(marker, frame, vector, z) of every slip, and the residual at the level of the start."""
    blocks = max(1, round(_BLOCK_S / _step_s(fit)))
    least = max(3, round(_STAYS_S / (blocks * _step_s(fit))))
    columns = {name: _block_means(_with_squares(x), blocks) for name, x in fit.pose.items()}
    left, slips = residual.copy(), []
    searched: dict[int, tuple[LevelChange, int] | None] = {}
    for _ in range(_ROUNDS):
        means = _block_means(left, blocks)
        for m in range(len(fit.labels)):
            if m not in searched:
                searched[m] = _change(means[:, m], columns[fit.segments[m]], least)
        worth = {m: c for m, c in searched.items() if c and _is_slip(c[0], fit.trusted_m[m])}
        if not worth:
            break
        first = max(worth, key=lambda m: worth[m][0].z)
        block = worth[first][1]
        field, sd = _field_at(means, columns, fit, least, block)
        m, vector = _culprit(fit, field, sd, list(worth), searched, block, least)
        frame = _refined(left[:, first], worth[first][0].step, block * blocks, 2 * blocks)
        made = np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        # What the linear response misses of a change at this very time is no second slip.
        same = np.linalg.norm(field - made, axis=1) < 0.7 * np.linalg.norm(field, axis=1)
        same[[first, m]] = True
        made = np.where(same[:, None] & np.isfinite(field), field, made)
        left[frame:] -= made
        if np.linalg.norm(vector) > fit.trusted_m[m]:
            z = searched[m][0].z if searched[m] else worth[first][0].z  # type: ignore[index]
            slips.append((_event(fit, "slip", m, None, slice(frame, len(left)), float(np.linalg.norm(vector)), z), vector))
        moved = np.linalg.norm(made, axis=1) > 0.1 * fit.trusted_m
        searched = {k: c for k, c in searched.items() if not moved[k]}
    return slips, left


def _change(y: np.ndarray, columns: np.ndarray, least: int, at: int | None = None):
    """Change of level of the visible blocks, and the block it happens at."""
    seen = np.flatnonzero(np.isfinite(y[:, 0]))
    if at is not None:
        at = int(np.searchsorted(seen, at))
    if len(seen) < 2 * least:
        return None
    found = find_level_change(y[seen], columns[seen], least, at)
    return (found, int(seen[found.at])) if found else None


def _is_slip(change: LevelChange, trusted_m: float) -> bool:
    size = float(np.linalg.norm(change.step))
    return bool(
        change.z > _CHANCE and size > 0.5 * trusted_m and size > _SLIP * change.spread
    )


def _field_at(means, columns, fit: MarkerFit, least: int, block: int):
    """Step of every marker at one time (m, 3), NaN where unknown, and its deviation (m,)."""
    m = len(fit.labels)
    field, sd = np.full((m, 3), np.nan), np.full(m, np.nan)
    for k in range(m):
        change = _change(means[:, k], columns[fit.segments[k]], 1, block)
        if change:
            field[k], sd[k] = change[0].step, change[0].step_sd
    return field, sd


def _culprit(fit, field, sd, worth, searched, block, least) -> tuple[int, np.ndarray]:
    """The marker whose own movement explains the changes of all best, and the movement."""
    known = np.isfinite(sd)
    floor = 0.1 * np.linalg.norm(field[known], axis=1).max()
    candidates = [m for m in worth if abs(searched[m][1] - block) <= least and known[m]]
    return _best_source(fit.response, field, np.hypot(sd, floor), candidates)


def _best_source(
    response: np.ndarray, field: np.ndarray, sd: np.ndarray, candidates: list[int]
) -> tuple[int, np.ndarray]:
    """Which one marker's movement explains a field of residuals (m, 3) best, and the movement."""
    known = np.flatnonzero(np.isfinite(sd) & np.isfinite(field[:, 0]))
    weight = np.repeat(1.0 / sd[known], 3)
    y = weight * field[known].ravel()
    best: tuple[float, int, np.ndarray] | None = None
    for m in candidates:
        A = weight[:, None] * response[known, :, m].reshape(-1, 3)
        vector = np.linalg.solve(A.T @ A + np.eye(3) / _USUAL_M**2, A.T @ y)
        left = float(((y - A @ vector) ** 2).sum() + (vector**2).sum() / _USUAL_M**2)
        if best is None or left < best[0]:
            best = (left, m, vector)
    assert best is not None
    return best[1], best[2]


def _refined(r: np.ndarray, step: np.ndarray, frame: int, around: int) -> int:
    """Frame of an abrupt change near a block's start: the split with the least squares."""
    along = r @ step / (step @ step)
    near = np.arange(max(1, frame - around), min(len(r) - 1, frame + around + 1))
    near = near[np.isfinite(along[near])]
    if len(near) < 3:
        return frame
    x = along[near]
    costs = [np.var(x[:k]) * k + np.var(x[k:]) * (len(x) - k) for k in range(1, len(x))]
    return int(near[1 + int(np.argmin(costs))])


def _returns(slips: list[tuple]) -> list[MarkerEvent]:
    """A slip that a later one undoes is a long jump."""
    events: list[MarkerEvent] = []
    waiting = sorted(slips, key=lambda one: one[0].start_s)
    while waiting:
        event, vector = waiting.pop(0)
        back = next(
            (
                k
                for k, (other, v) in enumerate(waiting)
                if other.marker == event.marker
                and np.linalg.norm(vector + v) < 0.5 * np.linalg.norm(vector)
            ),
            None,
        )
        if back is None:
            events.append(event)
        else:
            end = waiting.pop(back)[0].start_s
            events.append(_worded("jump", event.marker, "", event.start_s, end, event.size_m, event.statistic, "", False))
    return events


# --- offsets ----------------------------------------------------------------------------------


def _offsets(fit: MarkerFit, residual: np.ndarray) -> list[MarkerEvent]:
    seen = np.isfinite(residual[..., 0])
    enough = seen.sum(axis=0) >= max(3, 0.1 * len(residual))
    if not enough.any():
        return []
    mean = np.full(residual.shape[1:], np.nan)
    mean[enough] = np.nanmedian(residual[:, enough], axis=0)
    spread = np.full(len(mean), np.nan)
    spread[enough] = np.nanmedian(
        np.linalg.norm(residual[:, enough] - mean[enough], axis=2), axis=0
    ) / _MEDIAN_LENGTH
    usual = float(np.median(np.linalg.norm(mean[enough], axis=1)))
    limit = np.maximum(
        _OFFSET * np.maximum(fit.trusted_m, np.nan_to_num(spread)), _STANDS_OUT * usual
    )
    events: list[MarkerEvent] = []
    sd = np.hypot(np.where(enough, max(usual, 1e-4), np.nan), np.nan_to_num(spread))
    for _ in range(len(mean)):
        shown = np.linalg.norm(mean, axis=1)
        candidates = [m for m in np.flatnonzero(enough) if shown[m] > fit.trusted_m[m]]
        if not candidates:
            break
        m, vector = _best_source(fit.response, mean, sd, candidates)
        size = float(np.linalg.norm(vector))
        if size < limit[m]:
            break
        events.append(_event(fit, "offset", m, None, slice(0, len(residual)), size, _OFFSET * size / limit[m]))
        mean = mean - np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        mean[m] = 0.0
    return events


# --- small things -----------------------------------------------------------------------------


def _step_s(fit: MarkerFit) -> float:
    return float(np.median(np.diff(fit.times_s))) if len(fit.times_s) > 1 else 1.0


def _with_squares(x: np.ndarray) -> np.ndarray:
    centred = x - np.mean(x, axis=0)
    return np.concatenate([x, centred**2], axis=1)


def _block_means(x: np.ndarray, frames: int) -> np.ndarray:
    """Means of (N, ...) over blocks of frames, NaN where half of a block is missing."""
    count = len(x) // frames
    cut = x[: count * frames].reshape(count, frames, *x.shape[1:])
    seen = np.isfinite(cut)
    number = seen.sum(axis=1)
    total = np.where(seen, cut, 0.0).sum(axis=1)
    return np.where(2 * number >= frames, total / np.maximum(number, 1), np.nan)


def _event(
    fit: MarkerFit, kind: Kind, m: int, partner: int | None, frames: slice, size_m: float, statistic: float
) -> MarkerEvent:
    start, end = float(fit.times_s[frames.start]), float(fit.times_s[frames.stop - 1])
    other = fit.labels[partner] if partner is not None else ""
    whole = frames.start == 0 and frames.stop == len(fit.times_s)
    return _worded(kind, fit.labels[m], other, start, end, size_m, statistic, fit.segments[m], whole)


def _worded(
    kind: Kind, marker: str, partner: str, start_s: float, end_s: float, size_m: float,
    statistic: float, segment: str, whole: bool,
) -> MarkerEvent:
    mm = f"{1000 * size_m:.0f} mm"
    when = "throughout the trial" if whole else f"from {start_s:.2f} to {end_s:.2f} s"
    sentence = {
        "jump": f"{marker} jumps {mm} away {when} and comes back",
        "slip": f"{marker} slips {mm} on {segment} at {start_s:.2f} s and stays there",
        "swap": f"{marker} and {partner}, {mm} apart, bear each other's labels {when}",
        "offset": f"{marker} sits {mm} from its calibrated place on {segment} {when}",
    }[kind]
    return MarkerEvent(kind, marker, partner, start_s, end_s, size_m, statistic, sentence)
