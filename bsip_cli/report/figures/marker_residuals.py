"""How far each marker lies from the model, over all trials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import BLUE, INK, house_style, new_figure, plain, tidy


@dataclass(frozen=True, eq=False)
class MarkerResiduals:
    """RMS residual per marker (m,) [mm], and over all of them [mm]."""

    markers: tuple[str, ...]
    rms_mm: np.ndarray
    overall_mm: float


@house_style()
def marker_residuals(data: MarkerResiduals) -> Figure:
    """One bar per marker, the largest first; a line where all markers together lie."""
    order = np.argsort(-data.rms_mm, kind="stable")
    places = np.arange(len(order))
    figure = new_figure(58)
    axes = figure.add_subplot()
    axes.bar(places, data.rms_mm[order], width=0.72, color=BLUE)
    axes.axhline(data.overall_mm, color=INK, lw=1.0, ls="--")
    axes.annotate(
        f"all markers {data.overall_mm:.1f} mm",
        (len(order) - 0.5, data.overall_mm),
        xytext=(0, 3),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=8,
    )
    axes.set_xticks(places, [plain(data.markers[k]) for k in order], rotation=90)
    axes.set_xlim(-0.7, len(order) - 0.3)
    axes.set_ylabel("RMS residual [mm]")
    tidy(axes)
    axes.tick_params(axis="x", labelsize=7 if len(order) <= 45 else 5)
    return figure
