"""How far the markers lie from the model over the time of one trial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    BLUE,
    SOFT,
    house_style,
    legend_above,
    new_figure,
    thinned,
    tidy,
)


@dataclass(frozen=True, eq=False)
class ResidualOverTime:
    """All (n,): time [s], RMS over the markers [mm], the frame's worst marker [mm]."""

    time_s: np.ndarray
    rms_mm: np.ndarray
    worst_mm: np.ndarray


@house_style()
def residual_over_time(data: ResidualOverTime) -> Figure:
    """Two curves: all markers, and the worst one of each frame."""
    keep = thinned(len(data.time_s))
    figure = new_figure(38)
    axes = figure.add_subplot()
    axes.plot(data.time_s[keep], data.worst_mm[keep], color=SOFT, lw=0.8, label="worst marker")
    axes.plot(data.time_s[keep], data.rms_mm[keep], color=BLUE, lw=1.3, label="RMS of all markers")
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(data.time_s[0], data.time_s[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("residual [mm]")
    tidy(axes)
    legend_above(axes)
    return figure
