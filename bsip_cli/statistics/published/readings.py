"""What was likely meant: the one change of a table after which its numbers agree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

from bsip_cli.statistics.published.paper import Cell, Interval, PrintedTable, Row, image


@dataclass(frozen=True)
class Place:
    """A cell of a table."""

    row: str
    method: str
    cell: Cell

    def words(self) -> str:
        return f"{self.row} {self.method} ({self.cell.text})"


@dataclass(frozen=True)
class Exchange:
    """Two cells that stand in each other's place."""

    first: Place
    second: Place

    def undone(self, table: PrintedTable) -> PrintedTable:
        """The table with both cells where they belong."""
        return replace(table, rows=tuple(self._undone(row) for row in table.rows))

    def _undone(self, row: Row) -> Row:
        for here, there in ((self.first, self.second), (self.second, self.first)):
            if row.name == here.row:
                row = row.with_cell(here.method, there.cell)
        return row

    def sentence(self) -> str:
        return f"{self.first.words()} and {self.second.words()} are exchanged"


def exchanged_cells(table: PrintedTable) -> Exchange | None:
    """The only exchange of two cells after which the means of all rows agree with their
    intervals; None if they agree as printed, or if no or several exchanges would do."""
    if _agree(table):
        return None
    exchanges = (Exchange(a, b) for a, b in combinations(_places(table), 2))
    found = [one for one in exchanges if _agree(one.undone(table))]
    return found[0] if len(found) == 1 else None


def pairs_that_differ_by(table: PrintedTable, difference: Interval) -> list[tuple[Place, Place]]:
    """All two cells of a table whose means differ by so much."""
    places = _places(table)
    return [(a, b) for a in places for b in places if (a.cell.mean - b.cell.mean).meets(difference)]


def as_meant(table: PrintedTable) -> PrintedTable:
    """The table with exchanged cells where they belong; as it is where none are."""
    exchange = exchanged_cells(table) if table.design == "paired" else None
    return table if exchange is None else exchange.undone(table)


def middle_of(row: Row) -> Interval:
    """Of the printed interval."""
    return image(lambda low, high: 0.5 * (low + high), *row.ends())


def mean_difference(table: PrintedTable, row: Row) -> Interval:
    """Of the first method's mean less the second's."""
    first, second = (row.cells[method] for method in table.methods)
    return first.mean - second.mean


def agrees(table: PrintedTable, row: Row) -> bool:
    """Whether the difference of a row's means is the middle of its interval."""
    return mean_difference(table, row).meets(middle_of(row))


def _agree(table: PrintedTable) -> bool:
    return all(agrees(table, row) for row in table.rows)


def _places(table: PrintedTable) -> list[Place]:
    return [Place(row.name, m, cell) for row in table.rows for m, cell in row.cells.items()]
