"""The person as the model: bones, markers and the measured ground force, seen obliquely."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from bsip_cli.report.figures.canvas import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    SOFT,
    house_style,
    new_figure,
    plain,
)
from bsip_cli.report.sticks import Pose

_YAW, _PITCH = np.radians(-140.0), np.radians(12.0)  # from the front, from their right
_WIDE_MM, _HIGH_MM = 62.0, 92.0
_MARGIN_M = 0.06
_LONGEST = 30  # letters of a trial's label in a line under the figure
_TILE_M = 0.5
_LIMBS = {"l": ("#9a9a9a", 2.2), "r": (INK, 1.8), "": (INK, 1.8)}


@house_style()
def stick_figure(pose: Pose, trial: str) -> Figure:
    """Left limbs grey, right ones black; the arrow of one body weight is half as long as the
    person is tall."""
    figure = new_figure(_HIGH_MM, _WIDE_MM)
    axes = figure.subplots()
    centre = pose.bones_m[0, 0]
    ground = projected(_tiles(pose.ground_m, centre), centre)
    axes.add_collection(LineCollection(list(ground), colors=FAINT, linewidths=0.6))
    bones = projected(pose.bones_m, centre)
    colours, widths = zip(*(_LIMBS[side] for side in pose.sides), strict=True)
    axes.add_collection(LineCollection(list(bones), colors=colours, linewidths=widths))
    head = projected(pose.head_m, centre)
    axes.add_patch(Circle(tuple(head), pose.head_radius_m, fc="white", ec=INK, lw=1.4))
    markers = projected(pose.markers_m, centre)
    axes.plot(*markers.T, "o", ms=2.6, mfc="white", mec=BLUE, mew=0.8, label="markers")
    points = [bones.reshape(-1, 2), ground.reshape(-1, 2), markers, head[None] + pose.head_radius_m]
    if np.isfinite(pose.force_N).all():
        foot, tip = projected(pose.force_at_m, centre), projected(pose.tip_m(), centre)
        arrow = {"color": GREEN, "lw": 2.2, "arrowstyle": "-|>", "mutation_scale": 12}
        axes.annotate("", tuple(tip), tuple(foot), arrowprops=arrow)
        points += [foot[None], tip[None]]
    everything = np.concatenate(points)
    low, high = everything.min(axis=0) - _MARGIN_M, everything.max(axis=0) + _MARGIN_M
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    force = np.linalg.norm(pose.force_N)
    lines = [plain(trial, _LONGEST) + f", {pose.time_s:.2f} s", "black: right limbs; grey: left"]
    lines += [f"green: measured ground force, {force:.0f} N"] if np.isfinite(force) else []
    figure.supxlabel("\n".join(lines), fontsize=7.5, color=SOFT)
    axes.set_axis_off()
    return figure


def projected(points_m: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    """(..., 2) of points (..., 3) [m]: turned about the vertical, seen from a little above."""
    x, y, z = np.moveaxis(points_m - np.array([centre_m[0], centre_m[1], 0.0]), -1, 0)
    across = -np.sin(_YAW) * x + np.cos(_YAW) * y
    away = np.cos(_YAW) * x + np.sin(_YAW) * y
    return np.stack([across, np.cos(_PITCH) * z + np.sin(_PITCH) * away], axis=-1)


def _tiles(ground_m: float, centre_m: np.ndarray) -> np.ndarray:
    """(n, 2, 3) lines of a floor under the person."""
    steps = _TILE_M * np.arange(-1, 2)
    ends = np.array([steps[0], steps[-1]])
    along = [[(x, y, 0.0) for y in ends] for x in steps]
    across = [[(x, y, 0.0) for x in ends] for y in steps]
    return np.array(along + across) + np.array([centre_m[0], centre_m[1], ground_m])
