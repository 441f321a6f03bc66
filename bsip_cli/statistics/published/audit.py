"""Everything in a paper that its own numbers contradict."""

from __future__ import annotations

from collections.abc import Iterator

from bsip_cli.statistics.published.group_audit import group_slips
from bsip_cli.statistics.published.paired_audit import is_below, paired_slips
from bsip_cli.statistics.published.paper import Claim, Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Interval
from bsip_cli.statistics.published.readings import as_meant
from bsip_cli.statistics.published.slip import Slip, range_words, slip
from bsip_cli.statistics.published.sway_audit import sway_slips


def audit(paper: Paper) -> tuple[Slip, ...]:
    """All slips, table by table, each once."""
    return tuple(dict.fromkeys(one for table in paper.tables for one in _slips(paper, table)))


def _slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    if table.design == "paired":
        yield from paired_slips(paper, table)
    elif table.design == "groups":
        yield from group_slips(paper, table)
        yield from sway_slips(paper, table)
    elif table.design == "summary":
        yield from _means_of_few(table)
    if table.adds_up_to_body_mass:
        yield from _sums(paper, table)
    for claim in table.claims:
        yield from _claim(paper, table, claim)


def _sums(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """Each method's segments beside the body's mass."""
    if paper.body_mass_kg is None:
        return
    for method in table.methods:
        parts = [row.cells[method].mean for row in table.rows]
        whole = Interval(sum(one.low for one in parts), sum(one.high for one in parts))
        if not whole.meets(paper.body_mass_kg.mean):
            yield slip(
                table,
                "sum of all rows",
                "body mass",
                printed=f"people of {paper.body_mass_kg.text} kg",
                recomputed=f"the segments of {method} add up to {range_words(whole)} kg",
            )


def _means_of_few(table: PrintedTable) -> Iterator[Slip]:
    """A mean of n values that are not negative is at least their maximum over n."""
    for row in table.rows:
        mean, most = row.cells["mean"].mean, row.cells["max"].mean
        least = most.low / table.values
        if mean.high < least:
            yield slip(
                table,
                row.name,
                "mean",
                printed=row.cells["mean"].text,
                recomputed=f"at least {least:.3f} if over {table.values} values, of which one is "
                f"{row.cells['max'].text}",
            )


def _claim(paper: Paper, table: PrintedTable, claim: Claim) -> Iterator[Slip]:
    """What caption or text says, beside the table."""
    false = [row.name for row in table.rows if _is_false(paper, table, row, claim)]
    if not false:
        return
    but = f" but {', '.join(claim.but)}" if claim.but else ""
    whole = len(false) == len(table.rows)
    meant = as_meant(table)
    is_put_right = not any(_is_false(paper, meant, row, claim) for row in meant.rows)
    yield slip(
        table,
        "all rows" if whole else ", ".join(false),
        f"the {claim.where}",
        printed=f"{f'{claim.method} ' if claim.method else 'all rows '}{claim.says}{but}",
        recomputed="the table says the opposite" if whole else "not in these rows",
        reading="true once the exchanged cells are corrected" if is_put_right else "",
    )


def _is_false(paper: Paper, table: PrintedTable, row: Row, claim: Claim) -> bool:
    """Whether no numbers that round to the printed ones make the claim true of a row."""
    if claim.says == "smaller":
        mine = row.cells[claim.method].mean
        rest = (cell.mean for method, cell in row.cells.items() if method != claim.method)
        return any(mine.low >= other.high for other in rest)
    is_different = is_below(row.printed("p"), paper.alpha)
    should = (claim.says == "different") != (row.name in claim.but)
    return is_different is not None and is_different != should
