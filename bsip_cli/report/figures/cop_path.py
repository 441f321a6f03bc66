"""The path of the centre of pressure seen from above, measured and simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    house_style,
    legend_above,
    line_of,
    new_figure,
    thinned,
    tidy,
)


@dataclass(frozen=True, eq=False)
class CopPath:
    """Per method (n, 2): to the right and forward [mm]."""

    paths_mm: Mapping[str, np.ndarray]


@house_style()
def cop_path(data: CopPath) -> Figure:
    """The paths at one scale in both directions."""
    figure = new_figure(88, width_mm=120)
    axes = figure.add_subplot()
    for method, path in data.paths_mm.items():
        line = line_of(method)
        keep = thinned(len(path))
        axes.plot(
            path[keep, 0],
            path[keep, 1],
            color=line.colour,
            ls=line.style,
            lw=line.width,
            label=method,
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("to the right [mm]")
    axes.set_ylabel("forward [mm]")
    tidy(axes, grid="both")
    legend_above(axes)
    return figure
