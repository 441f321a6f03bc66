"""Signals over time, measured and by method, with bands where their errors are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import SOFT, house_style, line_of, new_figure, thinned, tidy
from bsip_cli.statistics.samples import Z95


@dataclass(frozen=True, eq=False)
class Panel:
    """Signals of one quantity.

    Attributes
    ----------
    title : what it is, with its unit.
    time_s : (n,).
    signals : label of the method -> (n,), NaN where there are none.
    spreads : label of the method -> (n,) standard deviation, for those drawn with a band.
    """

    title: str
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    spreads: Mapping[str, np.ndarray] = field(default_factory=dict)


@house_style()
def curves(panels: Sequence[Panel], columns: int, height_mm: float = 38.0) -> Figure:
    """Panels in rows of ``columns``, one legend above; bands are 95 % intervals."""
    rows = -(-len(panels) // columns)
    figure = new_figure(12.0 + height_mm * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw(axes, panel)
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=5, frameon=False, fontsize=8)
    return figure


def _draw(axes: Axes, panel: Panel) -> None:
    keep = thinned(len(panel.time_s))
    time = panel.time_s[keep]
    for method, values in panel.signals.items():
        line = line_of(method)
        axes.plot(time, values[keep], color=line.colour, ls=line.style, lw=line.width, label=method)
        if method in panel.spreads:
            half = Z95 * panel.spreads[method][keep]
            low, high = values[keep] - half, values[keep] + half
            axes.fill_between(time, low, high, color=line.colour, alpha=0.2, lw=0)
    if panel.spreads:
        axes.axhline(0.0, color=SOFT, lw=0.5, zorder=0)
    axes.set_title(panel.title, fontsize=8, loc="left", pad=3)
    axes.set_xlim(panel.time_s[0], panel.time_s[-1])
    tidy(axes)
    axes.tick_params(labelsize=7)
