"""The error budget as bars: each component's error, cut into what makes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    house_style,
    new_figure,
    tidy,
)

_SKY, _YELLOW, _VERMILION = "#56B4E9", "#F0E442", "#8C510A"  # Okabe and Ito, and a brown
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, _SKY, _YELLOW, _VERMILION)
_LEGEND: dict[str, Any] = {"ncols": 2, "frameon": False, "fontsize": 7.5}
_FIXED = {"noise": ("#ffffff", ""), "unknown": ("#ffffff", "////"), "all others": (FAINT, "")}


@dataclass(frozen=True)
class Bar:
    """A component's error in words, and shares [%] that add up to 100, each with its label."""

    label: str
    shares: tuple[tuple[str, float], ...]


@house_style()
def error_bars(bars: Sequence[Bar]) -> Figure:
    """One bar each; what makes the error smaller stands left of zero. Hatched: unknown."""
    figure = new_figure(24.0 + 7.0 * len(bars))
    axes = figure.add_subplot()
    labels = list(dict.fromkeys(label for bar in bars for label, _ in bar.shares))
    ordinary = [label for label in labels if label not in _FIXED]
    for label in (*ordinary, *(one for one in _FIXED if one in labels)):
        colour, hatch = _FIXED.get(label) or _drawn(ordinary.index(label))
        for row, bar in enumerate(bars):
            share, start = _place(bar, label, (*ordinary, *_FIXED))
            axes.barh(
                row,
                share,
                left=start,
                height=0.7,
                color=colour,
                hatch=hatch,
                edgecolor=INK,
                linewidth=0.5,
                label=label if row == 0 else None,
            )
    axes.axvline(0.0, color=INK, lw=0.9)
    axes.set_yticks(np.arange(len(bars)), [bar.label for bar in bars])
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlabel("share of the squared error [%]")
    tidy(axes, grid="x")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", **_LEGEND)
    return figure


def _drawn(place: int) -> tuple[str, str]:
    """Colour and hatch of a cause, by its place: those that come late are dotted."""
    return _COLOURS[place % len(_COLOURS)], "" if place < len(_COLOURS) else "..."


def _place(bar: Bar, label: str, order: Sequence[str]) -> tuple[float, float]:
    """Share of a label and where its piece begins: behind all before it of the same sign."""
    shares = dict(bar.shares)
    share = shares.get(label, 0.0)
    before = (shares.get(one, 0.0) for one in order[: list(order).index(label)])
    return share, sum(x for x in before if x * share > 0)
