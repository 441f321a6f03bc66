"""How far identification moves each segment's centre of mass from the table's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bsip_cli.report.figures.canvas import BLUE, ORANGE, SOFT, house_style, new_figure, tidy
from bsip_cli.statistics.samples import Z95

DECIDED = 0.5  # a share above it: more data than table
LEAST_SPAN_MM = 2.0
_AXES = ("forward (X)", "along the segment, up (Y)", "to the right (Z)")


@dataclass(frozen=True, eq=False)
class ComDifferences:
    """(s, 3) over segments and axes: OM - RM and its standard deviation [mm], data share 0..1."""

    segments: tuple[str, ...]
    difference_mm: np.ndarray
    sd_mm: np.ndarray
    data_share: np.ndarray


@house_style()
def com_differences(data: ComDifferences) -> Figure:
    """One panel per axis; full points where the data decided, empty ones where the table did."""
    rows = np.arange(len(data.segments))
    figure = new_figure(18.0 + 5.2 * len(rows))
    panels = figure.subplots(1, 3, sharey=True)
    for axis, (axes, title) in enumerate(zip(panels, _AXES, strict=True)):
        x, spread = data.difference_mm[:, axis], np.nan_to_num(Z95 * data.sd_mm[:, axis])
        axes.axvline(0.0, color=ORANGE, lw=1.2, ls="--")
        axes.errorbar(x, rows, xerr=spread, fmt="none", ecolor=SOFT, elinewidth=1.0, capsize=2)
        decided = data.data_share[:, axis] >= DECIDED
        axes.scatter(x[decided], rows[decided], s=20, color=BLUE, zorder=3)
        axes.scatter(x[~decided], rows[~decided], s=20, facecolor="white", edgecolor=BLUE, zorder=3)
        axes.set_title(title, fontsize=8.5)
        axes.set_xlabel("OM − RM [mm]")
        low, high = axes.get_xlim()
        axes.set_xlim(min(low, -LEAST_SPAN_MM), max(high, LEAST_SPAN_MM))
        axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        tidy(axes, grid="both")
        if axis:
            axes.tick_params(axis="y", length=0)
    panels[0].set_yticks(rows, data.segments)
    panels[0].set_ylim(len(rows) - 0.4, -0.6)
    return figure
