"""How small a mass on each segment the recordings would have shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    INK,
    ORANGE,
    house_style,
    legend_above,
    new_figure,
    tidy,
)

_TICKS_KG = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)


@dataclass(frozen=True, eq=False)
class MassLimits:
    """Segments in words, and the least mass (s,) that is seen on each [kg], worn in all recordings
    or in a single one; NaN where that is not known."""

    segments: tuple[str, ...]
    always_kg: np.ndarray
    once_kg: np.ndarray


@house_style()
def mass_limits(data: MassLimits) -> Figure:
    """Two dots per segment on a logarithmic axis, with their numbers."""
    rows = np.arange(len(data.segments))
    figure = new_figure(20.0 + 5.0 * len(rows))
    axes = figure.add_subplot()
    both = np.concatenate([data.always_kg, data.once_kg])
    low, high = np.nanmin(both) / 2.0, np.nanmax(both) * 1.8
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.hlines(rows, data.once_kg, data.always_kg, color=FAINT, lw=1.5)
    _dots(axes, data.once_kg, rows, (ORANGE, "D", "white"), "worn in one recording", -6)
    _dots(axes, data.always_kg, rows, (BLUE, "o", BLUE), "worn in all recordings", 6)
    ticks = [t for t in _TICKS_KG if low <= t <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.set_yticks(rows, data.segments)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("least mass that would be found [kg] (log scale)")
    tidy(axes, grid="x")
    legend_above(axes)
    return figure


def _dots(
    axes: Axes, masses: np.ndarray, rows: np.ndarray, style: tuple, label: str, apart: int
) -> None:
    """Dots with their numbers to one side."""
    colour, marker, face = style
    if not np.isfinite(masses).any():
        return
    axes.plot(masses, rows, ls="none", marker=marker, ms=5, mec=colour, mfc=face, label=label)
    for row, mass in zip(rows, masses, strict=True):
        if np.isfinite(mass):
            axes.annotate(
                f"{mass:.2g}",
                (mass, row),
                xytext=(apart, 0),
                textcoords="offset points",
                va="center",
                ha="left" if apart > 0 else "right",
                fontsize=7.5,
                color=INK,
            )
