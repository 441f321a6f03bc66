"""Errors of RM and OM per movement, one pair of points per participant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    MANY_PEOPLE,
    ORANGE,
    house_style,
    legend_above,
    new_figure,
    plain,
    tidy,
)


@dataclass(frozen=True, eq=False)
class ErrorsPerTask:
    """(t, p) over tasks and participants, NaN where not known; ``quantity`` with its unit.

    ``data`` (t,) says of each task whether its data were held out.
    """

    tasks: tuple[str, ...]
    data: tuple[str, ...]
    rm: np.ndarray
    om: np.ndarray
    quantity: str


@house_style()
def errors_per_task(data: ErrorsPerTask) -> Figure:
    """Per task RM and OM side by side, joined by a line for each participant."""
    figure = new_figure(62)
    axes = figure.add_subplot()
    people = data.rm.shape[1]
    many = people > MANY_PEOPLE
    for task in range(len(data.tasks)):
        left, right = task - 0.18, task + 0.18
        ends = np.stack(
            [
                np.column_stack([np.full(people, x), errors[task]])
                for x, errors in ((left, data.rm), (right, data.om))
            ],
            axis=1,
        )
        lines = LineCollection(list(ends), color=FAINT, lw=0.8, zorder=1, rasterized=many)
        axes.add_collection(lines)
        for x, values, colour, marker, label in (
            (left, data.rm[task], ORANGE, "s", "RM (table)"),
            (right, data.om[task], BLUE, "o", "OM (identified)"),
        ):
            axes.scatter(
                np.full(len(values), x),
                values,
                s=14,
                marker=marker,
                color=colour,
                lw=0,
                rasterized=many,
                zorder=2,
                label=label if task == 0 else None,
            )
            if np.isfinite(values).any():
                axes.hlines(np.nanmean(values), x - 0.12, x + 0.12, color=colour, lw=2.0)
    names = [f"{plain(task)}\n({how})" for task, how in zip(data.tasks, data.data, strict=True)]
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.6, len(data.tasks) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel(data.quantity)
    tidy(axes)
    legend_above(axes)
    return figure
