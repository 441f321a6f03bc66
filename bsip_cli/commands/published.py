"""``bsip published``: the papers' tables, and what in them cannot be true."""

from __future__ import annotations

from collections.abc import Iterator

from bsip_cli.report.tables.formats import to_markdown
from bsip_cli.report.tables.published import audited, printed
from bsip_cli.statistics.published.paper import Paper, load_paper, names


def shown(what: str, paper: str | None) -> Iterator[str]:
    """The parts of the answer as Markdown: ``what`` is show or audit; of one paper, or of all.

    Raises
    ------
    UsageError
        There is no such paper.
    """
    for one in (load_paper(name) for name in ([paper] if paper else names())):
        yield from _audit(one) if what == "audit" else _tables(one)


def _tables(paper: Paper) -> Iterator[str]:
    for table in paper.tables:
        yield to_markdown(printed(paper, table))


def _audit(paper: Paper) -> Iterator[str]:
    table = audited(paper)
    yield to_markdown(table) if table.rows else f"**{paper.name}: {_sound(paper)}.**\n"


def _sound(paper: Paper) -> str:
    if all(table.design == "described" and not table.claims for table in paper.tables):
        return "nothing in it can be recomputed from what is printed"
    return "its numbers agree"
