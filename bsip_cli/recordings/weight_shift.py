"""Weight that leaves one plate arrives on another: does a reversed plate agree?"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plates import LOADED_N

_WINDOW_S = 0.1
_QUIET_SHARE = 0.05  # of the mean load: more is movement, in which both feet press at once
_LEAST_CHANGE_N = 1.0
_TOGETHER = 0.8  # correlation


def sign_doubts(
    plates: Sequence[Plate], reversed_names: Collection[str], rate_hz: float
) -> list[Finding]:
    """A warning for each reversed plate whose load changes together with the others' load.

    In quiet standing the weight is constant, so the loads change in opposite directions. If
    they would without the reversal, the plate's zero is wrong rather than its sign.
    """
    findings = []
    for plate in plates:
        others = [other for other in plates if other is not plate]
        if plate.name in reversed_names and others:
            findings += _doubt(plate, others, rate_hz)
    return findings


def _doubt(plate: Plate, others: Sequence[Plate], rate_hz: float) -> list[Finding]:
    good = np.logical_and.reduce([p.usable for p in (plate, *others)])
    if good.sum() < rate_hz:
        return []
    width = max(1, round(_WINDOW_S * rate_hz))
    own = uniform_filter1d(plate.force_N[good, 2], width)
    rest = uniform_filter1d(np.sum([p.force_N[good, 2] for p in others], axis=0), width)
    if not all(_is_quiet(load) for load in (own, rest)):
        return []
    correlation = float(np.corrcoef(own, rest)[0, 1])
    if correlation < _TOGETHER:
        return []
    found = (
        f"reversed, its load changes together with the other plates' (r = {correlation:.2f}, the "
        f"sum by {(own + rest).std():.1f} N; as recorded by {(own - rest).std():.1f} N)"
    )
    return [
        Finding(
            check="plate_sign",
            subject=plate.name,
            found=found,
            expected="opposite changes in quiet standing",
            action="kept it reversed; if its zero is lost instead, its load and the sum are wrong",
            level="warning",
        )
    ]


def _is_quiet(load_N: np.ndarray) -> bool:
    change = load_N.std()
    return bool(
        load_N.mean() > LOADED_N and _LEAST_CHANGE_N < change < _QUIET_SHARE * load_N.mean()
    )
