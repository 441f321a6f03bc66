"""What a recording's error looks like over time, from which follows what to check first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report import records
from bsip_cli.statistics.methods import MEASURED

_MOST = 0.5  # of the squared error: what makes as much sets the kind
_PART = 0.25  # of the frames, in which an even error has as little
_BRIEF_S = 0.2  # to either side of the worst moment


@dataclass(frozen=True)
class Shape:
    """``kind`` : shifted (a centre of pressure, by a constant), constant (of a force), load (goes
    along with it), brief, impact (the force changes fast), light (there is little load) or mixed.
    ``column`` : of the signals, the one with most of the error. ``worst_s`` : when it is largest [s].
    """

    kind: str
    column: str
    worst_s: float


def shape_of(
    reconstruction: pd.DataFrame | None, method: str, columns: Sequence[str]
) -> Shape | None:
    """Of the method's signals (centre of pressure [m] or force [N]) less the measured ones; None if
    not known."""
    if reconstruction is None or method not in set(reconstruction["method"]):
        return None
    signals = {name: records.signals_of(reconstruction, name) for name in (*columns, "fz_N")}
    clock, load = records.clock_of(reconstruction), signals["fz_N"][MEASURED]
    off = np.array([signals[name][method] - signals[name][MEASURED] for name in columns])
    known = records.flags_of(reconstruction, "valid") & np.isfinite([*off, load]).all(axis=0)
    if not off[:, known].any():
        return None
    clock, load, off = clock[known], load[known], off[:, known]
    power = (off**2).sum(axis=0)
    worst_s = float(clock[np.argmax(power)])
    shares = _shares(off, load, clock, is_load="fz_N" in columns)
    kind = max(shares, key=shares.__getitem__)
    kind = kind if shares[kind] >= _MOST else "mixed"
    return Shape(kind, columns[int(np.argmax((off**2).sum(axis=1)))], worst_s)


def _shares(
    off: np.ndarray, load: np.ndarray, clock: np.ndarray, is_load: bool
) -> dict[str, float]:
    """Of the squared error ``off`` (signals, N), what each kind makes; ``is_load``: the error is
    of the load itself (N,), of which a small one is no reason to err."""
    power = (off**2).sum(axis=0)
    near = np.abs(clock - clock[np.argmax(power)]) <= _BRIEF_S
    speed = np.abs(np.gradient(load, clock)) if len(load) > 1 else np.zeros_like(load)
    frames = {
        "brief": near if near.mean() <= _PART else np.zeros_like(near),
        "impact": speed > np.quantile(speed, 1.0 - _PART),
        "light": (load < np.quantile(load, _PART)) & (not is_load),
    }
    shares = {
        "constant" if is_load else "shifted": float((off.mean(axis=1) ** 2).sum() / power.mean())
    }
    if is_load:
        along = load - load.mean()
        shares["load"] = float(
            np.dot(off[0], along) ** 2 / ((along @ along) * power.sum() or np.inf)
        )
    return shares | {kind: float(power[of].sum() / power.sum()) for kind, of in frames.items()}
