"""Markers that jump, slip, exchange labels or sit wrong, as the residuals of one trial show them.

Every limit is a multiple of one of three scales: what a marker is trusted to in the inverse
kinematics, skin motion included (``marker_sd_m`` over the root of its weight); the noise of the
recording; and the spread of the marker's own residual in its segment. What is found:

swap (marker_swaps.py)
    Both markers lie at least twice as near to the other's place in the model as to their own, or
    the line between them reverses from one frame to the next; or both arms (legs) fit twice as
    well exchanged. The labels are put right and the poses fitted again before the rest is judged.
jump (marker_jumps.py)
    The residual leaves its running median for less than a quarter second and comes back.
slip (marker_slips.py)
    The mean residual goes to another level and stays there, and the joint angles do not explain
    it.
offset (marker_offsets.py)
    The median residual of the whole trial is far beyond the spread and that of the others.

A marker that slips or sits wrong drags the pose, and its neighbours' residuals with it. The
linear response of the fit tells which marker explains the residuals of all; only that one is
reported, with the distance it moved by on its segment and not the smaller residual it leaves.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.motion.marker_events import MarkerEvent
from bsip_cli.motion.marker_fit import MarkerFit
from bsip_cli.motion.marker_jumps import jumps
from bsip_cli.motion.marker_offsets import offsets
from bsip_cli.motion.marker_slips import slips
from bsip_cli.motion.marker_swaps import Refit, exchanged, swapped_limbs, swaps


def marker_evidence(
    fit: MarkerFit, refit: Refit, filled: np.ndarray | None = None
) -> tuple[MarkerEvent, ...]:
    """All events of one trial, in the order of time.

    Parameters
    ----------
    refit : poses fitted to other markers (n, m, 3) at times (n,); called only where labels are
        exchanged.
    filled : (N, m) positions that were estimated over a gap: they may jump, but are no evidence
        of slips and offsets.
    """
    events, order = swapped_limbs(fit, refit)
    if events:
        fit = refit(exchanged(fit.measured_m, order), fit.times_s)
    pairs, fit = swaps(fit, refit)
    residual = fit.residual_m
    jumped, astray = jumps(fit, residual, filled)
    guessed = astray if filled is None else astray | filled
    residual = np.where(guessed[..., None], np.nan, residual)
    slipped, level = slips(fit, residual)
    events += [*pairs, *jumped, *slipped, *offsets(fit, level)]
    return tuple(sorted(events, key=lambda one: (one.start_s, one.kind, -one.size_m)))
