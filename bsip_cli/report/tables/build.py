"""The papers' six tables, from the cohort's results to text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from bsip_cli.report.tables import notes, paired, posturography, published, six_components
from bsip_cli.report.tables.formats import to_csv, to_latex, to_markdown
from bsip_cli.report.tables.model import Results, Table
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.cohort_values import Comparison

BUILDERS: dict[str, Callable[[Results, Criteria], Table]] = {
    "table1": paired.segment_mass,
    "table2": paired.cop_rmse,
    "table3": posturography.build,
    "table4": paired.cross_validation,
    "table5": six_components.build,
    "table6": paired.centres_of_mass,
}
IN_PRINT = ("table1", "table2", "table3", "table4")
NAMES = (
    "table1_segment_mass",
    "table2_cop_rmse",
    "table3_posturography",
    "table4_cross_validation",
    "table5_six_components",
    "table6_centres_of_mass",
)
BESIDE = tuple(published.name_beside(tag) for tag in IN_PRINT)
RENDERERS: dict[str, Callable[[Table], str]] = {
    "csv": to_csv,
    "md": to_markdown,
    "tex": to_latex,
}


def build_tables(
    comparisons: pd.DataFrame,
    criteria: Criteria,
    fitted_on: Sequence[Mapping] = (),
    missing: Sequence[Mapping] = (),
) -> tuple[Table, ...]:
    """The six tables as data, and the first four beside the published values.

    Parameters
    ----------
    comparisons : the artifact of ``stats``.
    criteria : the options with which it was computed.
    fitted_on : what each task's data were to OM, as a fact of the values: ``table``, ``task``,
        ``role``, and of how many participants (``everyone``) OM was fitted to them
        (``identification``).
    missing : who is not in which tables: ``sentence`` and ``tables`` (as in `BUILDERS`).
    """
    rows = [Comparison.from_row(row) for row in comparisons.to_dict("records")]
    tables = []
    for tag, build in BUILDERS.items():
        table = build(Results(row for row in rows if row.topic.table == tag), criteria)
        absent = [str(gone["sentence"]) for gone in missing if tag in gone["tables"]]
        more = (
            *notes.fitted_on(counts for counts in fitted_on if counts["table"] == tag),
            notes.missing(absent),
        )
        tables.append(replace(table, notes=(*table.notes, *filter(None, more))))
    return (*tables, *_beside_print(rows))


def _beside_print(rows: Sequence[Comparison]) -> Iterator[Table]:
    """Tables 1 to 4 with the published values."""
    for tag in IN_PRINT:
        yield published.beside(tag, Results(row for row in rows if row.topic.table == tag))


def render_markdown(
    comparisons: pd.DataFrame,
    criteria: Criteria,
    fitted_on: Sequence[Mapping] = (),
    missing: Sequence[Mapping] = (),
) -> dict[str, str]:
    """All tables as Markdown, by the stem of their file; parameters as `build_tables`."""
    tables = build_tables(comparisons, criteria, fitted_on, missing)
    return {table.name: to_markdown(table) for table in tables}


def folder(out: Path) -> Path:
    """Where the written tables lie."""
    return out / "group" / "tables"


def show(out: Path) -> str:
    """The written Markdown tables of an output folder, one after the other; empty without any."""
    paths = [folder(out) / f"{name}.md" for name in NAMES]
    texts = [path.read_text(encoding="utf-8") for path in paths if path.exists()]
    return "\n\n".join(texts)
