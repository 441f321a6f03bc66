"""When each foot stood on the ground and on a plate, and which times are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    BLUE,
    GREEN,
    ORANGE,
    house_style,
    legend_above,
    new_figure,
    runs,
    tidy,
)


@dataclass(frozen=True, eq=False)
class ContactTimeline:
    """All (n,): times [s] and flags."""

    time_s: np.ndarray
    left_on_ground: np.ndarray
    right_on_ground: np.ndarray
    left_on_plate: np.ndarray
    right_on_plate: np.ndarray
    valid: np.ndarray


@house_style()
def contact_timeline(data: ContactTimeline) -> Figure:
    """Three bars over time: left foot, right foot, compared."""
    figure = new_figure(34)
    axes = figure.add_subplot()
    feet = (
        (2, data.left_on_ground, data.left_on_plate),
        (1, data.right_on_ground, data.right_on_plate),
    )
    for row, on_ground, on_plate in feet:
        _bars(axes, data.time_s, on_ground & on_plate, row, "on a plate", color=BLUE)
        _bars(
            axes,
            data.time_s,
            on_ground & ~on_plate,
            row,
            "on the ground beside the plates",
            facecolor="white",
            edgecolor=ORANGE,
            hatch="////",
            linewidth=0.8,
        )
    _bars(axes, data.time_s, data.valid, 0, "forces compared", color=GREEN)
    axes.set_yticks([2, 1, 0], ["left foot", "right foot", "compared"])
    axes.set_ylim(-0.5, 2.5)
    axes.set_xlim(data.time_s[0], data.time_s[-1])
    axes.set_xlabel("time [s]")
    tidy(axes, grid="x")
    legend_above(axes)
    return figure


def _bars(axes: Axes, time_s: np.ndarray, flags: np.ndarray, row: int, label: str, **look) -> None:
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    spans = [(time_s[i], time_s[j - 1] - time_s[i] + step) for i, j in runs(flags)]
    if spans:
        axes.broken_barh(spans, (row - 0.35, 0.7), label=label, **look)
