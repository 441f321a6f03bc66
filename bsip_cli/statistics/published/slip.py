"""One thing that a paper's own numbers say cannot be as printed."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.statistics.published.paper import PrintedTable
from bsip_cli.statistics.published.printed import Interval


@dataclass(frozen=True)
class Slip:
    """``printed`` beside ``recomputed`` as text; ``reading``: what was likely meant, if the numbers
    allow only one."""

    paper: str
    table: int
    row: str
    what: str
    printed: str
    recomputed: str
    reading: str = ""


def slip(
    table: PrintedTable, row: str, what: str, printed: str, recomputed: str, reading: str = ""
) -> Slip:
    return Slip(table.paper, table.number, row, what, printed, recomputed, reading)


def words(values: Interval, decimals: int = 2) -> str:
    """The middle, for numbers that rounding leaves nearly as they are."""
    return f"{values.middle:.{decimals}f}"


def range_words(values: Interval, decimals: int = 2) -> str:
    """2.41, or 2.41 to 2.45 where rounding matters."""
    low, high = f"{values.low:.{decimals}f}", f"{values.high:.{decimals}f}"
    return low if low == high else f"{low} to {high}"
