"""One signal over time, measured and simulated (Hansen 2017, Fig. 3)."""

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
class MethodsOverTime:
    """A signal per method on a common clock.

    Attributes
    ----------
    time_s : (n,).
    signals : label of the method -> (n,) values, NaN where there are none.
    quantity : what it is, with its unit: the label of the axis.
    """

    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    quantity: str


@house_style()
def methods_over_time(data: MethodsOverTime) -> Figure:
    """Measured wide and grey, the methods over it."""
    keep = thinned(len(data.time_s))
    figure = new_figure(58)
    axes = figure.add_subplot()
    for method, values in data.signals.items():
        line = line_of(method)
        axes.plot(
            data.time_s[keep],
            values[keep],
            color=line.colour,
            ls=line.style,
            lw=line.width,
            label=method,
        )
    axes.set_xlim(data.time_s[0], data.time_s[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel(data.quantity)
    tidy(axes)
    legend_above(axes, columns=5)
    return figure
