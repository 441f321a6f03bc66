"""What all figures share: size, colours that differ in grey too, and files without a clock."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from bsip_cli.dynamics.lowpass import valid_intervals
from bsip_cli.errors import printable
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS

WIDTH_MM = 170.0  # the text width of a page
INK, SOFT, FAINT = "#1c1c1c", "#6e6e6e", "#d4d4d4"
ORANGE, BLUE, GREEN, PURPLE = "#D55E00", "#0072B2", "#009E73", "#CC79A7"  # Okabe and Ito
LONGEST_LABEL = 16
MOST_POINTS = 1200  # of one curve: more than a page can show
MANY_PEOPLE = 200  # from here on dots and lines are drawn as pixels: files stay small
_MM = 1.0 / 25.4
_DPI_OF_SVG = 72.0
_FONTS = b"'DejaVu Sans', Verdana, Arial, sans-serif"  # of much the same width
_RC: dict[Any, Any] = {"svg.hashsalt": "bsip", "svg.fonttype": "none", "path.simplify": True}
_RC |= {"font.family": "DejaVu Sans", "font.size": 8, "axes.unicode_minus": True}


@dataclass(frozen=True)
class Line:
    """How a method is drawn, as a curve or as points."""

    colour: str
    style: str
    width: float
    marker: str = "o"


_LINES = {
    MEASURED: Line("#7a7a7a", "-", 3.0),
    RM: Line(ORANGE, "--", 1.3, "s"),
    RM_MASS: Line(GREEN, ":", 1.5, "D"),
    OM: Line(BLUE, "-", 1.1),
}
_OTHER_LINE = Line(PURPLE, "-.", 1.1)


@contextmanager
def house_style() -> Iterator[None]:
    """Matplotlib's own defaults and ours, whatever the user's matplotlibrc says."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        yield


def line_of(method: str) -> Line:
    return _LINES.get(method, _OTHER_LINE)


def new_figure(height_mm: float, width_mm: float = WIDTH_MM) -> Figure:
    """An empty figure of the page's width that lays itself out."""
    layout = ConstrainedLayoutEngine(w_pad=0.04, h_pad=0.04)
    return Figure(figsize=(width_mm * _MM, height_mm * _MM), layout=layout)


def tidy(axes: Axes, *, grid: Literal["x", "y", "both", ""] = "y") -> None:
    """Only the lines that help: left and bottom, and a faint grid along one axis."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT)
    axes.tick_params(labelsize=8, colors=INK, length=3)
    axes.xaxis.label.set_fontsize(8.5)
    axes.yaxis.label.set_fontsize(8.5)
    if grid:
        axes.grid(axis=grid, color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)


def legend_above(axes: Axes, columns: int = 4) -> None:
    """A legend in one row over the axes, where no curve runs; each label once."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0)}
    where |= {"frameon": False, "fontsize": 8, "borderaxespad": 0.2, "handlelength": 2.4}
    axes.legend(once.values(), once.keys(), ncols=columns, **where)


def plain(text: str, longest: int = LONGEST_LABEL) -> str:
    """A foreign label as it is: no mathematics, nothing unprintable, cut where it is too long."""
    shown = text if len(text) <= longest else f"{text[: longest - 1]}…"
    return printable(shown).replace("$", r"\$")


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


def to_svg(figure: Figure) -> bytes:
    """The figure as SVG, letters as text; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    with house_style(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a label in a script the font lacks
        FigureCanvasSVG(figure)
        if engine := figure.get_layout_engine():  # once; else saving would draw all twice
            figure.set_dpi(_DPI_OF_SVG)
            engine.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, dpi=200)
    return buffer.getvalue().replace(b"'DejaVu Sans'", _FONTS)
