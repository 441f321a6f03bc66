"""What is said of a marker that is not where the model may expect it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import chdtri, fdtrc

from bsip_cli.motion.marker_fit import BEYOND, MEDIAN_LENGTH, MarkerFit, Uncertain
from bsip_cli.segments import in_words

# --- one change of level in an autocorrelated signal that also follows known columns --------------


_ROUNDS = 4
_LARGEST_CORRELATION = 0.98
_LEAST_FREEDOM = 8
_LEAST_ERROR = 1e-6  # keeps columns that stand still from making the equations singular


@dataclass(frozen=True, eq=False)
class LevelChange:
    """The most likely change of level of a signal.

    at : index of the first sample at the new level.
    step : (d,) new level less old one, in the signal's unit.
    step_sd : standard deviation of the step, each direction.
    spread : standard deviation of what neither columns nor step explain, each direction.
    z : how unlikely the gain in likelihood is by chance at one place: the length of a normal
        vector of d directions that is as unlikely (so it counts the samples, as F does).
    """

    at: int
    step: np.ndarray
    step_sd: float
    spread: float
    z: float


class _Steps:
    """A signal y (n, d), columns (n, k) that it follows, and a step at one of the places (p,).

    Whitened by a correlation r, the sample at t of z = [1, columns, y] is z[t] - r z[t - 1], the
    first one sqrt(1 - r^2) z[0]; so every product of whitened signals follows from a few sums, and
    no correlation that is tried needs the samples again.
    """

    def __init__(
        self, y: np.ndarray, columns: np.ndarray, places: np.ndarray, coefficient_sd: float
    ) -> None:
        z = np.concatenate([np.ones((len(y), 1)), columns, y], axis=1)
        z[:, 1:] -= z[:, 1:].mean(axis=0)
        self.z, self.of_x, self.places = z, 1 + columns.shape[1], places
        follow = z[1:].T @ z[:-1]
        # of z[t] z[t]', of z[t] z[t - 1]' with its transpose, and of the first and the last sample
        self.squares, self.neighbours = z.T @ z, follow + follow.T
        self.ends = np.outer(z[0], z[0]) + np.outer(z[-1], z[-1])
        from_on = np.zeros((len(z) + 1, z.shape[1]))
        from_on[:-1] = np.cumsum(z[::-1], axis=0)[::-1]
        # (p, 1 + k + d) of the samples from a place on, and from the ones before and after it on
        self.after, self.around = from_on[places], from_on[places - 1] + from_on[places + 1]
        self.coefficient_sd = coefficient_sd

    def prior(self, error: float) -> np.ndarray:
        """(1 + k, 1 + k) what the prior of the columns adds to the equations."""
        free = [0.0] + [1.0] * (self.of_x - 1)  # the constant has none
        return np.diag(free) * (error / self.coefficient_sd) ** 2

    def best(self, correlation: float, error: float) -> LevelChange | None:
        """The step that gains most; None where the columns could make each as well."""
        n, x, r = len(self.z), self.of_x, correlation
        d = self.z.shape[1] - x
        # Whitened: the sum of z z', and (p, 1 + k + d) products of z with a step at each place.
        products = (1.0 + r * r) * self.squares - r * self.neighbours - r * r * self.ends
        steps = (1.0 + r * r) * self.after - r * self.around + r * (1.0 - r) * self.z[-1]
        inverse = np.linalg.inv(products[:x, :x] + self.prior(error))
        coefficients = inverse @ products[:x, x:]
        # What the columns leave of the signal and of the steps: the gain of each step follows.
        rest = steps[:, x:] - steps[:, :x] @ coefficients
        length = 1.0 + (1.0 - correlation) ** 2 * (n - 1 - self.places)
        own = length - ((steps[:, :x] @ inverse) * steps[:, :x]).sum(axis=1)
        freedom = n - 1 - float((inverse * products[:x, :x]).sum())
        possible = own > 1e-3 * length
        if not possible.any() or freedom < _LEAST_FREEDOM:
            return None
        gain = np.where(possible, (rest**2).sum(axis=1) / np.where(possible, own, 1.0), -1.0)
        k = int(np.argmax(gain))
        # What the prior holds back of the columns counts among the errors.
        squares = float(np.trace(products[x:, x:]) - (coefficients * products[:x, x:]).sum())
        variance = max((squares - gain[k]) / (d * freedom), 1e-18)
        z2 = chdtri(d, max(fdtrc(d, d * freedom, gain[k] / variance / d), 1e-300))
        return LevelChange(
            at=int(self.places[k]),
            step=rest[k] / own[k],
            step_sd=float(np.sqrt(variance / own[k])),
            spread=float(np.sqrt(variance / (1.0 - correlation**2))),
            z=float(np.sqrt(z2)),
        )


def two_levels(y: np.ndarray, before: int, after: int) -> int:
    """Number of first samples of y (n, d) that differ most from the others, by least squares.

    before, after : samples at least on either side; n must be as many.
    """
    n = len(y)
    sizes = np.arange(before, n - after + 1)
    first = np.cumsum(y, axis=0)[sizes - 1]
    rest = y.sum(axis=0) - first
    between = (first**2 / sizes[:, None] + rest**2 / (n - sizes)[:, None]).sum(axis=1)
    return int(sizes[np.argmax(between)])


def find_level_change(
    y: np.ndarray, columns: np.ndarray, coefficient_sd: float, least: int, at: int | None = None
) -> LevelChange | None:
    """Generalised least squares of y (n, d) on a constant, columns (n, k) and one step.

    The error is autoregressive of order one; its correlation is estimated with the step in the
    model, or a step would look like correlation. A step that the columns could make as well gets
    a large standard deviation and no significance.

    coefficient_sd : prior spread of the columns' coefficients: columns that show a small step of
        their own cannot explain a large one of the signal.
    least : samples at least on each side of the step.
    at : where the step is, or None to look for the place with the largest gain.

    Returns None where there are too few samples, or no place for a step.
    """
    n = len(y)
    places = np.arange(least, n - least + 1) if at is None else np.array([at])
    places = places[(places > 0) & (places < n)]
    if len(places) == 0 or n < _LEAST_FREEDOM + 2:
        return None
    steps, correlation = _Steps(y, columns, places, coefficient_sd), 0.0
    x = steps.of_x
    X, square = steps.z[:, :x], steps.squares[:x, :x]
    error = max(float(np.median(np.abs(np.diff(y, axis=0)))), _LEAST_ERROR)
    for _ in range(_ROUNDS):
        found = steps.best(correlation, error)
        if found is None:
            return None
        # of neighbours among what columns and step leave, fitted as if there were none
        stepped = steps.z[:, x:].copy()
        stepped[found.at :] -= found.step
        left = stepped - X @ np.linalg.solve(square + steps.prior(error), X.T @ stepped)
        power = float((left[:-1] ** 2).sum())
        value = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
        correlation = float(np.clip(value, 0.0, _LARGEST_CORRELATION))
        error = max(found.spread * np.sqrt(1.0 - correlation**2), _LEAST_ERROR)
    return steps.best(correlation, error)


# --- markers that are misplaced since the calibration, throughout a trial or from a moment on -----


_OFFSET = 3.0  # trusted distances, and spreads of the marker about its median
_STANDS_OUT = 5.0  # over the median of all markers' median residuals
_LEAST_SHARE = 0.1  # of the frames show the marker
_OFTEN = 0.5  # seen in fewer frames, it is said
_STAYS_S = 0.5  # at the calibrated place before, and at another after
_IN_PLACE = 0.3  # of the later residual at most, while the marker is in its place


def offsets(fit: MarkerFit, residual: np.ndarray) -> list[MarkerEvent]:
    """Events; residuals (N, m, 3) without jumps and slips.

    The median residual of a marker must exceed ``_OFFSET`` times what it is trusted to, its spread
    and how far it strays in all trials, and stand out from the median residuals of the others.
    Marker after marker is named whose displacement explains most of all markers' median residuals,
    but for one whose distances to its neighbours stay. One that was in its place first has slipped:
    where the pose follows a slip, joint angles seem to explain it, and the search for slips is
    blind to it.
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
    own = np.maximum(np.maximum(fit.trusted_m, fit.strays_m), spread)
    limit = np.maximum(_OFFSET * own, _STANDS_OUT * usual)
    sd = np.where(enough, np.hypot(max(usual, 1e-4), spread), np.nan)
    # Where two markers make a segment's pose, it takes up most of an offset.
    least = BEYOND * fit.trusted_m
    least = np.minimum(least, np.maximum(0.5 * least, _STANDS_OUT * usual))
    events, elsewhere = list[MarkerEvent](), set[int]()
    for _ in range(len(mean)):
        large = np.flatnonzero(enough & (np.linalg.norm(mean, axis=1) > least)).tolist()
        candidates = [m for m in large if m not in elsewhere]
        if not candidates:
            break
        m, vector, made = fit.source_of(mean, sd, candidates)
        size = float(np.linalg.norm(vector))
        if size < limit[m]:
            break
        longer = _longer_m(fit, m)
        stays = max((abs(x) for x, _ in longer.values()), default=0.0) < BEYOND * fit.trusted_m[m]
        if stays and not fit.is_shown(m, vector, longer):
            elsewhere.add(m)
            continue
        start = _leaves_its_place(residual[:, m], mean[m], round(_STAYS_S / fit.step_s()))
        kind: Kind = "slip" if start else "offset"
        frames, surely = slice(start, len(residual)), float(_OFFSET * size / limit[m])
        note = _remarks(fit, m, size, float(seen[start:, m].mean()))
        events.append(event(fit, kind, m, frames, size, surely, note=note))
        mean = mean - made
        mean[m] = 0.0
    return events


def _longer_m(fit: MarkerFit, m: int) -> dict[int, Uncertain]:
    """By how much the distance to each neighbour is longer than where both were calibrated."""
    places, found = fit.person.marker_positions_m, {}
    for other in fit.neighbours(m):
        if np.isfinite(apart := fit.apart_m(m, other)).any():
            calibrated = np.linalg.norm(places[m] - places[other])
            found[other] = float(np.nanmedian(apart) - calibrated), float(fit.trusted_m[m])
    return found


def _remarks(fit: MarkerFit, m: int, size_m: float, share: float) -> str:
    """Where a marker is seen in a part of the frames only, and where it is farther from its place
    than the segment's next marker is, which skin does not do."""
    places = fit.person.marker_positions_m
    apart_m = np.linalg.norm(places[fit.neighbours(m)] - places[m], axis=1)
    note = f" (seen in {100 * share:.0f} % of it)" if share < _OFTEN else ""
    is_far = size_m > apart_m.min(initial=np.inf)
    return note + ("; probably another marker, as the next one is nearer" if is_far else "")


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


Kind = Literal["jump", "slip", "swap", "offset"]

_ORDER: tuple[Kind, ...] = ("swap", "offset", "slip", "jump")
_BEAR = "bear each other's labels"
_DONE = {True: "corrected", False: "not clear enough to correct, left as recorded"}


@dataclass(frozen=True)
class MarkerEvent:
    """One marker that is not where the model may expect it.

    partner : the other marker of a swap, else empty.
    start_s, end_s : a slip holds until the trial's end, an offset fills the trial.
    size_m : length of the jump, the slip or the offset on the segment; of a swap the distance
        between the two places.
    statistic : residual over the spread it is judged against (jump, offset, a slip found as one),
        unlikeliness as the length of a normal vector (other slips), residual as labelled over
        residual exchanged, or the line between the two over what it lacks of an exact reversal
        (swap).
    what : the sentence but for what was done; when : in words.
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
    what: str = ""
    when: str = ""
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
    """An event of marker number ``m`` over an interval of frames."""
    marker, segment = fit.labels[m], f"the {in_words(fit.segments[m])}"
    other = "" if partner is None else fit.labels[partner]
    start, end = float(fit.times_s[frames.start]), float(fit.times_s[frames.stop - 1])
    whole = frames.start == 0 and frames.stop == len(fit.times_s)
    when = "throughout the trial" if whole else f"from {start:.2f} to {end:.2f} s"
    mm = f"{1000 * size_m:.0f} mm"
    what = {
        "jump": f"{marker} jumps {mm} away {when} and comes back",
        "slip": f"{marker} slips {mm} on {segment} at {start:.2f} s and stays there",
        "swap": f"{marker} and {other}, {mm} apart, {_BEAR} {when}",
        "offset": f"{marker} sits {mm} from its calibrated place on {segment} {when}",
    }[kind]
    what += note
    sentence = f"{what}; {_DONE[put_right]}" if kind == "swap" else what
    said = sentence, what, when
    return MarkerEvent(kind, marker, other, start, end, size_m, statistic, *said, put_right)


def summaries(events: Sequence[MarkerEvent], most: int) -> list[str]:
    """Sentences for people: jumps of one marker, and swaps of one time, in one; then how many more.

    Swaps first, then offsets, slips and jumps, the largest first.
    """
    groups: dict[tuple[object, ...], list[MarkerEvent]] = {}
    for one in events:
        same = (one.start_s, one.end_s, one.put_right)
        key = same if one.kind == "swap" else (one.marker,)
        groups.setdefault((_ORDER.index(one.kind), *key), []).append(one)
    ranked = sorted(groups.items(), key=lambda item: (item[0][0], -max(e.size_m for e in item[1])))
    said = [_of_group(group) for _, group in ranked]
    left = len(said) - most
    return said if left <= 0 else [*said[:most], f"and {left} more, in the report"]


def _of_group(group: list[MarkerEvent]) -> str:
    first = group[0]
    if len(group) == 1 or first.kind in ("offset", "slip"):
        return "; ".join(one.sentence for one in group)
    if first.kind == "swap":
        mine, others = (
            ", ".join(getattr(e, name) for e in group) for name in ("marker", "partner")
        )
        return f"{mine} and {others} {_BEAR} {first.when}; {_DONE[first.put_right]}"
    mm = 1000 * max(one.size_m for one in group)
    return (
        f"{first.marker} jumps {len(group)} times, by up to {mm:.0f} mm, "
        f"first at {first.start_s:.2f} s"
    )


def pieces(hit: np.ndarray, bridged: np.ndarray, longest_break: int) -> list[slice]:
    """Intervals of hits (N,); ``bridged`` frames and short breaks hold two of them together."""
    found: list[slice] = []
    for k in hit.nonzero()[0]:
        stop = found[-1].stop if found else 0
        near = k - stop < longest_break or bridged[stop:k].all()
        if found and near:
            found[-1] = slice(found[-1].start, int(k) + 1)
        else:
            found.append(slice(int(k), int(k) + 1))
    return found
