"""What each cause that was found explains of data that it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    BLUE,
    INK,
    ORANGE,
    PURPLE,
    house_style,
    literal,
    new_figure,
    tidy,
)

_LEAST, _ROOM = 5.0, 1.15
_LABEL_WIDTH = 40  # letters in a line
_STYLES = {  # verdict: colour, marker, what the legend says
    "named": (BLUE, "o", "named"),
    "unnamed": (PURPLE, "^", "without a name"),
    "ambiguous": (ORANGE, "D", "one of several"),
}


@dataclass(frozen=True, eq=False)
class CandidateGains:
    """All of the same length, best first; gains and intervals [% of the squared residual]."""

    labels: tuple[str, ...]
    verdicts: tuple[str, ...]
    gain: np.ndarray
    low: np.ndarray
    high: np.ndarray


@house_style()
def candidate_gains(data: CandidateGains) -> Figure:
    """A row per cause; what runs out of the axis ends in an arrow at its edge."""
    rows = len(data.labels)
    labels = [fill(literal(label), _LABEL_WIDTH) for label in data.labels]
    lines = max((label.count("\n") + 1 for label in labels), default=1)
    figure = new_figure(22.0 + rows * max(6.5, 3.5 * lines))
    axes = figure.add_subplot()
    low, high = _edges(data)
    for row in range(rows):
        _draw(axes, data, row, low, high)
    axes.axvline(0.0, color=INK, lw=0.9)
    axes.set_xlim(low, high)
    axes.set_ylim(rows - 0.4, -0.6)
    axes.set_yticks(range(rows), labels)
    axes.set_xlabel("removed in unseen seconds [%]")
    tidy(axes, grid="x")
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside upper left",
        ncols=len(_STYLES),
        frameon=False,
        fontsize=8,
    )
    return figure


def _edges(data: CandidateGains) -> tuple[float, float]:
    """Of the axis: all gains fit, and of the intervals to the left no more than to the right."""
    highs = np.concatenate([data.gain, data.high])
    high = _ROOM * float(np.nanmax(highs, initial=_LEAST))
    low = _ROOM * float(np.nanmin(data.low, initial=-_LEAST))
    return min(max(low, -high), _ROOM * float(np.nanmin(data.gain, initial=0.0))), high


def _draw(axes: Axes, data: CandidateGains, row: int, left: float, right: float) -> None:
    colour, marker, label = _STYLES[data.verdicts[row]]
    low, high = np.clip([data.low[row], data.high[row]], left, right)
    axes.plot([low, high], [row, row], color=colour, lw=1.4)
    if data.low[row] < left:
        axes.plot(left, row, marker="<", color=colour, ms=5)
    if data.high[row] > right:
        axes.plot(right, row, marker=">", color=colour, ms=5)
    if left <= data.gain[row] <= right:
        axes.plot(
            data.gain[row],
            row,
            marker=marker,
            ls="none",
            ms=5.5,
            color=colour,
            label=label,
        )
