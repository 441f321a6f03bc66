"""Errors of RM+mass and OM over that of RM, per component and participant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import (
    FAINT,
    MANY_PEOPLE,
    SOFT,
    house_style,
    legend_above,
    line_of,
    new_figure,
    tidy,
)

_TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
_SPREAD = 0.28


@dataclass(frozen=True, eq=False)
class GainDots:
    """Of each method (c, p) over components and participants: its RMSE / RMSE of RM, NaN where not
    known."""

    components: tuple[str, ...]
    ratios: Mapping[str, np.ndarray]


@house_style()
def gain_dots(data: GainDots) -> Figure:
    """A row per component; of each method a dot per participant, a line at their geometric mean."""
    rows = len(data.components)
    figure = new_figure(24.0 + 8.0 * rows)
    axes = figure.add_subplot()
    for method, table in data.ratios.items():
        for row, ratios in enumerate(table):
            _draw_row(axes, method, row, ratios)
    axes.axvline(1.0, color=SOFT, lw=1.0)
    _log_axis(axes, np.concatenate(list(data.ratios.values())))
    legend_above(axes)
    axes.set_yticks(range(rows), data.components)
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_xlabel("RMSE / RMSE of RM (left of 1: follows better than RM)")
    tidy(axes, grid="x")
    axes.hlines(
        np.arange(1, rows) - 0.5, 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, lw=0.6
    )
    return figure


def _draw_row(axes: Axes, method: str, row: int, ratios: np.ndarray) -> None:
    line, people = line_of(method), len(ratios)
    many = people > MANY_PEOPLE
    offsets = np.linspace(-_SPREAD, _SPREAD, people) if people > 1 else np.zeros(1)
    axes.scatter(
        ratios,
        row + offsets,
        s=6 if many else 24,
        lw=0.0 if many else 0.5,
        rasterized=many,
        edgecolor="white",
        marker=line.marker,
        color=line.colour,
        label=method,
        zorder=2,
    )
    if np.isfinite(ratios).any():
        mean = float(np.exp(np.nanmean(np.log(ratios))))
        axes.plot([mean, mean], [row - 0.38, row + 0.38], color=line.colour, lw=1.8, zorder=3)


def _log_axis(axes, ratios: np.ndarray) -> None:
    low = min(0.5, float(np.nanmin(ratios))) / 1.15
    high = max(2.0, float(np.nanmax(ratios))) * 1.15
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    ticks = [t for t in _TICKS if low <= t <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
