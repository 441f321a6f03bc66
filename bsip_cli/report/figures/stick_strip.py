"""A strip of stick figures with the measured ground force, from the side and from behind."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from bsip_cli.report.figures.canvas import GREEN, INK, SOFT, WIDTH_MM, house_style, new_figure
from bsip_cli.report.poses import Poses

_MARGIN_M = 0.22
_COLOURS = {"l": "#9a9a9a", "r": INK, "": INK}
_WIDTHS = {"l": 2.2, "r": 1.3, "": 1.6}
_TALLEST_MM = 40.0
_LABEL_MM = 12.0


@house_style()
def stick_strip(data: Poses) -> Figure:
    """Two rows of stick figures: from the right side, and from behind."""
    slots = _slots(data)
    width, height = slots[-1, 1], _height(data)
    row_mm = min(_TALLEST_MM, height / width * (WIDTH_MM - _LABEL_MM))
    figure = new_figure(2.0 * row_mm + 14.0, row_mm * width / height + _LABEL_MM)
    rows = figure.subplots(2, 1)
    for axes, axis, view in zip(rows, (0, 1), ("from the right", "from behind"), strict=True):
        _draw_row(axes, data, slots, axis)
        axes.set_ylabel(view, fontsize=8, color=SOFT)
        axes.set_ylim(data.ground_m - 0.04 * height, data.ground_m + height)
    for time, (left, right) in zip(data.time_s, slots, strict=True):
        rows[1].text(
            (left + right) / 2,
            data.ground_m - 0.07 * height,
            f"{time:.2f} s",
            ha="center",
            va="top",
            fontsize=8,
        )
    return figure


def _height(data: Poses) -> float:
    tops = [data.bones_m[..., 2].max(), data.head_m[:, 2].max() + data.head_radius_m]
    tips = data.arrow_tips_m()[:, 2]
    if np.isfinite(tips).any():
        tops.append(np.nanmax(tips))
    return float(max(tops)) - data.ground_m + 0.05


def _half_width(data: Poses, k: int) -> float:
    """How far pose ``k`` reaches from its pelvis to either side, in either view."""
    tip = data.arrow_tips_m()[k]
    points = [*data.bones_m[k].reshape(-1, 3), data.head_m[k] + data.head_radius_m]
    points += [p for p in (tip, data.force_m[k]) if np.isfinite(tip).all()]
    return float(np.abs(np.array(points)[:, :2] - data.bones_m[k, 0, 0, :2]).max())


def _slots(data: Poses) -> np.ndarray:
    """(n, 2) left and right edge of the room that each pose gets."""
    halves = np.array([_half_width(data, k) for k in range(len(data.time_s))]) + _MARGIN_M / 2
    edges = np.concatenate([[0.0], np.cumsum(2.0 * halves)])
    return np.stack([edges[:-1], edges[1:]], axis=1)


def _draw_row(axes: Axes, data: Poses, slots: np.ndarray, axis: int) -> None:
    shifts = slots.mean(axis=1) - data.bones_m[:, 0, 0, axis]
    bones = data.bones_m[..., [axis, 2]] + np.stack([shifts, 0.0 * shifts], axis=1)[:, None, None]
    for side in ("l", "", "r"):  # the left side lies behind
        own = bones[:, [s == side for s in data.sides]].reshape(-1, 2, 2)
        axes.add_collection(
            LineCollection(own, colors=_COLOURS[side], linewidths=_WIDTHS[side], capstyle="round")
        )
    for centre, shift in zip(data.head_m, shifts, strict=True):
        axes.add_patch(
            Circle(
                (centre[axis] + shift, centre[2]), data.head_radius_m, fill=False, ec=INK, lw=1.2
            )
        )
    _draw_forces(axes, data, shifts, axis)
    axes.axhline(data.ground_m, color=SOFT, lw=0.8, zorder=0)
    axes.set_xlim(0.0, slots[-1, 1])
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)


def _draw_forces(axes: Axes, data: Poses, shifts: np.ndarray, axis: int) -> None:
    tips = data.arrow_tips_m()
    seen = np.isfinite(tips).all(axis=1)
    if seen.any():
        foot, arrow = data.force_m[seen], (tips - data.force_m)[seen]
        axes.quiver(
            foot[:, axis] + shifts[seen],
            foot[:, 2],
            arrow[:, axis],
            arrow[:, 2],
            color=GREEN,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            units="inches",
            width=0.022,
            headwidth=4.5,
            headlength=5.5,
            headaxislength=5.5,
            minlength=0.0,
            zorder=3,
        )
