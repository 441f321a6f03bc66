"""Segment masses of table and identification, their difference, and what the data decided."""

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
    SOFT,
    house_style,
    legend_above,
    line_of,
    new_figure,
    tidy,
)
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.statistics.samples import Z95

_TICKS_KG = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


@dataclass(frozen=True, eq=False)
class SegmentMasses:
    """All (s,) over the segments; masses and standard deviations [kg], shares in 0..1."""

    segments: tuple[str, ...]
    rm_kg: np.ndarray
    rm_mass_kg: np.ndarray
    om_kg: np.ndarray
    om_sd_kg: np.ndarray
    data_share: np.ndarray


@house_style()
def segment_masses(data: SegmentMasses) -> Figure:
    """Three panels side by side: masses, differences with 95 % intervals, data shares."""
    rows = np.arange(len(data.segments))
    figure = new_figure(22.0 + 5.2 * len(rows))
    masses, differences, shares = figure.subplots(1, 3, sharey=True, width_ratios=(3, 3, 1.5))
    _draw_masses(masses, data, rows)
    _draw_differences(differences, data, rows)
    _draw_shares(shares, data, rows)
    masses.set_yticks(rows, data.segments)
    masses.set_ylim(len(rows) - 0.4, -0.6)
    for axes in (differences, shares):
        axes.tick_params(axis="y", length=0)
    return figure


def _draw_masses(axes: Axes, data: SegmentMasses, rows: np.ndarray) -> None:
    positive = np.where(data.om_kg > 0.0, data.om_kg, np.nan)
    axes.scatter(
        data.rm_kg, rows, marker="s", s=26, facecolor="white", edgecolor=ORANGE, lw=1.4, label=RM
    )
    for method, masses_kg, size in ((RM_MASS, data.rm_mass_kg, 9), (OM, positive, 16)):
        line = line_of(method)
        axes.scatter(
            masses_kg, rows, marker=line.marker, s=size, color=line.colour, label=method, zorder=3
        )
    axes.set_xscale("log")
    both = np.concatenate([data.rm_kg, positive])
    low, high = np.nanmin(both) / 1.35, np.nanmax(both) * 1.35
    axes.set_xlim(low, high)
    ticks = [t for t in _TICKS_KG if low <= t <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.set_xlabel("mass [kg] (log scale)")
    tidy(axes, grid="both")
    legend_above(axes)


def _draw_differences(axes: Axes, data: SegmentMasses, rows: np.ndarray) -> None:
    spread = np.nan_to_num(Z95 * data.om_sd_kg)
    axes.axvline(0.0, color=ORANGE, lw=1.2, ls="--")
    axes.errorbar(
        data.om_kg - data.rm_kg,
        rows,
        xerr=spread,
        fmt="o",
        ms=4,
        color=BLUE,
        ecolor=SOFT,
        elinewidth=1.1,
        capsize=2,
    )
    axes.set_xlabel("OM − RM [kg]")
    axes.set_title("difference, 95 % interval", fontsize=8.5)
    tidy(axes, grid="both")


def _draw_shares(axes: Axes, data: SegmentMasses, rows: np.ndarray) -> None:
    axes.barh(rows, 100.0, height=0.55, color=FAINT)
    axes.barh(rows, np.nan_to_num(100.0 * data.data_share), height=0.55, color=BLUE)
    for row, share in zip(rows, data.data_share, strict=True):
        text = f"{100.0 * share:.0f}" if np.isfinite(share) else "not known"
        axes.text(104.0, row, text, va="center", fontsize=7.5, color=INK)
    axes.set_xlim(0.0, 135.0)
    axes.set_xticks([0, 50, 100])
    axes.set_xlabel("data share [%]")
    axes.set_title("decided by data", fontsize=8.5)
    tidy(axes, grid="")
