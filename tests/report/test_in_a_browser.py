"""The reports as a browser shows them: no complaint, whole figures, working parts."""

from __future__ import annotations

import pytest
from browser import Page, chromium, opened

pytestmark = pytest.mark.skipif(
    chromium() is None, reason="no chromium here: reports are not opened in a browser"
)


@pytest.fixture(scope="module", params=["sub-01", "group"])
def page(request, reports, tmp_path_factory):
    file = reports.out / request.param / "report.html"
    with opened(file, tmp_path_factory.mktemp("profile")) as page:
        page.name = request.param
        yield page


def test_nothing_complains(page):
    assert page.value("document.readyState") == "complete"
    assert page.complaints == []


def test_every_figure_is_visible(page):
    broken = page.value(
        "[...document.images].filter(i => !i.complete || !i.naturalWidth || !i.clientWidth)"
        ".map(i => i.alt)"
    )
    assert page.value("document.images.length") > 2
    assert broken == []


def test_links_inside_lead_somewhere(page):
    lost = page.value(
        "[...document.querySelectorAll('a[href^=\"#\"]')].map(a => a.getAttribute('href'))"
        ".filter(h => !document.querySelector(h))"
    )
    assert page.value("document.querySelectorAll('a[href^=\"#\"]').length") > 3
    assert lost == []


def test_nothing_is_wider_than_the_page(page):
    assert page.value("document.documentElement.scrollWidth <= innerWidth")


def column(page: Page, number: int) -> list[str]:
    return page.value(
        "[...document.querySelector('table:has(th button)').tBodies[0].rows]"
        f".map(r => r.cells[{number}].textContent.trim())"
    )


def test_a_click_on_a_title_sorts_the_table(page):
    click = "document.querySelectorAll('table:has(th button) th button')[0].click()"
    before = column(page, 0)
    page.value(click)
    rising = column(page, 0)
    page.value(click)
    falling = column(page, 0)
    assert sorted(rising) == sorted(before)
    assert falling != rising or len(set(rising)) == 1
    assert page.value("document.querySelector('th[aria-sort]').getAttribute('aria-sort')")


def test_every_table_can_be_copied(page):
    tables = page.value("document.querySelectorAll('.grid').length")
    assert page.value("document.querySelectorAll('.grid > button.copy').length") == tables > 0


def painted(page: Page) -> list[int]:
    """How many pixels of each film are not white."""
    return page.value(
        "[...document.querySelectorAll('canvas')].map(c => c.getContext('2d')"
        ".getImageData(0, 0, c.width, c.height).data.filter((v, k) => k % 4 === 3 && v).length)"
    )


def picture(page: Page) -> str:
    return page.value("document.querySelector('canvas').toDataURL()")


def test_films_show_the_person_and_move(page):
    if page.name == "group":
        assert page.value("document.querySelectorAll('canvas').length") == 0
        return
    assert all(count > 2000 for count in painted(page))
    first = picture(page)
    page.value(
        "(() => { const s = document.querySelector('.film input'); s.value = s.max / 2;"
        " s.dispatchEvent(new Event('input')) })()"
    )
    middle = picture(page)
    page.value("document.querySelectorAll('.film .controls button')[2].click()")
    from_behind = picture(page)
    assert len({first, middle, from_behind}) == 3
    page.value("document.querySelector('.film .controls button').click()")
    page.value("new Promise(done => setTimeout(done, 600))")
    assert picture(page) != from_behind
    assert page.complaints == []
