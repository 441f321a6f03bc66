"""What all figures share: size, colours that differ in grey too, and how they are drawn, as SVG.

Lengths are in points (1/72 inch) from the upper left corner; letters are text. The same figure gives
the same bytes.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from math import floor, log10
from typing import Any

import numpy as np

from bsip_cli.dynamics.lowpass import valid_intervals
from bsip_cli.errors import printable
from bsip_cli.report.words import number
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS

MM = 72.0 / 25.4
WIDTH = 170.0 * MM  # the text width of a page
INK, SOFT, FAINT = "#1c1c1c", "#6e6e6e", "#d4d4d4"
ORANGE, BLUE, GREEN, PURPLE = "#D55E00", "#0072B2", "#009E73", "#CC79A7"  # Okabe and Ito
LONGEST_LABEL = 16
MOST_POINTS = 1200  # of one curve: more than a page can show
KEY = 20.0  # width of what stands for a label in a legend
LEGEND_ROW = 11.0
BELOW, BELOW_WITH_TITLE = 15.0, 29.0  # room that ticks need under axes
_TICK = 3.0
_PLAIN_DIGITS = 5  # before or after the point, of a number that is written without exponent
_FONTS = "'DejaVu Sans', Verdana, Arial, sans-serif"  # of much the same width
# Of letters of DejaVu Sans, in parts of their size; all others are about 0.63 wide.
_WIDTHS = {0.3: "ijlIJ' ,.", 0.36: "/:;|f-", 0.4: "()[]t!r", 0.9: "mwMW%@#+<=>−±→"}
_WIDTH_OF = {letter: width for width, letters in _WIDTHS.items() for letter in letters}
# Of a dot: where its outline begins, in radii from its middle, and how it goes on.
_SHAPES = {
    "o": ((-1, 0), "a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0z"),
    "s": ((-1, -1), "h{d}v{d}h-{d}z"),
    "D": ((0, -1), "l{r} {r} -{r} {r} -{r} -{r}z"),
    "^": ((0, -1), "l{r} {d}h-{d}z"),
}
_HATCHES = {
    "||": "M3 0V6",
    "--": "M0 3H6",
    "..": "M2.6 3h.8",
    "////": "M-1 1L1 -1M0 6L6 0M5 7L7 5",
}


@dataclass(frozen=True)
class Line:
    """How a method is drawn, as a curve (``dash`` in points) or as dots."""

    colour: str
    dash: str
    width: float
    marker: str = "o"


_LINES = {
    MEASURED: Line("#7a7a7a", "", 3.0),
    RM: Line(ORANGE, "4.8 2.1", 1.3, "s"),
    RM_MASS: Line(GREEN, "1.5 2.5", 1.5, "D"),
    OM: Line(BLUE, "", 1.1),
}
_OTHER_LINE = Line(PURPLE, "7 1.8 1.1 1.8", 1.1)


def line_of(method: str) -> Line:
    """That of the method, or the one that estimators without their own share."""
    return _LINES.get(method, _OTHER_LINE)


@dataclass
class Figure:
    """A picture in the making."""

    height: float
    width: float = WIDTH
    parts: list[str] = field(default_factory=list)

    def add(self, element: str, attributes: Mapping[str, Any], text: str = "") -> None:
        """An element of SVG; attributes that are empty are left out."""
        said = (
            f' {name.replace("_", "-")}="{_short(value) if isinstance(value, float) else value}"'
            for name, value in attributes.items()
            if value != ""
        )
        self.parts.append(f"<{element}{''.join(said)}>{escape(printable(text))}</{element}>")

    def line(
        self, points: np.ndarray, colour: str, width: float, dash: str = "", **more: Any
    ) -> None:
        """Through points (n, 2), or through each of many, (k, n, 2); broken where one is NaN."""
        runs = []
        for one in points if points.ndim == 3 else points[None]:
            intervals = valid_intervals(np.isfinite(one).all(axis=-1))
            runs += [one[first:end] for first, end in intervals]
        way = "".join(map(_way, runs))
        style = {"stroke": colour, "stroke_width": width, "stroke_dasharray": dash}
        self.add("path", {"d": way, "fill": "none"} | style | more)

    def band(self, low: np.ndarray, high: np.ndarray, colour: str) -> None:
        """Between points (n, 2) and others; broken where one is NaN."""
        whole = valid_intervals(np.isfinite(np.hstack([low, high])).all(axis=1))
        ways = (_way(np.concatenate([low[a:b], high[a:b][::-1]])) + "z" for a, b in whole)
        self.add("path", {"d": "".join(ways), "fill": colour, "fill_opacity": 0.2})

    def box(self, first: np.ndarray, last: np.ndarray, fill: str, **more: Any) -> None:
        """Between two opposite corners (2,)."""
        (x, y), (width, height) = np.minimum(first, last), np.abs(last - first)
        self.add("rect", {"x": x, "y": y, "width": width, "height": height, "fill": fill} | more)

    def dots(
        self,
        points: np.ndarray,
        shape: str,
        size: float,
        fill: str,
        edge: str = "",
        width: float = 1.0,
    ) -> None:
        """At points (n, 2), none at NaN; ``size``: of a circle the diameter, of others the side."""
        radius = size * (np.sqrt(0.5) if shape == "D" else 0.5)
        start, rest = _SHAPES[shape]
        rest = rest.format(r=_short(radius), d=_short(2 * radius))
        known = points[np.isfinite(points).all(axis=1)] + radius * np.array(start)
        way = "".join(f"M{_short(x)} {_short(y)}{rest}" for x, y in known.tolist())
        self.add(
            "path", {"d": way, "fill": fill, "stroke": edge, "stroke_width": width if edge else ""}
        )

    def text(
        self, at: Sequence[float], text: str, size: float = 8.0, turned: bool = False, **more: Any
    ) -> None:
        """``at``: where its line begins, or as ``text_anchor`` says; ``turned``: it goes up."""
        x, y = map(float, at)
        place = {"x": x, "y": y, "font_size": size, "fill": INK}
        more |= {"transform": f"rotate(-90 {_short(x)} {_short(y)})"} if turned else {}
        self.add("text", place | more, text)

    def hatched(self, colour: str, hatch: str) -> str:
        """What fills an area with a colour and a hatching."""
        if not hatch:
            return colour
        name = f"{colour.removeprefix('#')}-{[*_HATCHES].index(hatch)}"
        area = (
            f'<path d="M0 0H6V6H0z" fill="{colour}"/><path d="{_HATCHES[hatch]}" stroke="{INK}"/>'
        )
        tile = 'width="6" height="6" patternUnits="userSpaceOnUse"'
        pattern = f'<pattern id="{name}" {tile}>{area}</pattern>'
        self.parts += [] if pattern in self.parts else [pattern]
        return f"url(#{name})"

    def legend(
        self,
        entries: Mapping[str, Callable[[float, float], None]],
        at: tuple[float, float],
        columns: int = 5,
        size: float = 8.0,
    ) -> None:
        """Labels with what stands for each, drawn from (x, y) on, `KEY` wide, y its middle; filled
        column by column from the upper left corner ``at``, or from further left if it is too wide."""
        (left, top), labels = at, list(entries)
        longest = int((self.width - KEY - 10.0) / (0.63 * size))
        rows = -(-len(labels) // columns)
        parts = [labels[first : first + rows] for first in range(0, len(labels), rows)]
        widths = [KEY + 22.0 + width_of(part, size) for part in parts]
        left = max(4.0, min(left, self.width - sum(widths)))
        for part, width in zip(parts, widths, strict=True):
            for k, label in enumerate(part):
                y = top + (k + 0.5) * LEGEND_ROW
                entries[label](left, y)
                self.text((left + KEY + 6.0, y + 0.36 * size), plain(label, longest), size)
            left += width

    def svg(self) -> bytes:
        size = f"{_short(self.width)} {_short(self.height)}"
        width, height = (f"{one}pt" for one in size.split())
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        head += f'viewBox="0 0 {size}" font-family="{_FONTS}" stroke-linejoin="round">'
        paper = '<rect width="100%" height="100%" fill="#ffffff"/>'
        return "\n".join([head, paper, *self.parts, "</svg>", ""]).encode()


@dataclass(frozen=True)
class Axes:
    """A part of a figure with scales; ``x``: values at its left and right, ``y``: at its bottom and
    top. ``is_log``: logarithmic across."""

    figure: Figure
    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    is_log: bool = False

    def at(self, x: Any, y: Any) -> np.ndarray:
        """(..., 2) points of values."""
        ends, x = (np.log(self.x), np.log(x)) if self.is_log else (self.x, np.asarray(x))
        across = self.left + self.width * (x - ends[0]) / (ends[1] - ends[0])
        down = self.top + self.height * (self.y[1] - np.asarray(y)) / (self.y[1] - self.y[0])
        return np.stack(np.broadcast_arrays(across, down), axis=-1)

    def frame(
        self,
        x: Mapping[float, str],
        y: Mapping[float, str],
        grid: str = "y",
        size: float = 8.0,
        title: str = "",
        x_title: str = "",
    ) -> None:
        """Only the lines that help: left and bottom with ticks (value: label), and a faint grid;
        ``title``: above, ``x_title``: below. To be drawn first."""
        draw, right, bottom = self.figure, self.left + self.width, self.top + self.height
        across, down = self.at(list(x), self.y[0])[:, 0], self.at(self.x[0], list(y))[:, 1]
        for name, places in (("x", across), ("y", down)):
            if name in grid and len(places):
                ends = (self.top, bottom) if name == "x" else (self.left, right)
                draw.line(_crossing(places, *ends, upright=name == "x"), FAINT, 0.6)
        corner = np.array([[self.left, self.top], [self.left, bottom], [right, bottom]])
        draw.line(corner, SOFT, 0.8)
        draw.line(_crossing(across, bottom, bottom + _TICK, upright=True), INK, 0.8)
        draw.line(_crossing(down, self.left - _TICK, self.left, upright=False), INK, 0.8)
        for place, label in zip(across, x.values(), strict=True):
            draw.text((place, bottom + 6.0 + 0.8 * size), label, size, text_anchor="middle")
        for place, label in zip(down, y.values(), strict=True):
            draw.text((self.left - 6.5, place + 0.36 * size), label, size, text_anchor="end")
        if title:
            draw.text((self.left, self.top - 4.0), title)
        if x_title:
            middle = self.left + self.width / 2, bottom + 25.0
            draw.text(middle, x_title, 8.5, text_anchor="middle")


def _crossing(places: np.ndarray, first: float, last: float, *, upright: bool) -> np.ndarray:
    """(n, 2, 2) lines at places (n,) across or down, from the one to the other coordinate."""
    ends = np.broadcast_to([first, last], (len(places), 2))
    along = np.repeat(places[:, None], 2, axis=1)
    return np.stack([along, ends] if upright else [ends, along], axis=-1)


def span(*values: Any, margin: float = 0.05) -> tuple[float, float]:
    """From the least to the largest of all that are known, and a little more to either side."""
    every = np.concatenate([np.ravel(one) for one in values])
    known = every[np.isfinite(every)]
    low, high = (known.min(), known.max()) if len(known) else (0.0, 1.0)
    more = margin * (high - low) if high > low else max(0.5, 1e-6 * abs(high))
    return float(low - more), float(high + more)


def ticks(low: float, high: float, most: int) -> dict[float, str]:
    """About so many round numbers, with their labels; none where the ends are none."""
    if not high > low:
        return {}
    power = 10.0 ** floor(log10((high - low) / most))
    of_ten = next(x for x in (1.0, 2.0, 2.5, 5.0, 10.0) if x * power * most >= high - low)
    step, digits = of_ten * power, floor(log10(of_ten * power))
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    values = step * np.arange(first, last + 1.0)
    if abs(digits) > _PLAIN_DIGITS:
        return {float(x): f"{x:.3g}" for x in values}
    return {float(x): number(x, max(0, (of_ten == 2.5) - digits)) for x in values}


def width_of(labels: Iterable[str], size: float = 8.0) -> float:
    """Of the longest, about."""
    return size * max((sum(map(_letter_width, one)) for one in labels), default=0.0)


def _letter_width(letter: str) -> float:
    is_wide = unicodedata.east_asian_width(letter) in "WF"
    return 1.0 if is_wide else _WIDTH_OF.get(letter, 0.63)


def columns_for(labels: Iterable[str], most: int, size: float = 8.0) -> int:
    """Of a legend across a figure, at most so many."""
    return max(1, min(most, int(WIDTH // (KEY + 22.0 + width_of(labels, size)))))


def plain(text: str, longest: int = LONGEST_LABEL) -> str:
    """A foreign label as it is: nothing unprintable, cut where it is too long."""
    return printable(text if len(text) <= longest else f"{text[: longest - 1]}…")


def thinned(length: int, most: int = MOST_POINTS) -> slice:
    """Every k-th of ``length`` samples, so that at most ``most`` are left."""
    return slice(None, None, max(1, -(-length // most)))


def middle_of_longest(time_s: np.ndarray, flags: np.ndarray, seconds: float) -> slice:
    """Up to ``seconds`` from the middle of the longest interval where ``flags`` holds."""
    intervals = valid_intervals(flags)
    if not intervals:
        return slice(0, 0)
    first, end = max(intervals, key=lambda pair: pair[1] - pair[0])
    spare = time_s[end - 1] - time_s[first] - seconds
    if spare <= 0.0:
        return slice(first, end)
    start = int(np.searchsorted(time_s, time_s[first] + spare / 2.0))
    return slice(start, int(np.searchsorted(time_s, time_s[start] + seconds, side="right")))


def _short(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _way(points: np.ndarray) -> str:
    return "M" + " ".join(map(_short, points.ravel().tolist()))
