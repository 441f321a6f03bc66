"""Errors of the methods per movement, points of each participant joined by a line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    FAINT,
    MANY_PEOPLE,
    house_style,
    legend_above,
    line_of,
    new_figure,
    plain,
    tidy,
)
from bsip_cli.report.words import method_label

_HALF_WIDTH = 0.25


@dataclass(frozen=True, eq=False)
class ErrorsPerTask:
    """Of each method (t, p) over tasks and participants, NaN where not known; ``quantity`` with its
    unit. ``data`` (t,) says of each task whether its data were held out."""

    tasks: tuple[str, ...]
    data: tuple[str, ...]
    errors: Mapping[str, np.ndarray]
    quantity: str


@house_style()
def errors_per_task(data: ErrorsPerTask) -> Figure:
    """Per task the methods side by side, joined by a line for each participant."""
    figure = new_figure(62)
    axes = figure.add_subplot()
    people = next(iter(data.errors.values())).shape[1]
    places = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, len(data.errors))
    many = people > MANY_PEOPLE
    for task in range(len(data.tasks)):
        corners = np.stack(
            [
                np.column_stack([np.full(people, task + place), errors[task]])
                for place, errors in zip(places, data.errors.values(), strict=True)
            ],
            axis=1,
        )
        lines = LineCollection(list(corners), color=FAINT, lw=0.8, zorder=1, rasterized=many)
        axes.add_collection(lines)
        for place, (method, errors) in zip(places, data.errors.items(), strict=True):
            line, x, values = line_of(method), task + place, errors[task]
            axes.scatter(
                np.full(people, x),
                values,
                s=14,
                marker=line.marker,
                color=line.colour,
                lw=0,
                rasterized=many,
                zorder=2,
                label=method_label(method) if task == 0 else None,
            )
            if np.isfinite(values).any():
                axes.hlines(np.nanmean(values), x - 0.1, x + 0.1, color=line.colour, lw=2.0)
    names = [f"{plain(task)}\n({how})" for task, how in zip(data.tasks, data.data, strict=True)]
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.6, len(data.tasks) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel(data.quantity)
    tidy(axes)
    legend_above(axes)
    return figure
