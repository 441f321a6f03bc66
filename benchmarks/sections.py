"""Generated parts of a Markdown page, between two comments that name them."""

from __future__ import annotations

from pathlib import Path


def replace_section(page: Path, name: str, content: str) -> None:
    """Put ``content`` between the page's marks of this name."""
    start, stop = marks(name)
    text = page.read_text(encoding="utf-8")
    if text.count(start) != 1 or text.count(stop) != 1:
        raise ValueError(f"{page} has no section between {start} and {stop}")
    before, rest = text.split(start)
    after = rest.split(stop)[1]
    page.write_text(f"{before}{start}\n\n{content}\n\n{stop}{after}", encoding="utf-8")


def read_section(page: Path, name: str) -> str:
    """What stands between the marks; empty without page or marks."""
    start, stop = marks(name)
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    return text.split(start)[1].split(stop)[0].strip() if start in text else ""


def marks(name: str) -> tuple[str, str]:
    return f"<!-- {name}: generated -->", f"<!-- {name}: end -->"
