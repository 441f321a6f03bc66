"""The person as the model: bones, markers and the measured ground force, seen obliquely.

As figure 1 of Hansen 2017.
"""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from bsip_cli.report.figures.canvas import BLUE, FAINT, GREEN, INK, SOFT, house_style, new_figure
from bsip_cli.report.poses import Poses

_YAW, _PITCH = np.radians(-140.0), np.radians(12.0)  # from the front, from their right
_SIZE_MM = 95.0
_LIMB_PT = 7.0
_MARGIN_M = 0.08
_TILE_M = 0.5


@house_style()
def body_model(poses: Poses, k: int) -> Figure:
    """Pose number k."""
    figure = new_figure(1.25 * _SIZE_MM, _SIZE_MM)
    axes = figure.subplots()
    centre = poses.bones_m[k, 0, 0].copy()
    bones = projected(poses.bones_m[k], centre)
    ground = projected(_tiles(poses.ground_m, centre), centre)
    axes.add_collection(LineCollection(list(ground), colors=FAINT, linewidths=0.6))
    axes.add_collection(
        LineCollection(list(bones), colors="#dcdcdc", linewidths=_LIMB_PT, capstyle="round")
    )
    axes.add_collection(LineCollection(list(bones), colors=INK, linewidths=1.1, capstyle="round"))
    head = projected(poses.head_m[k], centre)
    axes.add_patch(Circle(tuple(head), poses.head_radius_m, fc="#dcdcdc", ec=INK, lw=1.1))
    markers = projected(poses.markers_m[k], centre)
    axes.plot(*markers.T, "o", ms=3.2, mfc="white", mec=BLUE, mew=1.0, label="markers")
    foot, tip = (projected(x[k], centre) for x in (poses.force_m, poses.arrow_tips_m()))
    points = [bones.reshape(-1, 2), markers, head[None] + poses.head_radius_m]
    if np.isfinite(tip).all():
        arrow = {"color": GREEN, "lw": 2.2, "arrowstyle": "-|>", "mutation_scale": 12}
        axes.annotate("", tuple(tip), tuple(foot), arrowprops=arrow)
        size = float(np.linalg.norm(poses.forces_N[k]))
        label = axes.annotate(f"{size:.0f} N", tuple(tip), (8, 4), textcoords="offset points")
        label.set(color=GREEN, fontsize=8.5, bbox={"fc": "white", "ec": "none", "pad": 1.0})
        points += [foot[None], tip[None]]
    everything = np.concatenate(points)
    low, high = everything.min(axis=0) - _MARGIN_M, everything.max(axis=0) + _MARGIN_M
    axes.set_xlim(low[0], high[0] + _MARGIN_M)
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.legend(loc="lower left", frameon=False, fontsize=8, labelcolor=SOFT)
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
