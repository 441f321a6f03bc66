"""What a report is made of, as data: a document of sections of paragraphs, grids and pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Literal

from bsip_cli.report.poses import Poses

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Mark = Literal["", "better", "warning", "group"]
Tone = Literal["plain", "good", "warning", "note"]


@dataclass(frozen=True)
class Paragraph:
    kind: ClassVar[str] = "paragraph"
    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Heading:
    kind: ClassVar[str] = "heading"
    text: str


@dataclass(frozen=True)
class Bullets:
    kind: ClassVar[str] = "bullets"
    items: tuple[str, ...]
    tone: Tone = "plain"


@dataclass(frozen=True)
class Numbered:
    """A list whose items other texts refer to by their number."""

    kind: ClassVar[str] = "numbered"
    items: tuple[str, ...]


@dataclass(frozen=True)
class Cell:
    """One cell: its text, how it is set off, and where it leads (a relative link) if anywhere."""

    text: str
    mark: Mark = ""
    link: str = ""


@dataclass(frozen=True)
class Grid:
    """A table.

    Attributes
    ----------
    head : titles of the columns, with units.
    rows : as many cells each as ``head``; a string is a plain cell.
    groups : titles over several columns, with how many they span; empty for none.
    words : how many leading columns hold words (set to the left; the others are numbers).
    """

    kind: ClassVar[str] = "grid"
    head: tuple[str, ...]
    rows: tuple[tuple[str | Cell, ...], ...]
    caption: str = ""
    groups: tuple[tuple[str, int], ...] = ()
    words: int = 1

    def cells(self) -> list[list[Cell]]:
        """The rows with every cell as a ``Cell``."""
        return [[c if isinstance(c, Cell) else Cell(c) for c in row] for row in self.rows]


@dataclass(frozen=True)
class Picture:
    """A figure with its caption; a ``name`` has it written as files of that name too."""

    kind: ClassVar[str] = "picture"
    figure: Figure
    caption: str
    alt: str
    name: str = ""

    def width_percent(self) -> float:
        """Width on the page, so that letters are equally large in all figures."""
        from bsip_cli.report.figures.canvas import WIDTH_MM

        return min(100.0, 100.0 * self.figure.get_figwidth() * 25.4 / WIDTH_MM)

    @cached_property
    def svg(self) -> bytes:
        from bsip_cli.report.figures.canvas import to_svg

        return to_svg(self.figure)


@dataclass(frozen=True)
class Film:
    """Poses that move when asked to; ``alt`` for those who cannot see it."""

    kind: ClassVar[str] = "film"
    poses: Poses
    caption: str
    alt: str


Block = Paragraph | Heading | Bullets | Numbered | Grid | Picture | Film


@dataclass(frozen=True)
class Section:
    """``anchor`` is the section's address in the page."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    title: str
    subtitle: str
    sections: tuple[Section, ...]

    def pictures(self) -> Iterator[Picture]:
        for section in self.sections:
            yield from (block for block in section.blocks if isinstance(block, Picture))
