"""The reports as a browser shows them: no complaint, whole figures, working parts."""

from __future__ import annotations

import json
import math

import pytest

from tests.report.browser import Page, chromium, opened

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        chromium() is None, reason="no chromium here: reports are not opened in a browser"
    ),
]


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


SORTED = {
    "number": [
        (["10", "9", "1\u2009234", "998", "–"], ["9", "10", "998", "1\u2009234", "–"]),
        (["3.1 × 10⁷", "998", "1.23 × 10⁻⁵"], ["1.23 × 10⁻⁵", "998", "3.1 × 10⁷"]),
        ([".001*", "<.001*", "−0.5", "1.000"], ["−0.5", "<.001*", ".001*", "1.000"]),
        (["12.10(0.2)", "3.84(1.49)"], ["3.84(1.49)", "12.10(0.2)"]),
        (["[2.0, 3.0]", "[−1.0, 2.0]", ""], ["[−1.0, 2.0]", "[2.0, 3.0]", ""]),
    ],
    "words": [
        (["sub-10", "sub-2", "sub-01"], ["sub-01", "sub-2", "sub-10"]),
        (["T10", "C7", "RMT2"], ["C7", "RMT2", "T10"]),
    ],
}


@pytest.mark.parametrize(
    ("kind", "cells", "rising"), [(kind, *case) for kind in SORTED for case in SORTED[kind]]
)
def test_a_click_on_a_title_sorts_the_table(page, kind, cells, rising):
    rows = "".join(f"<tr><td>{cell}</td></tr>" for cell in cells)
    table = f"<table><thead><tr><th class='{kind}'>x</th></tr></thead><tbody>{rows}</tbody></table>"
    page.value(
        "(() => { const d = document.createElement('div'); d.id = 'own'; "
        f"d.innerHTML = {json.dumps(table)}; document.getElementById('own')?.remove(); "
        "document.body.append(d); sortable(d.querySelector('table')); })()"
    )
    for expected in (rising, [*filled(rising)[::-1], *empty(rising)]):
        page.value("document.querySelector('#own th button').click()")
        shown = page.value(
            "[...document.querySelectorAll('#own td')].map(cell => cell.textContent)"
        )
        assert shown == expected
    assert page.value("document.querySelector('#own th').getAttribute('aria-sort')") == "descending"


def empty(cells: list[str]) -> list[str]:
    return [cell for cell in cells if cell in ("", "–")]


def filled(cells: list[str]) -> list[str]:
    return [cell for cell in cells if cell not in ("", "–")]


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
    shown, last = page.value(
        "(() => { const s = document.querySelector('.film input'); return [+s.value, +s.max] })()"
    )
    assert last / 2 < shown < last  # it goes on from where it stood, and has not run out


def test_what_is_farther_on_the_floor_is_seen_higher(page):
    """From behind the person's front is far, from the right their left; right stays right."""

    def seen(point: list[float], yaw: float) -> list[float]:
        return page.value(f"projected({point}, {{ yaw: {yaw}, pitch: 0.3 }})")

    assert seen([1.0, 0.0, 0.0], 0.0)[1] > seen([-1.0, 0.0, 0.0], 0.0)[1]
    assert seen([0.0, 1.0, 0.0], 0.0)[0] > 0.9
    from_the_right = -math.pi / 2
    assert seen([0.0, -1.0, 0.0], from_the_right)[1] > seen([0.0, 1.0, 0.0], from_the_right)[1]
    assert seen([1.0, 0.0, 0.0], from_the_right)[0] > 0.9


def test_arrow_keys_turn_the_film(page):
    if page.name == "sub-01":
        before = picture(page)
        page.value(
            "document.querySelector('canvas').dispatchEvent("
            "new KeyboardEvent('keydown', { key: 'ArrowLeft' }))"
        )
        assert picture(page) != before
