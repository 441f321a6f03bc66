"""Measured less simulated, over time and over frequency, component by component."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from scipy.signal import welch

from bsip_cli.report.figures.canvas import (
    BLUE,
    INK,
    ORANGE,
    house_style,
    new_figure,
    runs,
    thinned,
    tidy,
)

_SEGMENT_S = 4.0  # of a spectrum: 0.25 Hz apart
_SHORTEST_S = 1.0  # of a stretch that enters a spectrum
_HIGHEST_HZ = 15.0
_ALONE = ((BLUE, "-", 0.7),)
_BEFORE_AFTER = (("#8fc1e3", "-", 1.7), (ORANGE, "-", 0.7))  # light and wide, dark and thin


@dataclass(frozen=True, eq=False)
class WrenchResidual:
    """Residuals of one trial.

    Attributes
    ----------
    time_s : (n,).
    residuals : name of the component -> name of the method -> (n,), NaN where not compared.
    units : name of the component -> unit.
    """

    time_s: np.ndarray
    residuals: Mapping[str, Mapping[str, np.ndarray]]
    units: Mapping[str, str]


@house_style()
def wrench_residual(data: WrenchResidual) -> Figure:
    """A row per component: to the left over time, to the right its amplitude spectrum."""
    rows = len(data.residuals)
    figure = new_figure(18.0 + 19.0 * rows)
    panels = figure.subplots(rows, 2, squeeze=False, width_ratios=(2.4, 1), sharex="col")
    for (left, right), (name, methods) in zip(panels, data.residuals.items(), strict=True):
        styles = _BEFORE_AFTER if len(methods) > 1 else _ALONE
        for (method, values), style in zip(methods.items(), styles, strict=False):
            _draw(left, right, data.time_s, values, method, style)
        left.axhline(0.0, color=INK, lw=0.6)
        left.set_title(f"{name} [{data.units[name]}]", fontsize=7.5, loc="left", pad=2)
        right.set_title(f"[{data.units[name]} / √Hz]", fontsize=7.5, loc="left", pad=2)
        right.set_yscale("log")
        right.yaxis.set_minor_formatter(NullFormatter())
        for axes in (left, right):
            tidy(axes)
            axes.tick_params(labelsize=7)
    panels[-1, 0].set_xlabel("time [s]")
    panels[-1, 0].set_xlim(data.time_s[0], data.time_s[-1])
    panels[-1, 1].set_xlabel("frequency [Hz]")
    panels[-1, 1].set_xlim(0.0, _HIGHEST_HZ)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=2, frameon=False, fontsize=8)
    return figure


def _draw(
    left: Axes, right: Axes, time_s: np.ndarray, values: np.ndarray, method: str, style: tuple
) -> None:
    colour, dash, width = style
    keep = thinned(len(time_s))
    left.plot(time_s[keep], values[keep], color=colour, ls=dash, lw=width, label=method)
    frequency, amplitude = amplitude_spectrum(values, 1.0 / float(np.median(np.diff(time_s))))
    shown = frequency <= _HIGHEST_HZ
    right.plot(frequency[shown], amplitude[shown], color=colour, ls=dash, lw=width)


def amplitude_spectrum(values: np.ndarray, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and amplitude density [unit per root Hz], mean of the known stretches.

    Welch's method in windows of one length; stretches shorter than a second are left out, and the
    window is no longer than the shortest that is left in.
    """
    known = runs(np.isfinite(values))
    stretches = [values[a:b] for a, b in known if b - a >= _SHORTEST_S * rate_hz]
    if not stretches:
        return np.empty(0), np.empty(0)
    window = min(round(_SEGMENT_S * rate_hz), *(len(part) for part in stretches))
    power, weight = np.zeros(window // 2 + 1), 0
    for part in stretches:
        frequency, density = welch(part, rate_hz, nperseg=window, detrend="constant")
        power += len(part) * density
        weight += len(part)
    return frequency[1:], np.sqrt(power[1:] / weight)
