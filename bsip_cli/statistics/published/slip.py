"""One thing that a paper's own numbers say cannot be as printed."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.statistics.published.paper import PrintedTable
from bsip_cli.statistics.published.printed import Interval


@dataclass(frozen=True)
class Slip:
    """``printed`` beside ``recomputed`` as text; ``reading``: what was likely meant, if the numbers
    allow only one. is_remark : worth knowing, but no contradiction by itself."""

    paper: str
    table: int
    row: str
    what: str
    printed: str
    recomputed: str
    reading: str = ""
    is_remark: bool = False


def slip(
    table: PrintedTable,
    row: str,
    what: str,
    *,
    printed: str,
    recomputed: str,
    reading: str = "",
    is_remark: bool = False,
) -> Slip:
    """Of a row of a table."""
    return Slip(table.paper, table.number, row, what, printed, recomputed, reading, is_remark)


def range_words(values: Interval, decimals: int = 2) -> str:
    """2.41, or 2.41 to 2.45 where rounding matters."""
    low, high = f"{values.low:.{decimals}f}", f"{values.high:.{decimals}f}"
    return low if low == high else f"{low} to {high}"
