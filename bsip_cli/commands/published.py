"""``bsip published``: the papers' tables, and what in them cannot be true."""

from __future__ import annotations

from collections.abc import Iterator

from bsip_cli.report.tables.formats import to_markdown
from bsip_cli.report.tables.published import audited, printed
from bsip_cli.statistics.published.paper import load_paper, names


def shown(what: str, paper: str | None) -> Iterator[str]:
    """The parts of the answer as Markdown: ``what`` is show or audit; of one paper, or of all.

    Raises
    ------
    UsageError
        There is no such paper.
    """
    for one in (load_paper(name) for name in ([paper] if paper else names())):
        if what == "show":
            yield from (to_markdown(printed(one, table)) for table in one.tables)
        elif (slips := audited(one)).rows:
            yield to_markdown(slips)
        else:
            is_told = any(table.design != "described" or table.claims for table in one.tables)
            nothing = "nothing in it can be recomputed from what is printed"
            yield f"**{one.name}: {'its numbers agree' if is_told else nothing}.**\n"
