"""The documentation: its length, its links, and that every page is found from the first."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
MOST_WORDS = 25_000
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def links(page: Path) -> list[tuple[Path, str]]:
    """File and anchor of every link within the repository."""
    without_code = re.sub(r"```.*?```", "", text_of(page), flags=re.DOTALL)
    found = [one for one in _LINK.findall(without_code) if "://" not in one]
    parts = [one.partition("#") for one in found]
    return [((page.parent / path).resolve() if path else page, anchor) for path, _, anchor in parts]


def anchors(page: Path) -> set[str]:
    """Of the headings, as GitHub and Python-Markdown make them."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", one).strip().lower().replace(" ", "-") for one in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for file, anchor in links(page):
        assert file.exists(), f"{page.name} links to {file}"
        if anchor and file.suffix == ".md":
            assert anchor in anchors(file), f"{page.name} links to {file.name}#{anchor}"


def test_every_page_is_found_from_the_first():
    for index in DOCS.rglob("index.md"):
        linked = {file for file, _ in links(index)}
        assert {page for page in index.parent.glob("*.md") if page != index} <= linked
    assert set(DOCS.glob("*/index.md")) <= {file for file, _ in links(DOCS / "index.md")}


def test_every_table_of_results_is_in_the_summary():
    linked = {file for file, _ in links(DOCS / "results.md")}
    assert set((DOCS / "results").glob("*.csv")) <= linked


def test_files_named_in_code_are_there():
    for path in (*(ROOT / "bsip_cli").rglob("*.py"), *(ROOT / "configs").rglob("*.toml")):
        for name in re.findall(r"docs/[\w/]+\.(?:md|csv)", text_of(path)):
            assert (ROOT / name).is_file(), f"{path.name} names {name}"


def test_modules_named_on_pages_are_there():
    modules = {
        path.name
        for folder in ("bsip_cli", "tests", "benchmarks")
        for path in (ROOT / folder).rglob("*.py")
    }
    for page in (*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"):
        named = re.findall(r"(\w+\.py)\b", text_of(page))
        assert set(named) <= modules, page.name


def test_the_pages_are_short_enough():
    read = [ROOT / "README.md", *DOCS.rglob("*.md")]
    assert sum(len(text_of(page).split()) for page in read) <= MOST_WORDS


def test_every_page_is_in_the_site():
    named = re.findall(r": ([\w/]+\.md)$", text_of(ROOT / "mkdocs.yml"), flags=re.MULTILINE)
    pages = {*DOCS.glob("*.md"), *DOCS.glob("*/index.md")}  # the others are found from an index
    assert {DOCS / name for name in named} == pages
