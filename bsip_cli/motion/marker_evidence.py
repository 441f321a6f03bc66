"""Markers that jump, slip, exchange labels or sit wrong, as the residuals of one trial show them.

Every limit is a multiple of one of three scales: what a marker is trusted to in the inverse
kinematics, skin motion included (``marker_sd_m`` over the root of its weight); the noise of the
recording; and the spread of the marker's own residual in its segment. What is found:

swap (marker_swaps.py)
    Both markers lie at least twice as near to the other's place in the model as to their own, or
    the line between them reverses from one frame to the next; or (marker_limbs.py) both arms
    (legs) fit twice as well exchanged. Where all markers involved then lie nearer to the model
    (marker_exchange.py), the labels are corrected and the poses fitted again before the rest is
    judged; else they stay as recorded.
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

from dataclasses import dataclass

import numpy as np

from bsip_cli.motion.marker_events import MarkerEvent
from bsip_cli.motion.marker_exchange import Refit, exchanged
from bsip_cli.motion.marker_fit import MarkerFit
from bsip_cli.motion.marker_jumps import jumps
from bsip_cli.motion.marker_limbs import swapped_limbs
from bsip_cli.motion.marker_offsets import offsets
from bsip_cli.motion.marker_slips import slips
from bsip_cli.motion.marker_swaps import swaps


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is wrong with the markers of one trial.

    Attributes
    ----------
    events : in the order of time.
    markers_m : (N, m, 3) the markers with exchanged labels corrected.
    """

    events: tuple[MarkerEvent, ...]
    markers_m: np.ndarray

    def put_right(self) -> bool:
        """Some labels were exchanged back."""
        return any(one.put_right for one in self.events)


def marker_evidence(fit: MarkerFit, refit: Refit, filled: np.ndarray | None = None) -> Evidence:
    """All events of one trial, and the markers without its swaps.

    Parameters
    ----------
    refit : poses fitted to other markers (n, m, 3) at times (n,); called only where labels may be
        exchanged.
    filled : (N, m) positions that were estimated over a gap: they may jump, but are no evidence
        of slips and offsets.
    """
    labelling = swaps(swapped_limbs(fit, refit), refit)
    fit = labelling.fit
    filled = None if filled is None else exchanged(filled, labelling.order)
    residual = fit.residual_m
    jumped, astray = jumps(fit, residual, filled)
    guessed = astray if filled is None else astray | filled
    residual = np.where(guessed[..., None], np.nan, residual)
    slipped, level = slips(fit, residual)
    events = [*labelling.events, *jumped, *slipped, *offsets(fit, level)]
    events.sort(key=lambda one: (one.start_s, one.kind, -one.size_m))
    return Evidence(tuple(events), fit.measured_m)
