"""What a report is made of, as data (a first page, folded sections of texts, grids and pictures), and
the page that is made of it."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from html import unescape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from bsip_cli.errors import printable
from bsip_cli.report.budget import Piece, fills
from bsip_cli.report.errors import Yardstick
from bsip_cli.report.words import TEXTS

if TYPE_CHECKING:
    from bsip_cli.report.figures.canvas import Figure

Mark = Literal["", "better", "warning", "group"]
Tone = Literal["plain", "good", "warning", "note"]
State = Literal["fine", "cause", "large", "inconclusive"]
Pairs = tuple[tuple[str, str], ...]


class Block:
    """A piece of a report; each kind has its own part of the template."""

    @property
    def kind(self) -> str:
        return type(self).__name__.lower()


@dataclass(frozen=True)
class Paragraph(Block):
    """A text of its own; the tone decides how it is set off."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Heading(Block):
    """Above some of a section's blocks."""

    text: str


@dataclass(frozen=True)
class Bullets(Block):
    """A list in no order."""

    items: tuple[str, ...]
    tone: Tone = "plain"


@dataclass(frozen=True)
class Numbered(Block):
    """A list whose items other texts refer to by their number."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Terms(Block):
    """Names, each with what is to be said of it."""

    pairs: Pairs


@dataclass(frozen=True)
class Links(Block):
    """Words and addresses (relative), one after the other, between a text and what follows."""

    text: str
    to: Pairs
    rest: str = ""


@dataclass(frozen=True)
class Light(Block):
    """The answer to whether anything is wrong."""

    state: State
    title: str
    text: str


@dataclass(frozen=True)
class Bar(Block):
    """A whole cut into pieces, whose shares [%] add up to 100; what has a share below zero cancels
    a part of the others, and has no length."""

    title: str
    pieces: tuple[Piece, ...]

    def drawn(self) -> tuple[tuple[Piece, float, str], ...]:
        """Each piece, its length [%] of what is above zero, and its background."""
        whole = sum(max(one.share, 0.0) for one in self.pieces)
        fill = fills(self.pieces)
        return tuple(
            (one, 100.0 * max(one.share, 0.0) / whole, fill[one.label].css()) for one in self.pieces
        )


@dataclass(frozen=True)
class Scales(Block):
    """Numbers side by side, each on its way to its limit: a yardstick, and the number; the same by
    other parameters, None where there is none or it reads the same."""

    scales: tuple[tuple[Yardstick, float, float | None], ...]


@dataclass(frozen=True)
class Cell:
    """One cell: its text, how it is set off, and where it leads (a relative link) if anywhere."""

    text: str
    mark: Mark = ""
    link: str = ""


@dataclass(frozen=True, eq=False)
class Grid(Block):
    """A table.

    head : titles of the columns, with units.
    rows : as many cells each as ``head``; a string is a plain cell.
    groups : titles over several columns, with how many they span; empty for none.
    words : how many leading columns hold words (set to the left; the others are numbers).
    name, data : the numbers behind it, written as a CSV file of that name; empty for none.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str | Cell, ...], ...]
    caption: str = ""
    groups: tuple[tuple[str, int], ...] = ()
    words: int = 1
    name: str = ""
    data: pd.DataFrame | None = None

    def cells(self) -> list[list[Cell]]:
        """The rows with every cell as a ``Cell``."""
        return [[c if isinstance(c, Cell) else Cell(c) for c in row] for row in self.rows]


def first_of(lines: Sequence[str], most: int, name: str, tone: Tone = "plain") -> Block:
    """So many of the lines; where there are more, all of them are in a file of that name."""
    if len(lines) <= most:
        return Bullets(tuple(lines), tone)
    rows, left = tuple((line,) for line in lines[:most]), f"{len(lines) - most} more:"
    data = pd.DataFrame({name: lines})
    return Grid((name.replace("_", " "),), rows, left, name=name, data=data)


@dataclass(frozen=True, eq=False)
class Picture(Block):
    """A figure, and what a reader wants to know of it.

    shows : what is drawn. reading : what better and worse look like. action : what to do then.
    name : of its files: NAME.svg, and NAME.csv with ``data``, the numbers behind it.
    """

    figure: Figure
    name: str
    shows: str
    alt: str
    reading: str = ""
    action: str = ""
    data: pd.DataFrame | None = None

    @property
    def svg(self) -> bytes:
        return self.figure.svg()


def picture(name: str, figure: Figure, data: pd.DataFrame, **words: str) -> Picture:
    """A figure with its texts of ``texts.toml``, into which ``words`` are put."""
    texts = {part: text.format(**words) for part, text in TEXTS["pictures"][name].items()}
    return Picture(figure, name, data=data, **texts)


@dataclass(frozen=True, eq=False)
class Portrait(Picture):
    """A figure that stands at the side of the first page."""


@dataclass(frozen=True)
class Section:
    """``anchor`` is the section's address in the page; folded until somebody asks."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """``front`` is the first page, which is printed alone where no section is open."""

    title: str
    subtitle: str
    front: tuple[Block, ...]
    sections: tuple[Section, ...]

    def blocks(self) -> Iterator[Block]:
        yield from self.front
        for section in self.sections:
            yield from section.blocks


# --- a document as one self-contained HTML page ---------------------------------------------------

FILES = "figures"  # folder next to the page that holds its figures and the numbers behind them
_BEFORE_UNIT = re.compile(r"(?<=[\d)]) (?=(?:mm|ms|kg|m|s|N|Hz)\b|%)|(?<=N) (?=m\b)|(?<=%) (?=BW)")
_TEMPLATES = Path(__file__).parent / "templates"


def environment(**more: Any) -> Environment:
    """Of all templates of bsip."""
    more |= {"trim_blocks": True, "lstrip_blocks": True}
    return Environment(loader=FileSystemLoader(_TEMPLATES), undefined=StrictUndefined, **more)


@cache
def _page() -> Template:
    """Escapes all texts; names of files and markers may hold control characters, which what
    templates make does not; numbers and their units stay on one line."""

    def cleaned(value: object) -> object:
        is_foreign = isinstance(value, str) and not isinstance(value, Markup)
        return printable(str(value)) if is_foreign else value

    pages = environment(autoescape=True, finalize=cleaned)
    pages.filters["as_base64"] = lambda svg: base64.b64encode(svg).decode("ascii")
    pages.filters["tied"] = lambda text: re.sub(_BEFORE_UNIT, "\N{NO-BREAK SPACE}", text)
    return pages.get_template("report.html.j2")


def render(document: Document) -> str:
    """The page: figures as data, nothing from the network, no script at all; all texts escaped."""
    style = Markup((_TEMPLATES / "report.css").read_text(encoding="utf-8"))
    return _page().render(document=document, style=style, files=FILES)


def words_in(blocks: Iterable[Block]) -> int:
    """Of a first page without its title, as a reader sees them."""
    page = render(Document("", "", tuple(blocks), ()))
    front = page.partition('<main id="front">')[2].partition("</main>")[0]
    return len(unescape(re.sub(r"<[^>]+>", " ", front)).split())


# The glossary of every report.
WORDS = Section("words", "What do the words mean?", (Terms(tuple(TEXTS["glossary"].items())),))
