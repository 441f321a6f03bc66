"""Bars, dots per person, and curves over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Bar
from bsip_cli.report.budget import NOISE, UNKNOWN, Fill, Piece, fills
from bsip_cli.report.figures import canvas
from bsip_cli.report.figures.canvas import BELOW_WITH_TITLE, MM, WIDTH, Axes, Figure
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.statistics.samples import Z95

_TOP, _RIGHT, _BESIDE = 6.0, 8.0, 10.0  # room at the edges, and between labels and axes

# --- bars: errors cut into what makes them, residuals of markers, masses of segments ---------------

_ROW = 17.0  # from one bar to the next
_BAR = 0.7  # of that, its height
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


def error_bars(bars: Sequence[Bar], order: Sequence[Piece]) -> Figure:
    """One bar each; what makes the error smaller stands left of zero. Hatched: unknown. ``order``:
    pieces whose order, and hatching of faults, are those of the first page's bar."""
    shown = {piece.label for bar in bars for piece in bar.pieces}
    fill = fills([*order, *(piece for bar in bars for piece in bar.pieces)])
    last = (NOISE, UNKNOWN)
    labels = [one for one in (*(x for x in fill if x not in last), *last) if one in shown]
    shares = np.array(
        [[sum(p.share for p in bar.pieces if p.label == x) for bar in bars] for x in labels]
    )
    ends = np.array([np.minimum(shares, 0.0).sum(axis=0), np.maximum(shares, 0.0).sum(axis=0)])
    columns = canvas.columns_for(labels, 2, 7.5)
    top = _TOP + canvas.LEGEND_ROW * -(-len(labels) // columns) + 4.0
    figure = Figure(top + _ROW * len(bars) + BELOW_WITH_TITLE)
    left = canvas.width_of(bar.title for bar in bars) + _BESIDE
    place = left, top, WIDTH - left - _RIGHT, _ROW * len(bars)
    axes = Axes(figure, *place, (1.05 * ends.min(), 1.05 * ends.max()), (len(bars) - 0.5, -0.5))
    titles = {float(k): bar.title for k, bar in enumerate(bars)}
    axes.frame(canvas.ticks(*axes.x, 8), titles, "x", x_title="share of the squared error [%]")
    ends = np.zeros((2, len(bars)))  # left of zero, right of it, so far
    for label, of_label in zip(labels, shares, strict=True):
        for row, share in enumerate(of_label):
            if share != 0.0:
                start = ends[int(share > 0.0), row]
                first, last = axes.at([start, start + share], row + np.array([-0.5, 0.5]) * _BAR)
                _fill(figure, first, last, fill[label])
                ends[int(share > 0.0), row] += share
    figure.line(axes.at(0.0, axes.y), canvas.INK, 0.9)
    keys = {one: partial(_fill_key, figure, fill[one]) for one in labels}
    figure.legend(keys, (left, _TOP), columns, 7.5)
    return figure


def _fill(figure: Figure, first: np.ndarray, last: np.ndarray, fill: Fill) -> None:
    """Between two corners; several colours one above the other."""
    heights = np.linspace(first[1], last[1], len(fill.colours) + 1)
    for colour, above, below in zip(fill.colours, heights, heights[1:], strict=False):
        ends = np.array([first[0], above]), np.array([last[0], below])
        figure.box(*ends, figure.hatched(colour, fill.hatch), stroke=canvas.INK, stroke_width=0.5)


def _fill_key(figure: Figure, fill: Fill, x: float, y: float) -> None:
    _fill(figure, np.array([x, y - 3.0]), np.array([x + canvas.KEY, y + 3.0]), fill)


def marker_bars(markers: Sequence[str], rms_mm: np.ndarray, limit_mm: float) -> Figure:
    """A bar per marker; the line is the limit."""
    figure, size = Figure(52.0 * MM), 6.5
    labels = {float(k): canvas.plain(name) for k, name in enumerate(markers)}
    left, below = 38.0, canvas.width_of(labels.values(), size) + _BESIDE
    place = left, _TOP, WIDTH - left - _RIGHT, figure.height - _TOP - below
    most = 1.05 * max(limit_mm, rms_mm.max())
    axes = Axes(figure, *place, (-0.6, len(markers) - 0.4), (0.0, most))
    axes.frame({}, canvas.ticks(*axes.y, 5))
    figure.text((10.0, _TOP + axes.height / 2), "distance [mm]", 8.5, True, text_anchor="middle")
    for (k, label), rms in zip(labels.items(), rms_mm, strict=True):
        colour = canvas.ORANGE if rms > limit_mm else canvas.BLUE
        figure.box(axes.at(k - 0.4, 0.0), axes.at(k + 0.4, rms), colour)
        x, y = axes.at(k, 0.0)
        figure.text((x + 0.36 * size, y + 4.0), label, size, turned=True, text_anchor="end")
    figure.line(axes.at(axes.x, limit_mm), canvas.INK, 0.9, "3.3 1.4")
    return figure


def _log_ticks(low: float, high: float) -> dict[float, str]:
    return {float(t): f"{t:g}" for t in _TICKS if low <= t <= high}


def segment_masses(data: pd.DataFrame) -> Figure:
    """Three panels over the segments (the index): masses ``rm_kg, rm_mass_kg, om_kg``, OM - RM with
    95 % intervals (``om_sd_kg``), and in 0..1 how much the data decide (``data_share``)."""
    n, rows, top = len(data), np.arange(len(data)), _TOP + canvas.LEGEND_ROW + 2.0
    figure = Figure(top + 13.6 * n + BELOW_WITH_TITLE)
    left, gap = canvas.width_of(data.index) + _BESIDE, 16.0
    part = (WIDTH - left - _RIGHT - 2 * gap) / 7.5
    height = 13.6 * n
    om = data["om_kg"].where(data["om_kg"] > 0.0)
    known = np.concatenate([data["rm_kg"], om])
    ends = float(np.nanmin(known) / 1.35), float(np.nanmax(known) * 1.35)
    labels = {float(k): str(name) for k, name in enumerate(data.index)}
    masses = Axes(figure, left, top, 3 * part, height, ends, (n - 0.5, -0.5), is_log=True)
    masses.frame(_log_ticks(*ends), labels, "xy", x_title="mass [kg] (log scale)")
    keys = {}
    for method, kg, size in (
        (RM, data["rm_kg"], 4.9),
        (RM_MASS, data["rm_mass_kg"], 3.0),
        (OM, om, 4.0),
    ):
        line = canvas.line_of(method)
        how = (line.marker, size, "#ffffff" if method == RM else line.colour, line.colour, 1.0)
        figure.dots(masses.at(kg.to_numpy(), rows), *how)
        keys[method] = partial(_dot_key, figure, *how)
    figure.legend(keys, (left, _TOP))
    change = (data["om_kg"] - data["rm_kg"]).to_numpy()
    half = np.nan_to_num(Z95 * data["om_sd_kg"].to_numpy())
    ends, silent = canvas.span(change - half, change + half, [0.0]), dict.fromkeys(labels, "")
    left += 3 * part + gap
    differences = Axes(figure, left, top, 3 * part, height, ends, masses.y)
    title = "OM − RM [kg], 95 % interval"
    differences.frame(canvas.ticks(*ends, 5), silent, "xy", x_title=title)
    figure.line(differences.at(0.0, masses.y), canvas.ORANGE, 1.2, "4.4 1.9")
    reach = differences.at([change - half, change + half], rows)  # (2, n, 2)
    figure.line(reach.swapaxes(0, 1), canvas.SOFT, 1.1)
    caps = reach.reshape(-1, 1, 2) + np.array([[0.0, -2.0], [0.0, 2.0]])
    figure.line(caps, canvas.SOFT, 1.0)
    figure.dots(differences.at(change, rows), "o", 5.0, canvas.BLUE)
    left += 3 * part + gap
    shares = Axes(figure, left, top, 1.5 * part, height, (0.0, 100.0), masses.y)
    shares.frame(canvas.ticks(0.0, 100.0, 2), silent, "xy", x_title="data decide [%]")
    for row, share in enumerate(np.nan_to_num(100.0 * data["data_share"].to_numpy())):
        for end, colour in ((100.0, canvas.FAINT), (share, canvas.BLUE)):
            figure.box(shares.at(0.0, row - 0.275), shares.at(end, row + 0.275), colour)
    return figure


def _dot_key(
    figure: Figure, marker: str, size: float, fill: str, edge: str, width: float, x: float, y: float
) -> None:
    figure.dots(np.array([[x + canvas.KEY / 2, y]]), marker, size, fill, edge, width)


# --- a dot per person: errors and their yardsticks, and what identification gains -----------------

_SPREAD = 0.28
_MANY_PEOPLE = 200  # from here on dots are smaller


@dataclass(frozen=True, eq=False)
class Strip:
    """One quantity of all persons: ``values`` (p,), NaN where not known; ``far`` (p,) those that are
    named next to their dot; ``end`` of the axis, where a triangle stands for what is beyond."""

    title: str
    values: np.ndarray
    names: tuple[str, ...]
    far: np.ndarray
    good: float
    limit: float
    end: float


def strips(data: Sequence[Strip]) -> Figure:
    """Side by side; light blue is as good as published, above the red line is large."""
    figure = Figure(70.0 * MM)
    width = (WIDTH - _RIGHT) / len(data)
    for k, strip in enumerate(data):
        place = 26.0 + k * width, 18.0, width - 30.0, figure.height - 26.0
        _draw_strip(Axes(figure, *place, (-0.6, 0.9), (0.0, strip.end)), strip)
    return figure


def _draw_strip(axes: Axes, strip: Strip) -> None:
    figure, known = axes.figure, np.flatnonzero(np.isfinite(strip.values))
    figure.box(axes.at(axes.x[0], 0.0), axes.at(axes.x[1], strip.good), "#cfe3f2")
    axes.frame({}, canvas.ticks(*axes.y, 8))
    figure.text((axes.left - 22.0, axes.top - 9.0), strip.title)  # as wide as its part
    figure.line(axes.at(axes.x, strip.limit), "#b30000", 1.2)
    offsets = _offsets(len(known))
    values, far = strip.values[known], strip.far[known]
    beyond = values > strip.end
    points = axes.at(offsets, np.minimum(values, np.where(beyond, 0.98, 1.0) * strip.end))
    size = 2.8 if len(known) > _MANY_PEOPLE else 5.4
    for marker, mine in (("o", ~beyond), ("^", beyond)):
        for colour, which in ((canvas.BLUE, ~far), (canvas.ORANGE, far)):
            if (mine & which).any():
                figure.dots(points[mine & which], marker, size, colour)
    for k in np.flatnonzero(far):
        name, (x, y) = canvas.plain(strip.names[known[k]]), axes.at(offsets[k], values[k])
        place = x + 5.0, y - 3.0
        if beyond[k]:
            name, place = f"{name}: {values[k]:.3g}", (x + 5.0, axes.top + 9.0)
        fits = place[0] + canvas.width_of([name], 7.0) <= axes.left + axes.width
        anchor = "start" if fits else "end"
        figure.text((place[0] - 10.0 * (not fits), place[1]), name, 7.0, text_anchor=anchor)
    if len(known):
        middle = min(float(np.median(values)), strip.end)
        figure.line(axes.at([-0.42, 0.42], middle), canvas.INK, 1.4)


def _offsets(people: int) -> np.ndarray:
    """(p,) beside the middle, lest dots cover one another."""
    return np.linspace(-_SPREAD, _SPREAD, people) if people > 1 else np.zeros(people)


def gain_dots(components: Sequence[str], ratios: Mapping[str, np.ndarray]) -> Figure:
    """A row per component; of each method (c, p) its error over RM's, a dot per person, a line at
    the geometric mean."""
    rows, top = len(components), _TOP + canvas.LEGEND_ROW + 2.0
    figure = Figure(top + 8.0 * MM * rows + BELOW_WITH_TITLE)
    everything = np.concatenate(list(ratios.values()))
    low = min(0.5, float(np.nanmin(everything))) / 1.15
    high = max(2.0, float(np.nanmax(everything))) * 1.15
    left = canvas.width_of(components) + _BESIDE
    place = left, top, WIDTH - left - _RIGHT, 8.0 * MM * rows
    axes = Axes(figure, *place, (low, high), (rows - 0.5, -0.5), is_log=True)
    labels = {float(k): name for k, name in enumerate(components)}
    title = "error over that of RM (left of 1: follows better)"
    axes.frame(_log_ticks(low, high), labels, "x", x_title=title)
    between = [axes.at(axes.x, row - 0.5) for row in range(1, rows)]
    figure.line(np.array(between).reshape(-1, 2, 2), canvas.FAINT, 0.6)
    figure.line(axes.at(1.0, axes.y), canvas.SOFT, 1.0)
    people = everything.shape[1]
    size, edge = (2.4, "") if people > _MANY_PEOPLE else (4.9, "#ffffff")
    keys = {}
    for method, table in ratios.items():
        line = canvas.line_of(method)
        how = (line.marker, size if line.marker == "o" else 0.8 * size, line.colour, edge, 0.5)
        points = axes.at(table, np.arange(rows)[:, None] + _offsets(people))
        figure.dots(points.reshape(-1, 2), *how)
        known = np.flatnonzero(np.isfinite(table).any(axis=1))
        means = np.exp(np.nanmean(np.log(table[known]), axis=1))
        ends = known[:, None] + np.array([-0.38, 0.38])
        figure.line(axes.at(means[:, None], ends), line.colour, 1.8)
        keys[method] = partial(_dot_key, figure, *how)
    figure.legend(keys, (left, _TOP))
    return figure


# --- signals over time, measured and by method, with bands where their errors are known -----------


@dataclass(frozen=True, eq=False)
class Panel:
    """Signals of one quantity.

    title : what it is, with its unit.
    time_s : (n,).
    signals : label of the method -> (n,), NaN where there are none.
    spreads : label of the method -> (n,) standard deviation, for those drawn with a band.
    """

    title: str
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    spreads: Mapping[str, np.ndarray] = field(default_factory=dict)


def curves(panels: Sequence[Panel], columns: int, height_mm: float = 38.0) -> Figure:
    """Panels in rows of ``columns``, one legend above; bands are 95 % intervals."""
    rows, pitch, top = -(-len(panels) // columns), height_mm * MM, _TOP + canvas.LEGEND_ROW
    figure = Figure(top + pitch * rows + BELOW_WITH_TITLE - 8.0)
    figure.legend(
        {method: partial(_line_key, figure, method) for method in panels[0].signals}, (8.0, _TOP)
    )
    width = (WIDTH - _RIGHT) / columns
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        is_last = k + columns >= len(panels)
        place = 38.0 + column * width, top + row * pitch + 17.0, width - 42.0, pitch - 23.0
        ends = canvas.span(panel.time_s, margin=0.0)
        bands = (s + sign * Z95 * panel.spreads[m] for m, s in panel.signals.items()
                 if m in panel.spreads for sign in (-1, 1))  # fmt: skip
        axes = Axes(figure, *place, ends, canvas.span(*panel.signals.values(), *bands))
        times = canvas.ticks(*ends, 12 // columns)
        times = times if is_last else dict.fromkeys(times, "")
        values = canvas.ticks(*axes.y, 5)
        axes.frame(times, values, "y", 7.0, panel.title, "time [s]" if is_last else "")
        _draw(axes, panel)
    return figure


def _draw(axes: Axes, panel: Panel) -> None:
    figure, keep = axes.figure, canvas.thinned(len(panel.time_s))
    time = panel.time_s[keep]
    if panel.spreads and axes.y[0] < 0.0 < axes.y[1]:
        figure.line(axes.at(axes.x, 0.0), canvas.SOFT, 0.5)
    for method, values in panel.signals.items():
        line, values = canvas.line_of(method), values[keep]
        if method in panel.spreads:
            half = Z95 * panel.spreads[method][keep]
            figure.band(axes.at(time, values - half), axes.at(time, values + half), line.colour)
        figure.line(axes.at(time, values), line.colour, line.width, line.dash)


def _line_key(figure: Figure, method: str, x: float, y: float) -> None:
    line = canvas.line_of(method)
    figure.line(np.array([[x, y], [x + canvas.KEY, y]]), line.colour, line.width, line.dash)
