"""Bars, dots per person, and curves over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from bsip_cli.report.blocks import Bar
from bsip_cli.report.cause_colours import NOISE, UNKNOWN, Fill, Piece, fills
from bsip_cli.report.figures import canvas
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.statistics.samples import Z95

# --- bars: errors cut into what makes them, residuals of markers, masses of segments ---------------

_HEIGHT = 0.7  # of a bar, from one to the next
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


@canvas.house_style()
def error_bars(bars: Sequence[Bar], first: Sequence[Piece] = ()) -> Figure:
    """One bar each; what makes the error smaller stands left of zero. Hatched: unknown. ``first``:
    pieces whose order, and hatching of faults, are those of the first page's bar."""
    shown = {piece.label for bar in bars for piece in bar.pieces}
    figure = canvas.new_figure(max(24.0, 14.0 + 2.2 * len(shown)) + 6.0 * len(bars))
    axes = figure.add_subplot()
    fill = fills([*first, *(piece for bar in bars for piece in bar.pieces)])
    ends = np.zeros((len(bars), 2))  # left of zero, right of it
    handles: dict[str, Any] = {}
    last = (NOISE, UNKNOWN)
    labels = (*(one for one in fill if one not in last), *last)
    for label in (one for one in labels if one in shown):
        shares = [sum(p.share for p in bar.pieces if p.label == label) for bar in bars]
        handles[label] = _draw_shares(axes, np.array(shares), ends, fill[label])
    axes.axvline(0.0, color=canvas.INK, lw=0.9)
    axes.set_yticks(range(len(bars)), [bar.title for bar in bars])
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlabel("share of the squared error [%]")
    canvas.tidy(axes, grid="x")
    how: dict[str, Any] = {"handler_map": {tuple: HandlerTuple(ndivide=None, pad=0.0)}}
    how |= {"loc": "outside upper center", "ncols": 2, "frameon": False, "fontsize": 7.5}
    figure.legend(list(handles.values()), list(handles), **how)
    return figure


def _draw_shares(axes: Axes, shares: np.ndarray, ends: np.ndarray, fill: Fill) -> tuple[Patch, ...]:
    """Add a piece to each bar, several colours one above the other; return what stands for it in the
    legend. ends (b, 2), changed : where each bar ends so far, left of zero and right of it."""
    rows = np.arange(len(shares))
    side = (shares > 0).astype(int)
    start = ends[rows, side]
    height = _HEIGHT / len(fill.colours)
    patches = []
    for k, colour in enumerate(fill.colours):
        style: dict[str, Any] = {"facecolor": colour, "hatch": fill.hatch, "edgecolor": canvas.INK}
        at = rows - _HEIGHT / 2 + (k + 0.5) * height
        axes.barh(at, shares, left=start, height=height, lw=0.5, **style)
        patches.append(Patch(lw=0.5, **style))
    ends[rows, side] += shares
    return tuple(patches)


@canvas.house_style()
def marker_bars(markers: Sequence[str], rms_mm: np.ndarray, limit_mm: float) -> Figure:
    """A bar per marker; the line is the limit."""
    figure = canvas.new_figure(52)
    axes = figure.add_subplot()
    colours = np.where(rms_mm > limit_mm, canvas.ORANGE, canvas.BLUE)
    axes.bar(range(len(markers)), rms_mm, color=colours)
    axes.axhline(limit_mm, color=canvas.INK, lw=0.9, ls="--")
    axes.set_xticks(range(len(markers)), [canvas.plain(name) for name in markers], rotation=90)
    axes.set_xlim(-0.6, len(markers) - 0.4)
    axes.set_ylabel("distance [mm]")
    canvas.tidy(axes)
    axes.tick_params(axis="x", labelsize=6.5)
    return figure


def _ticks(axes: Axes, low: float, high: float) -> None:
    axes.set_xlim(low, high)
    ticks = [t for t in _TICKS if low <= t <= high]
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])


@canvas.house_style()
def segment_masses(data: pd.DataFrame) -> Figure:
    """Three panels over the segments (the index): masses ``rm_kg, rm_mass_kg, om_kg``, OM - RM with
    95 % intervals (``om_sd_kg``), and in 0..1 how much the data decide (``data_share``)."""
    rows = np.arange(len(data))
    figure = canvas.new_figure(22.0 + 4.8 * len(rows))
    masses, differences, shares = figure.subplots(1, 3, sharey=True, width_ratios=(3, 3, 1.5))
    positive = data["om_kg"].where(data["om_kg"] > 0.0)
    own = ((RM, data["rm_kg"], 24), (RM_MASS, data["rm_mass_kg"], 9), (OM, positive, 16))
    for method, kg, size in own:
        line = canvas.line_of(method)
        style = {"facecolor": "white" if method == RM else line.colour, "edgecolor": line.colour}
        masses.scatter(kg, rows, marker=line.marker, s=size, label=method, **style)
    masses.set_xscale("log")
    both = np.concatenate([data["rm_kg"], positive])
    _ticks(masses, np.nanmin(both) / 1.35, np.nanmax(both) * 1.35)
    masses.set_xlabel("mass [kg] (log scale)")
    canvas.legend_above(masses)
    differences.axvline(0.0, color=canvas.ORANGE, lw=1.2, ls="--")
    spread = np.nan_to_num(Z95 * data["om_sd_kg"])
    dots: dict[str, Any] = {"fmt": "o", "ms": 4, "color": canvas.BLUE}
    dots |= {"ecolor": canvas.SOFT, "elinewidth": 1.1, "capsize": 2}
    differences.errorbar(data["om_kg"] - data["rm_kg"], rows, xerr=spread, **dots)
    differences.set_xlabel("OM − RM [kg], 95 % interval")
    shares.barh(rows, 100.0, height=0.55, color=canvas.FAINT)
    shares.barh(rows, np.nan_to_num(100.0 * data["data_share"]), height=0.55, color=canvas.BLUE)
    shares.set_xlim(0.0, 100.0)
    shares.set_xlabel("data decide [%]")
    for axes in (masses, differences, shares):
        canvas.tidy(axes, grid="both")
    masses.set_yticks(rows, data.index)
    masses.set_ylim(len(rows) - 0.4, -0.6)
    return figure


# --- a dot per person: errors and their yardsticks, and what identification gains -----------------

_SPREAD = 0.28


@dataclass(frozen=True, eq=False)
class Strip:
    """One quantity of all persons: ``values`` (p,), NaN where not known; ``far`` (p,) those that are
    named next to their dot; ``end`` of the axis, where a triangle stands for what is beyond."""

    title: str
    values: np.ndarray
    names: tuple[str, ...]
    far: np.ndarray
    good: float
    limit: float
    end: float


@canvas.house_style()
def strips(data: Sequence[Strip]) -> Figure:
    """Side by side; light blue is as good as published, above the red line is large."""
    figure = canvas.new_figure(70.0)
    panels = figure.subplots(1, len(data), squeeze=False)[0]
    for axes, strip in zip(panels, data, strict=True):
        _draw_strip(axes, strip)
    return figure


def _draw_strip(axes: Axes, strip: Strip) -> None:
    known = np.flatnonzero(np.isfinite(strip.values))
    offsets = np.linspace(-_SPREAD, _SPREAD, len(known)) if len(known) > 1 else np.zeros(len(known))
    axes.axhspan(0.0, strip.good, color="#cfe3f2", lw=0)
    axes.axhline(strip.limit, color="#b30000", lw=1.2)
    colours = np.where(strip.far[known], canvas.ORANGE, canvas.BLUE)
    many = len(known) > canvas.MANY_PEOPLE
    style: dict[str, Any] = {"s": 8 if many else 22, "rasterized": many}
    beyond = strip.values[known] > strip.end
    for marker, mine, most in (("o", ~beyond, strip.end), ("^", beyond, 0.98 * strip.end)):
        values = np.minimum(strip.values[known][mine], most)
        axes.scatter(offsets[mine], values, c=colours[mine], marker=marker, **style)
    for x, k in zip(offsets, known, strict=True):
        if strip.far[k]:
            value, name = float(strip.values[k]), canvas.plain(strip.names[k])
            name, lift = (f"{name}: {value:.3g}", -9) if value > strip.end else (name, 3)
            place = (x, min(value, strip.end))
            axes.annotate(name, place, (5, lift), textcoords="offset points", size=7)
    if len(known):
        middle = min(float(np.median(strip.values[known])), strip.end)
        axes.hlines(middle, -0.42, 0.42, color=canvas.INK, lw=1.4)
    axes.set_xlim(-0.6, 0.9)
    axes.set_ylim(0.0, strip.end)
    axes.set_xticks([])
    axes.set_title(strip.title, fontsize=8, loc="left")
    canvas.tidy(axes)


@canvas.house_style()
def gain_dots(components: Sequence[str], ratios: Mapping[str, np.ndarray]) -> Figure:
    """A row per component; of each method (c, p) its error over RM's, a dot per person, a line at
    the geometric mean."""
    rows = len(components)
    figure = canvas.new_figure(24.0 + 8.0 * rows)
    axes = figure.add_subplot()
    for method, table in ratios.items():
        for row, of_row in enumerate(table):
            _draw_gains(axes, method, row, of_row)
    axes.axvline(1.0, color=canvas.SOFT, lw=1.0)
    everything = np.concatenate(list(ratios.values()))
    low = min(0.5, float(np.nanmin(everything))) / 1.15
    high = max(2.0, float(np.nanmax(everything))) * 1.15
    axes.set_xscale("log")
    _ticks(axes, low, high)
    canvas.legend_above(axes)
    axes.set_yticks(range(rows), components)
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_xlabel("error over that of RM (left of 1: follows better)")
    canvas.tidy(axes, grid="x")
    transform = axes.get_yaxis_transform()
    axes.hlines(np.arange(1, rows) - 0.5, 0, 1, transform=transform, color=canvas.FAINT, lw=0.6)
    return figure


def _draw_gains(axes: Axes, method: str, row: int, ratios: np.ndarray) -> None:
    line, people = canvas.line_of(method), len(ratios)
    many = people > canvas.MANY_PEOPLE
    offsets = np.linspace(-_SPREAD, _SPREAD, people) if people > 1 else np.zeros(1)
    style: dict[str, Any] = {"marker": line.marker, "color": line.colour, "edgecolor": "white"}
    style |= {"s": 6, "lw": 0.0} if many else {"s": 24, "lw": 0.5}
    axes.scatter(ratios, row + offsets, rasterized=many, label=method, zorder=2, **style)
    if np.isfinite(ratios).any():
        mean = float(np.exp(np.nanmean(np.log(ratios))))
        axes.plot([mean, mean], [row - 0.38, row + 0.38], color=line.colour, lw=1.8, zorder=3)


# --- signals over time, measured and by method, with bands where their errors are known -----------


@dataclass(frozen=True, eq=False)
class Panel:
    """Signals of one quantity.

    title : what it is, with its unit.
    time_s : (n,).
    signals : label of the method -> (n,), NaN where there are none.
    spreads : label of the method -> (n,) standard deviation, for those drawn with a band.
    """

    title: str
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    spreads: Mapping[str, np.ndarray] = field(default_factory=dict)


@canvas.house_style()
def curves(panels: Sequence[Panel], columns: int, height_mm: float = 38.0) -> Figure:
    """Panels in rows of ``columns``, one legend above; bands are 95 % intervals."""
    rows = -(-len(panels) // columns)
    figure = canvas.new_figure(12.0 + height_mm * rows)
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
    keep = canvas.thinned(len(panel.time_s))
    time = panel.time_s[keep]
    for method, values in panel.signals.items():
        line = canvas.line_of(method)
        axes.plot(time, values[keep], color=line.colour, ls=line.style, lw=line.width, label=method)
        if method in panel.spreads:
            half = Z95 * panel.spreads[method][keep]
            low, high = values[keep] - half, values[keep] + half
            axes.fill_between(time, low, high, color=line.colour, alpha=0.2, lw=0)
    if panel.spreads:
        axes.axhline(0.0, color=canvas.SOFT, lw=0.5, zorder=0)
    axes.set_title(panel.title, fontsize=8, loc="left", pad=3)
    axes.set_xlim(panel.time_s[0], panel.time_s[-1])
    canvas.tidy(axes)
    axes.tick_params(labelsize=7)
