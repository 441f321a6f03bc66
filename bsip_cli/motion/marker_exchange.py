"""Exchanged labels are corrected where that brings every marker involved nearer to the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.motion.marker_events import MarkerEvent, event
from bsip_cli.motion.marker_fit import MarkerFit

Refit = Callable[[np.ndarray, np.ndarray], MarkerFit]

_LARGEST_M = 0.2  # a marker farther off says no more


@dataclass(frozen=True)
class Exchange:
    """Markers number ``a`` and ``b`` bear each other's labels over a stretch of frames.

    ``statistic`` says how clearly, as in :class:`MarkerEvent`.
    """

    a: int
    b: int
    frames: slice
    statistic: float


@dataclass(frozen=True, eq=False)
class Labelling:
    """A fit and the labels it rests on.

    Attributes
    ----------
    fit : poses and markers with the labels corrected.
    order : (N, m) under each label, the recorded label of the marker that bears it now.
    events : the exchanges that were found, corrected or not.
    """

    fit: MarkerFit
    order: np.ndarray
    events: tuple[MarkerEvent, ...] = ()


def as_recorded(fit: MarkerFit) -> Labelling:
    """Every marker under its own label."""
    return Labelling(fit, np.tile(np.arange(len(fit.labels)), (len(fit.times_s), 1)))


def exchanged(markers: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Markers (N, m, ...) with, under each label, the one that ``order`` (N, m) says."""
    return np.take_along_axis(markers, order.reshape(*order.shape, *[1] * (markers.ndim - 2)), 1)


def with_exchanges(fit: MarkerFit, exchanges: Sequence[Exchange]) -> np.ndarray:
    """(N, m, 3) the markers with these labels exchanged."""
    return exchanged(fit.measured_m, _order(fit, exchanges))


def refitted(fit: MarkerFit, refit: Refit, exchanges: Sequence[Exchange]) -> MarkerFit:
    """The poses fitted again with these labels exchanged."""
    return refit(with_exchanges(fit, exchanges), fit.times_s)


def put_right(
    labelling: Labelling, again: MarkerFit, refit: Refit, suspected: Sequence[Exchange]
) -> Labelling:
    """Exchange suspected labels back, but for those that would leave a marker farther off.

    A marker involved must come nearer to the model, or lie within what markers are trusted to;
    the others are left as labelled and the poses fitted again without them, until that holds of
    all that remain. All markers together must fit better than before, or none is exchanged.

    Parameters
    ----------
    again : the fit with all suspected labels exchanged (:func:`refitted`).
    """
    fit, kept = labelling.fit, list(suspected)
    while nearer := [one for one in kept if _comes_nearer(one, fit, again)]:
        if len(nearer) == len(kept):
            break
        kept, again = nearer, refitted(fit, refit, nearer)
    done = nearer if misfit_m(again.distance_m()) < misfit_m(fit.distance_m()) else []
    events = [_event(fit, one, one in done) for one in suspected]
    return Labelling(
        again if done else fit,
        exchanged(labelling.order, _order(fit, done)),
        (*labelling.events, *events),
    )


def misfit_m(distance: np.ndarray) -> float:
    """Root mean square of distances from the model, none of them larger than 0.2 m."""
    near = np.minimum(distance[np.isfinite(distance)], _LARGEST_M)
    return float(np.sqrt(np.mean(near**2))) if len(near) else 0.0


def _order(fit: MarkerFit, exchanges: Sequence[Exchange]) -> np.ndarray:
    order = np.tile(np.arange(len(fit.labels)), (len(fit.times_s), 1))
    for one in exchanges:
        order[one.frames, [one.a, one.b]] = order[one.frames, [one.b, one.a]]
    return order


def _comes_nearer(one: Exchange, before: MarkerFit, after: MarkerFit) -> bool:
    was, now = (
        [misfit_m(fit.distance_m(m)[one.frames]) for m in (one.a, one.b)] for fit in (before, after)
    )
    limit = 3**0.5 * float(before.trusted_m.min())  # trusted in each of three directions
    return all(near < max(far, limit) for near, far in zip(now, was, strict=True))


def _event(fit: MarkerFit, one: Exchange, undone: bool) -> MarkerEvent:
    line = fit.measured_m[one.frames, one.a] - fit.measured_m[one.frames, one.b]
    apart = float(np.nanmedian(np.linalg.norm(line, axis=1)))
    return event(
        fit, "swap", one.a, one.frames, apart, one.statistic, partner=one.b, put_right=undone
    )
