"""How small a mass on each segment the recordings would have shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import INK, ORANGE, house_style, new_figure, tidy

_TICKS_KG = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)


@dataclass(frozen=True, eq=False)
class MassLimits:
    """Segments in words, and the least mass (s,) that one recording shows on each [kg]."""

    segments: tuple[str, ...]
    masses_kg: np.ndarray


@house_style()
def mass_limits(data: MassLimits) -> Figure:
    """A dot per segment on a logarithmic axis, with its number."""
    rows = np.arange(len(data.segments))
    figure = new_figure(20.0 + 5.0 * len(rows))
    axes = figure.add_subplot()
    low, high = data.masses_kg.min() / 2.0, data.masses_kg.max() * 1.8
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.plot(data.masses_kg, rows, ls="none", marker="D", ms=5, mec=ORANGE, mfc="white")
    for row, mass in zip(rows, data.masses_kg, strict=True):
        axes.annotate(
            f"{mass:.2g}",
            (mass, row),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            color=INK,
        )
    ticks = [t for t in _TICKS_KG if low <= t <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.set_yticks(rows, data.segments)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("least mass that would be found [kg] (log scale)")
    tidy(axes, grid="x")
    return figure
