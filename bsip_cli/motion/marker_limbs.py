"""Both arms or both legs that bear each other's labels throughout."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import mirrored
from bsip_cli.motion.marker_exchange import (
    Exchange,
    Labelling,
    Refit,
    as_recorded,
    misfit_m,
    put_right,
    refitted,
    with_exchanges,
)
from bsip_cli.motion.marker_fit import MarkerFit

_FAR = 3.0  # misfit of the trial over the trusted distance
_BETTER = 0.5  # misfit exchanged over that as labelled
_ARM, _LEG = ("upper_arm", "forearm", "hand"), ("thigh", "shank", "foot")
_LIMBS = (_ARM, ("upper_torso", *_ARM), _LEG)  # the shoulders' labels may go with the arms'
_LATERAL_M = 0.05  # a marker of the trunk this far beside its middle belongs to a side
_MIRRORED_M = 0.1  # the places of a pair are mirrored to this
_FRAMES = 24


def swapped_limbs(fit: MarkerFit, refit: Refit) -> Labelling:
    """Labels of the limbs corrected, with the events.

    All markers of one limb pull the other limb's model over, or turn the trunk round, so single
    pairs need not show it. Where the markers fit badly, the poses are fitted again to some frames
    with the limbs exchanged; if that at least halves the residual of all markers, they are.
    """
    whole = slice(0, len(fit.times_s))
    frames = np.unique(np.linspace(0, whole.stop - 1, _FRAMES).astype(int))
    before = misfit_m(fit.distance_m()[frames])
    if not before > _FAR * fit.trusted_m.min():
        return as_recorded(fit)
    tried = []
    for limb in _LIMBS:
        pairs = _mirrored_pairs(fit, limb)
        markers = with_exchanges(fit, [Exchange(a, b, whole, 1.0) for a, b in pairs])
        again = refit(markers[frames], fit.times_s[frames])
        tried.append((misfit_m(again.distance_m()), pairs))
    after, pairs = min(tried, key=lambda one: one[0])
    if not after < _BETTER * before:
        return as_recorded(fit)
    suspected = [Exchange(a, b, whole, before / after) for a, b in pairs]
    return put_right(as_recorded(fit), refitted(fit, refit, suspected), refit, suspected)


def _mirrored_pairs(fit: MarkerFit, limb: tuple[str, ...]) -> list[tuple[int, int]]:
    """Markers of the right side of some segments and those that lie mirrored on the left one."""
    side = np.array(
        [
            {"_r": 1, "_l": -1}.get(name[-2:], int(np.sign(z)) * (abs(z) > _LATERAL_M))
            for name, z in zip(fit.segments, fit.place_m[:, 2], strict=True)
        ]
    )
    seen = np.isfinite(fit.measured_m[..., 0])
    near = sorted(
        (float(np.linalg.norm(fit.place_m[a] * [1.0, 1.0, -1.0] - fit.place_m[b])), a, b)
        for a, segment in enumerate(fit.segments)
        for b, other in enumerate(fit.segments)
        if segment.removesuffix("_r") in limb and other == mirrored(segment)
        if side[a] == 1 and side[b] == -1 and (seen[:, a] & seen[:, b]).any()
    )
    pairs: list[tuple[int, int]] = []
    for apart, a, b in near:
        if apart < _MIRRORED_M and not {a, b} & {k for pair in pairs for k in pair}:
            pairs.append((a, b))
    return pairs
