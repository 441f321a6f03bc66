"""Which segment's parameters make RM's error in the centre of pressure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import BLUE, INK, ORANGE, house_style, new_figure, tidy

_GROUPS = (  # colour and hatch: told apart in grey too
    ("mass", ORANGE, ""),
    ("centre of mass", BLUE, "////"),
    ("inertia", "white", "...."),
)


@dataclass(frozen=True, eq=False)
class AttributionBars:
    """Segments in words; per component (its name in words) shares (s, 3) [%] by group."""

    segments: tuple[str, ...]
    shares: Mapping[str, np.ndarray]


@house_style()
def attribution_bars(data: AttributionBars) -> Figure:
    """A panel per component: to the right what goes with OM's parameters, to the left what comes."""
    rows = np.arange(len(data.segments))
    figure = new_figure(20.0 + 5.2 * len(rows))
    panels = figure.subplots(1, len(data.shares), sharey=True, squeeze=False)[0]
    for axes, (name, shares) in zip(panels, data.shares.items(), strict=True):
        ahead, behind = np.zeros(len(rows)), np.zeros(len(rows))
        for (label, colour, hatch), values in zip(_GROUPS, shares.T, strict=True):
            start = np.where(values >= 0.0, ahead, behind)
            axes.barh(
                rows,
                values,
                left=start,
                height=0.7,
                color=colour,
                hatch=hatch,
                edgecolor=INK,
                lw=0.5,
                label=label,
            )
            ahead += np.maximum(values, 0.0)
            behind += np.minimum(values, 0.0)
        axes.axvline(0.0, color=INK, lw=0.9)
        axes.set_xlabel("of RM's squared error [%]")
        axes.set_title(name, fontsize=8.5)
        tidy(axes, grid="x")
    panels[0].set_yticks(rows, data.segments)
    panels[0].set_ylim(len(rows) - 0.4, -0.6)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=3, frameon=False, fontsize=8)
    return figure
