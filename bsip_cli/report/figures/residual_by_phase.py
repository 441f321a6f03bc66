"""How large the residual is in each phase of the movement, before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import BLUE, ORANGE, SOFT, house_style, new_figure, tidy

_COLUMNS = 2
_STYLES = (("o", "white", BLUE), ("D", ORANGE, ORANGE))  # marker, face, edge


@dataclass(frozen=True, eq=False)
class ResidualByPhase:
    """RMS of the residual.

    Attributes
    ----------
    phases : names (p,), those that occur.
    rms : name of the component, with its unit -> label of the method -> (p,).
    """

    phases: tuple[str, ...]
    rms: Mapping[str, Mapping[str, np.ndarray]]


@house_style()
def residual_by_phase(data: ResidualByPhase) -> Figure:
    """A panel per component, a row per phase; a line joins before and after."""
    lines = -(-len(data.rms) // _COLUMNS)
    figure = new_figure(12.0 + lines * (11.0 + 4.6 * len(data.phases)))
    panels = figure.subplots(lines, _COLUMNS, squeeze=False, sharey=True)
    for axes, (name, methods) in zip(panels.flat, data.rms.items(), strict=False):
        _panel(axes, methods)
        axes.set_title(name, fontsize=8, loc="left", pad=3)
    for axes in panels.flat[len(data.rms) :]:
        axes.set_visible(False)
    panels[0, 0].set_yticks(range(len(data.phases)), data.phases)
    panels[0, 0].set_ylim(len(data.phases) - 0.5, -0.5)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=2, frameon=False, fontsize=8)
    return figure


def _panel(axes: Axes, methods: Mapping[str, np.ndarray]) -> None:
    values = list(methods.values())
    rows = np.arange(len(values[0]))
    if len(values) > 1:
        axes.hlines(rows, values[0], values[1], color=SOFT, lw=1.0)
    for (label, rms), (marker, face, edge) in zip(methods.items(), _STYLES, strict=False):
        axes.plot(rms, rows, ls="none", marker=marker, ms=5, mfc=face, mec=edge, label=label)
    axes.set_xlim(0.0, 1.06 * float(np.nanmax(values, initial=0.0)) or 1.0)
    tidy(axes, grid="x")
    axes.tick_params(labelsize=7.5)
