"""What the papers print, what of it cannot be true, and this study beside it."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

from bsip_cli.report.tables.labels import count, mean_sd
from bsip_cli.report.tables.model import Cell, Column, Results, Row, Table
from bsip_cli.statistics.cohort_values import Comparison, Topic
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS
from bsip_cli.statistics.published import paper as published
from bsip_cli.statistics.published.audit import audit, unit_of_length
from bsip_cli.statistics.published.paper import as_meant

COMPARED = "hansen2017"
"""The paper whose tables this study's tables 1 to 4 repeat."""

_PAIRED = ("table1", "table2", "table4")
_METHODS = {"FP": MEASURED, "OM": OM, "RM": RM}  # in print
_MOVED = "†"
_DIGITS = 9  # more than print has, fewer than the arithmetic of its rounding


def printed(paper: published.Paper, table: published.PrintedTable) -> Table:
    """A table of a paper as it is printed."""
    tests = [name for name in ("t", "p", "d", "F") if name in table.rows[0].tests]
    columns = [Column(("row",), "Row", text=True)]
    columns += [Column((method,), method) for method in table.methods]
    if table.rows[0].ci_text:
        columns.append(Column(("ci",), "95% CI"))
    columns += [Column((name,), name) for name in tests]
    if any(row.unit for row in table.rows):
        columns.append(Column(("unit",), "unit", text=True))
    rows = (Row(_as_printed(row, table.methods)) for row in table.rows)
    title = f"{paper.name}, table {table.number}. {table.about}, as printed."
    return Table(f"{paper.key}_table{table.number}", title, tuple(columns), tuple(rows))


def _as_printed(row: published.Row, methods: tuple[str, ...]) -> dict[str, Cell]:
    cells = {m: row.cells[m].text if m in row.cells else "" for m in methods}
    return {"row": row.name, "unit": row.unit, "ci": row.ci_text, **cells, **row.tests}


def audited(paper: published.Paper) -> Table:
    """What a paper's own numbers contradict."""
    columns = (
        Column(("where",), "Where", text=True),
        Column(("what",), "What", text=True),
        Column(("printed",), "In print", text=True),
        Column(("recomputed",), "From its other numbers", text=True),
        Column(("reading",), "Likely reading", text=True),
    )
    rows = tuple(
        Row(
            {
                "where": one.row,
                "what": f"{one.what} (remark)" if one.is_remark else one.what,
                "printed": one.printed,
                "recomputed": one.recomputed,
                "reading": one.reading,
            },
            group=f"Table {one.table}",
        )
        for one in audit(paper)
    )
    title = f"{paper.name}: what cannot be as printed."
    return Table(f"{paper.key}_audit", title, columns, rows, (paper.citation,))


def name_beside(tag: str) -> str:
    """The stem of the file that `beside` fills."""
    return f"{tag}_beside_{COMPARED}"


def beside(tag: str, results: Results) -> Table:
    """This study's means beside the printed ones; ``tag`` is table1 to table4."""
    paper = published.load_paper(COMPARED)
    as_printed = paper.table(int(tag.removeprefix("table")))
    meant = as_meant(as_printed)
    pairs = list(zip(as_printed.rows, meant.rows, strict=True))
    return Table(
        name_beside(tag),
        f"Table {as_printed.number} of {paper.name} beside this study. {as_printed.about}: mean "
        "(standard deviation).",
        tuple(_columns(as_printed)),
        tuple(_beside_row(tag, results, as_printed, row, true) for row, true in pairs),
        tuple(_notes(paper, as_printed, meant)),
    )


def _columns(table: published.PrintedTable) -> Iterator[Column]:
    yield Column(("row",), "Row", text=True)
    yield Column(("n",), "n here", count)
    for method in table.methods:
        if method in _METHODS:
            yield Column(_here_fields(method), f"{method} here", mean_sd(2))
        yield Column(_printed_fields(method), _in_print(method), mean_sd(2))
    yield Column(_here_fields(RM_MASS), f"{RM_MASS} here", mean_sd(2))
    yield Column(("unit",), "unit here", text=True)
    yield Column(("printed_unit",), "unit in print", text=True)


def _beside_row(
    tag: str,
    results: Results,
    table: published.PrintedTable,
    row: published.Row,
    true: published.Row,
) -> Row:
    topic = _topic(results, row)
    values: dict[str, Cell] = {"row": row.name, "unit": "", "n": nan, "printed_unit": row.unit}
    values |= dict.fromkeys(_here_fields(RM_MASS), nan)
    for method in table.methods:
        values |= dict.fromkeys(_here_fields(method), nan) | _printed_values(method, true)
    if topic is not None:
        values |= {"unit": topic.unit, **_here(tag, results, topic)}
    moved = (m for m in table.methods if true.cells.get(m) != row.cells.get(m))
    return Row(values, marks={_in_print(method): _MOVED for method in moved})


def _here_fields(method: str) -> tuple[str, str]:
    return f"{_column(method)}_mean", f"{_column(method)}_sd"


def _printed_fields(method: str) -> tuple[str, str]:
    return f"{_column(method)}_printed_mean", f"{_column(method)}_printed_sd"


def _column(method: str) -> str:
    return method.lower().replace(" ", "_").replace("+", "_")


def _in_print(method: str) -> str:
    return f"{method} in print"


def _printed_values(method: str, row: published.Row) -> dict[str, Cell]:
    cell = row.cells.get(method)
    mean, sd = (cell.mean, cell.sd) if cell is not None else (None, None)
    middles = (nan if one is None else round(one.middle, _DIGITS) for one in (mean, sd))
    return dict(zip(_printed_fields(method), middles, strict=True))


def _topic(results: Results, row: published.Row) -> Topic | None:
    """The same variable of this study, in the task of that name where the row is of one."""
    variable, _, task = row.compare.partition(" ")
    for topic in results.topics:
        role_fits = topic.role == "sequence" if task == "sequence" else task in ("", topic.task)
        if topic.variable == variable and role_fits:
            return topic
    return None


def _here(tag: str, results: Results, topic: Topic) -> dict[str, Cell]:
    """This study's n, means and standard deviations by the paper's names of the methods."""
    if tag in _PAIRED:
        found = [results.find(topic, "paired_t")]
    else:
        found = [results.find(topic, "bonferroni_t", MEASURED, method) for method in (OM, RM)]
    values: dict[str, Cell] = {"n": found[0].n}
    for pair in found:
        values |= _means(pair)
    one_number = results.find(topic, "paired_t", OM, RM_MASS)
    return values | dict(
        zip(_here_fields(RM_MASS), (one_number.mean_b, one_number.sd_b), strict=True)
    )


def _means(pair: Comparison) -> dict[str, Cell]:
    names = {method: name for name, method in _METHODS.items()}
    fields = (*_here_fields(names[pair.method_a]), *_here_fields(names[pair.method_b]))
    return dict(zip(fields, (pair.mean_a, pair.sd_a, pair.mean_b, pair.sd_b), strict=True))


def _notes(
    paper: published.Paper, as_printed: published.PrintedTable, meant: published.PrintedTable
) -> Iterator[str]:
    yield f"Printed values: {paper.citation} ({paper.url})."
    if meant != as_printed:
        yield f"{_MOVED} In print these cells stand in each other's place (bsip published audit)."
    unit = unit_of_length(paper, as_printed)
    if unit:
        rows = " and ".join(row.name for row in as_printed.rows if row.error_of)
        yield f"The printed {rows} fit {unit}, whatever the text says (bsip published audit)."
