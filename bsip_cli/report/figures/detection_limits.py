"""How small each cause might have been and still been found, against sizes that labs meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from bsip_cli.report.figures.canvas import BLUE, FAINT, INK, house_style, new_figure, tidy

_LEFT, _RIGHT = 0.08, 40.0  # of the axis: what lies beyond ends in an arrow
_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20)


@dataclass(frozen=True, eq=False)
class DetectionLimits:
    """All (c,), a cause each; sizes over the least that labs meet.

    Attributes
    ----------
    causes, words : what it is; its limits and usual sizes with units.
    best, worst : limit where the cause shows best, and where worst.
    usual : largest usual size.
    """

    causes: tuple[str, ...]
    words: tuple[str, ...]
    best: np.ndarray
    worst: np.ndarray
    usual: np.ndarray


@house_style()
def detection_limits(data: DetectionLimits) -> Figure:
    """A bar per cause from its best place to its worst; grey: sizes that labs meet."""
    rows = np.arange(len(data.causes))
    figure = new_figure(16.0 + 5.6 * len(rows))
    axes = figure.add_subplot()
    axes.set_xscale("log")
    axes.set_xlim(_LEFT, _RIGHT)
    axes.barh(rows, data.usual - 1.0, left=1.0, height=0.72, color=FAINT)
    best, worst = (np.clip(x, _LEFT * 1.1, _RIGHT * 0.9) for x in (data.best, data.worst))
    axes.hlines(rows, best, worst, color=BLUE, lw=2.0)
    axes.plot(best, rows, ls="none", marker="o", ms=5, color=BLUE)
    beyond = data.worst > _RIGHT
    axes.plot(worst[beyond], rows[beyond], ls="none", marker=">", ms=5, color=BLUE)
    axes.axvline(1.0, color=INK, lw=0.9)
    axes.xaxis.set_major_locator(FixedLocator(_TICKS))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(_TICKS, [f"{t:g}" for t in _TICKS])
    axes.set_yticks(rows, data.causes)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("limit over the least usual size (log scale)")
    tidy(axes, grid="x")
    right = axes.secondary_yaxis("right")
    right.set_yticks(rows, data.words)
    right.tick_params(labelsize=7.5, length=0)
    right.spines["right"].set_visible(False)
    return figure
