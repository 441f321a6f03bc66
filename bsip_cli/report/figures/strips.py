"""A dot per person: errors beside their yardsticks, and what identification gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    INK,
    MANY_PEOPLE,
    ORANGE,
    SOFT,
    house_style,
    legend_above,
    line_of,
    new_figure,
    plain,
    tidy,
)

_TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
_SPREAD = 0.28


@dataclass(frozen=True, eq=False)
class Strip:
    """One quantity of all persons: ``values`` (p,), NaN where not known; ``far`` (p,) those that are
    named beside their dot."""

    title: str
    values: np.ndarray
    names: tuple[str, ...]
    far: np.ndarray
    good: float
    limit: float


@house_style()
def strips(data: Sequence[Strip]) -> Figure:
    """Side by side; light blue is as good as published, above the red line is large."""
    figure = new_figure(70.0)
    panels = figure.subplots(1, len(data), squeeze=False)[0]
    for axes, strip in zip(panels, data, strict=True):
        _draw_strip(axes, strip)
    return figure


def _draw_strip(axes: Axes, strip: Strip) -> None:
    known = np.flatnonzero(np.isfinite(strip.values))
    offsets = np.linspace(-_SPREAD, _SPREAD, len(known)) if len(known) > 1 else np.zeros(len(known))
    axes.axhspan(0.0, strip.good, color="#cfe3f2", lw=0)
    axes.axhline(strip.limit, color="#b30000", lw=1.2)
    colours = np.where(strip.far[known], ORANGE, BLUE)
    many = len(known) > MANY_PEOPLE
    axes.scatter(offsets, strip.values[known], s=8 if many else 22, c=colours, rasterized=many)
    for x, k in zip(offsets, known, strict=True):
        if strip.far[k]:
            place = (x, float(strip.values[k]))
            axes.annotate(plain(strip.names[k]), place, (5, 3), textcoords="offset points", size=7)
    if len(known):
        axes.hlines(np.median(strip.values[known]), -0.42, 0.42, color=INK, lw=1.4)
    axes.set_xlim(-0.6, 0.9)
    top = max([1.15 * strip.limit, *(1.1 * strip.values[known])])
    axes.set_ylim(0.0, top)
    axes.set_xticks([])
    axes.set_title(strip.title, fontsize=8, loc="left")
    tidy(axes)


@house_style()
def gain_dots(components: Sequence[str], ratios: Mapping[str, np.ndarray]) -> Figure:
    """A row per component; of each method (c, p) its error over RM's, a dot per person, a line at
    the geometric mean."""
    rows = len(components)
    figure = new_figure(24.0 + 8.0 * rows)
    axes = figure.add_subplot()
    for method, table in ratios.items():
        for row, of_row in enumerate(table):
            _draw_gains(axes, method, row, of_row)
    axes.axvline(1.0, color=SOFT, lw=1.0)
    everything = np.concatenate(list(ratios.values()))
    low = min(0.5, float(np.nanmin(everything))) / 1.15
    high = max(2.0, float(np.nanmax(everything))) * 1.15
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    ticks = [t for t in _TICKS if low <= t <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    legend_above(axes)
    axes.set_yticks(range(rows), components)
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_xlabel("error over that of RM (left of 1: follows better)")
    tidy(axes, grid="x")
    transform = axes.get_yaxis_transform()
    axes.hlines(np.arange(1, rows) - 0.5, 0, 1, transform=transform, color=FAINT, lw=0.6)
    return figure


def _draw_gains(axes: Axes, method: str, row: int, ratios: np.ndarray) -> None:
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
