"""Bars: errors cut into what makes them, residuals of markers, masses of segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    INK,
    ORANGE,
    SOFT,
    house_style,
    legend_above,
    line_of,
    new_figure,
    plain,
    tidy,
)
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.statistics.samples import Z95

COLOURS = (BLUE, "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#009E73", FAINT, "#8C510A")
"""As those of the first page's bar: Okabe and Ito, told apart by the colour-blind."""
_FIXED = {"noise": ("#ffffff", ""), "unknown": ("#ffffff", "////")}
_TICKS_KG = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


@dataclass(frozen=True)
class Whole:
    """An error in words, and shares [%] that add up to 100, each with its label."""

    label: str
    shares: tuple[tuple[str, float], ...]


@house_style()
def error_bars(bars: Sequence[Whole]) -> Figure:
    """One bar each; what makes the error smaller stands left of zero. Hatched: unknown."""
    figure = new_figure(24.0 + 6.0 * len(bars))
    axes = figure.add_subplot()
    labels = list(dict.fromkeys(label for bar in bars for label, _ in bar.shares))
    ordinary = [label for label in labels if label not in _FIXED]
    order = (*ordinary, *(one for one in _FIXED if one in labels))
    ends = np.zeros((len(bars), 2))  # left of zero, right of it
    for label in order:
        colour, hatch = _FIXED.get(label) or (COLOURS[ordinary.index(label) % len(COLOURS)], "")
        shares = np.array([dict(bar.shares).get(label, 0.0) for bar in bars])
        side = (shares > 0).astype(int)
        start = ends[range(len(bars)), side]
        style: dict[str, Any] = {"color": colour, "hatch": hatch, "edgecolor": INK, "lw": 0.5}
        axes.barh(range(len(bars)), shares, left=start, height=0.7, label=label, **style)
        ends[range(len(bars)), side] += shares
    axes.axvline(0.0, color=INK, lw=0.9)
    axes.set_yticks(range(len(bars)), [bar.label for bar in bars])
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlabel("share of the squared error [%]")
    tidy(axes, grid="x")
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2, frameon=False, fontsize=7.5)
    return figure


@house_style()
def marker_bars(markers: Sequence[str], rms_mm: np.ndarray, limit_mm: float) -> Figure:
    """A bar per marker; the line is the limit."""
    figure = new_figure(52)
    axes = figure.add_subplot()
    axes.bar(range(len(markers)), rms_mm, color=np.where(rms_mm > limit_mm, ORANGE, BLUE))
    axes.axhline(limit_mm, color=INK, lw=0.9, ls="--")
    axes.set_xticks(range(len(markers)), [plain(name) for name in markers], rotation=90)
    axes.set_xlim(-0.6, len(markers) - 0.4)
    axes.set_ylabel("distance [mm]")
    tidy(axes)
    axes.tick_params(axis="x", labelsize=6.5)
    return figure


@dataclass(frozen=True, eq=False)
class SegmentMasses:
    """All (s,) over the segments; masses and standard deviations [kg], in 0..1 how much the data
    decide."""

    segments: tuple[str, ...]
    rm_kg: np.ndarray
    rm_mass_kg: np.ndarray
    om_kg: np.ndarray
    om_sd_kg: np.ndarray
    data_share: np.ndarray


@house_style()
def segment_masses(data: SegmentMasses) -> Figure:
    """Three panels over the segments: masses, OM - RM with 95 % intervals, what the data decide."""
    rows = np.arange(len(data.segments))
    figure = new_figure(22.0 + 4.8 * len(rows))
    masses, differences, shares = figure.subplots(1, 3, sharey=True, width_ratios=(3, 3, 1.5))
    positive = np.where(data.om_kg > 0.0, data.om_kg, np.nan)
    own = ((RM, data.rm_kg, 24), (RM_MASS, data.rm_mass_kg, 9), (OM, positive, 16))
    for method, kg, size in own:
        line = line_of(method)
        style = {"facecolor": "white" if method == RM else line.colour, "edgecolor": line.colour}
        masses.scatter(kg, rows, marker=line.marker, s=size, label=method, **style)
    masses.set_xscale("log")
    both = np.concatenate([data.rm_kg, positive])
    low, high = np.nanmin(both) / 1.35, np.nanmax(both) * 1.35
    masses.set_xlim(low, high)
    ticks = [t for t in _TICKS_KG if low <= t <= high]
    masses.xaxis.set_major_locator(FixedLocator(ticks))
    masses.xaxis.set_minor_locator(NullLocator())
    masses.set_xticks(ticks, [f"{t:g}" for t in ticks])
    masses.set_xlabel("mass [kg] (log scale)")
    legend_above(masses)
    differences.axvline(0.0, color=ORANGE, lw=1.2, ls="--")
    spread = np.nan_to_num(Z95 * data.om_sd_kg)
    dots: dict[str, Any] = {
        "fmt": "o",
        "ms": 4,
        "color": BLUE,
        "ecolor": SOFT,
        "elinewidth": 1.1,
        "capsize": 2,
    }
    differences.errorbar(data.om_kg - data.rm_kg, rows, xerr=spread, **dots)
    differences.set_xlabel("OM − RM [kg], 95 % interval")
    shares.barh(rows, 100.0, height=0.55, color=FAINT)
    shares.barh(rows, np.nan_to_num(100.0 * data.data_share), height=0.55, color=BLUE)
    shares.set_xlim(0.0, 100.0)
    shares.set_xlabel("data decide [%]")
    for axes in (masses, differences, shares):
        tidy(axes, grid="both")
    masses.set_yticks(rows, data.segments)
    masses.set_ylim(len(rows) - 0.4, -0.6)
    return figure
