"""What the papers print, what of it cannot be true, and this study next to it."""

from __future__ import annotations

from math import nan

from bsip_cli.report.tables.model import FORMS, TEXTS, Cell, Column, Results, Row, Table
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS
from bsip_cli.statistics.published import Paper, PrintedTable, load_paper
from bsip_cli.statistics.published import Row as PrintedRow

COMPARED = "hansen2017"  # the paper whose tables this study's tables 1 to 4 repeat
_PAIRED = ("table1", "table2", "table4")
_METHODS = {"FP": MEASURED, "OM": OM, "RM": RM}  # in print
_MOVED = "†"


def printed(paper: Paper, table: PrintedTable) -> Table:
    """A table of a paper as it is printed."""
    first = table.rows[0]
    headings = {method: method for method in table.methods}
    headings |= {"ci": "95% CI"} if first.ci_text else {}
    headings |= {name: name for name in ("t", "p", "d", "F") if name in first.tests}
    columns = [Column(("row",), "Row", text=True)]
    columns += [Column((name,), heading) for name, heading in headings.items()]
    columns += [Column(("unit",), "unit", text=True)] if any(x.unit for x in table.rows) else []
    rows = []
    for row in table.rows:
        cells = {m: row.cells[m].text if m in row.cells else "" for m in table.methods}
        values = {"row": row.name, "unit": row.unit, "ci": row.ci_text}
        rows.append(Row({**values, **cells, **row.tests}))
    title = f"{paper.name}, table {table.number}. {table.about}, as printed."
    return Table(f"{paper.key}_table{table.number}", title, tuple(columns), tuple(rows))


def audited(paper: Paper) -> Table:
    """What a paper's own numbers contradict."""
    headings = {"row": "Where", "what": "What", "printed": "In print"}
    headings |= {"recomputed": "From its other numbers", "reading": "Likely reading"}
    columns = tuple(Column((name,), heading, text=True) for name, heading in headings.items())
    rows = tuple(Row(slip, group=f"Table {slip['table']}") for slip in paper.slips)
    title = f"{paper.name}: what cannot be as printed."
    return Table(f"{paper.key}_audit", title, columns, rows, (paper.citation,))


def comparison_name(tag: str) -> str:
    """The stem of the file that `next_to_published` fills."""
    return f"{tag}_beside_{COMPARED}"


def next_to_published(tag: str, results: Results) -> Table:
    """This study's means next to the printed ones; ``tag`` is table1 to table4."""
    paper = load_paper(COMPARED)
    table = paper.table(int(tag.removeprefix("table")))
    meant = table.as_meant()
    form = FORMS["mean_sd"]
    columns = [Column(("row",), "Row", text=True), Column(("n",), "n here", FORMS["count"])]
    for method in table.methods:
        here = Column(_fields(method), f"{method} here", form)
        columns += [here] if method in _METHODS else []
        columns.append(Column(_fields(method, "_printed"), f"{method} in print", form))
    columns += [
        Column(_fields(RM_MASS), f"{RM_MASS} here", form),
        Column(("unit",), "unit here", text=True),
        Column(("printed_unit",), "unit in print", text=True),
    ]
    rows = []
    for row, true in zip(table.rows, meant.rows, strict=True):
        values: dict[str, Cell] = {"row": row.name, "unit": "", "n": nan, "printed_unit": row.unit}
        for method in (RM_MASS, *table.methods):
            cell = true.cells.get(method)
            numbers = (cell.mean, cell.sd) if cell is not None else (nan, nan)
            values |= dict.fromkeys(_fields(method), nan)
            values |= dict(zip(_fields(method, "_printed"), numbers, strict=True))
        moved = [m for m in table.methods if true.cells.get(m) != row.cells.get(m)]
        marks = {f"{method} in print": _MOVED for method in moved}
        rows.append(Row(values | _found_here(tag, results, row), marks=marks))
    title = f"Table {table.number} of {paper.name} next to this study. {table.about}: mean "
    title += "(standard deviation)."
    notes = [f"Printed values: {paper.citation} ({paper.url})."]
    if meant != table:
        notes.append(f"{_MOVED} {TEXTS['published']['moved']}")
    if unit := table.fits_unit:
        of = " and ".join(row.name for row in table.rows if row.error_of)
        notes.append(TEXTS["published"]["unit"].format(rows=of, unit=unit))
    return Table(comparison_name(tag), title, tuple(columns), tuple(rows), tuple(notes))


def _fields(method: str, of: str = "") -> tuple[str, str]:
    name = method.lower().replace(" ", "_").replace("+", "_")
    return f"{name}{of}_mean", f"{name}{of}_sd"


def _found_here(tag: str, results: Results, row: PrintedRow) -> dict[str, Cell]:
    """Of the same variable, in the task of that name where the row is of one."""
    variable, _, task = row.compare.partition(" ")
    for topic in (one for one in results.topics if one.variable == variable):
        if topic.role == "sequence" if task == "sequence" else task in ("", topic.task):
            break
    else:
        return {}
    found = [results.find(topic, "paired_t")]
    if tag not in _PAIRED:
        found = [results.find(topic, "bonferroni_t", MEASURED, method) for method in (OM, RM)]
    names = {method: name for name, method in _METHODS.items()} | {RM_MASS: RM_MASS}
    values: dict[str, Cell] = {"unit": topic.unit, "n": found[0].n}
    for pair in (results.find(topic, "paired_t", OM, RM_MASS), *found):
        fields = (*_fields(names[pair.method_a]), *_fields(names[pair.method_b]))
        numbers = (pair.mean_a, pair.sd_a, pair.mean_b, pair.sd_b)
        values |= dict(zip(fields, numbers, strict=True))
    return values
