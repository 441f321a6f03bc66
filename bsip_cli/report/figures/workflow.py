"""The way of the data as boxes and arrows, as figure 2 of Hansen 2017: from the stages themselves."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from bsip_cli.report.figures.canvas import BLUE, INK, SOFT, house_style, new_figure

_ROW_MM, _BOX_MM, _WIDE_MM, _GAP_MM = 21.0, 13.0, 76.0, 6.0
_LETTERS = 50  # of a summary in one line


@dataclass(frozen=True)
class Step:
    """A stage: for whom it runs, what it does, and the stages whose results it reads."""

    name: str
    levels: tuple[str, ...]
    summary: str
    after: tuple[str, ...]


@house_style()
def workflow(steps: Sequence[Step]) -> Figure:
    """Each stage below those that it needs; arrows only where no other stage lies between."""
    rows = _rows(steps)
    height = _ROW_MM * len(rows)
    width = max(len(row) for row in rows) * (_WIDE_MM + _GAP_MM)
    figure = new_figure(height, width)
    axes = figure.subplots()
    places = _places(steps, rows)
    for step in steps:
        _box(axes, step, *places[step.name])
        for before in _needed(step, steps):
            _arrow(axes, places[before], places[step.name])
    axes.set_xlim(-width / 2, width / 2)
    axes.set_ylim(-height + _ROW_MM - _BOX_MM / 2 - 1, _BOX_MM / 2 + 1)
    axes.set_axis_off()
    return figure


def _rows(steps: Sequence[Step]) -> list[list[Step]]:
    """The steps by how many others must come before."""
    depth: dict[str, int] = {}
    for step in steps:
        depth[step.name] = max((depth[name] + 1 for name in step.after), default=0)
    return [
        [step for step in steps if depth[step.name] == k] for k in range(max(depth.values()) + 1)
    ]


def _places(steps: Sequence[Step], rows: list[list[Step]]) -> dict[str, tuple[float, float]]:
    """Middle of each box: below those that it needs; side by side in their order if several."""
    places: dict[str, tuple[float, float]] = {}
    for depth, row in enumerate(rows):
        above = {step.name: _mean_x(places, _needed(step, steps)) for step in row}
        for k, step in enumerate(sorted(row, key=lambda one: above[one.name])):
            beside = (k - (len(row) - 1) / 2) * (_WIDE_MM + _GAP_MM)
            x = above[step.name] if len(row) == 1 else beside
            places[step.name] = (x, -_ROW_MM * depth)
    return places


def _mean_x(places: dict[str, tuple[float, float]], names: list[str]) -> float:
    return sum(places[name][0] for name in names) / max(len(names), 1)


def _needed(step: Step, steps: Sequence[Step]) -> list[str]:
    """Those before it that no other one before it needs."""
    after = {one.name: set(one.after) for one in steps}
    implied = {further for name in step.after for further in _all_before(name, after)}
    return [name for name in step.after if name not in implied]


def _all_before(name: str, after: dict[str, set[str]]) -> set[str]:
    found = set(after[name])
    for one in after[name]:
        found |= _all_before(one, after)
    return found


def _box(axes: Axes, step: Step, x: float, y: float) -> None:
    left, low = x - _WIDE_MM / 2, y - _BOX_MM / 2
    shape = "round,pad=0,rounding_size=1.5"
    axes.add_patch(
        FancyBboxPatch((left, low), _WIDE_MM, _BOX_MM, boxstyle=shape, fc="white", ec=INK, lw=0.9)
    )
    top = y + _BOX_MM / 2 - 1.2
    axes.text(left + 2, top, step.name, fontsize=8.5, weight="bold", va="top")
    levels = " and ".join(f"per {level}" for level in step.levels)
    axes.text(x + _WIDE_MM / 2 - 2, top, levels, fontsize=7, color=BLUE, va="top", ha="right")
    words = textwrap.fill(step.summary, _LETTERS)
    axes.text(left + 2, top - 4.2, words, fontsize=7, color=SOFT, va="top", linespacing=1.15)


def _arrow(axes: Axes, before: tuple[float, float], after: tuple[float, float]) -> None:
    start, end = (before[0], before[1] - _BOX_MM / 2), (after[0], after[1] + _BOX_MM / 2)
    style = {"arrowstyle": "-|>", "color": INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style)
