"""The reports as a browser shows them: no complaint, every fold opens, nothing overflows."""

from __future__ import annotations

import pytest

from tests.report.browser import chromium, opened

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
        yield page


def test_nothing_complains_and_all_is_folded_at_first(page):
    assert page.value("document.readyState") == "complete"
    assert page.complaints == []
    assert page.value("document.querySelectorAll('details').length") > 4
    assert page.value("document.querySelectorAll('details[open]').length") == 0


def test_a_click_opens_each_fold_and_every_figure_is_whole(page):
    page.value("document.querySelectorAll('summary').forEach(title => title.click())")
    assert page.value("document.querySelectorAll('details:not([open])').length") == 0
    broken = page.value(
        "Promise.all([...document.images].map(i => i.decode().then(() => 0, () => i.alt)))"
        ".then(() => [...document.images].filter(i => !i.naturalWidth || !i.clientWidth)"
        ".map(i => i.alt))"
    )
    assert page.value("document.images.length") >= 2
    assert broken == []
    assert page.complaints == []


@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_is_wider_than_a_phone_or_a_desktop(page, width):
    page.resize(width)
    page.value("document.querySelectorAll('details').forEach(fold => { fold.open = true })")
    assert page.value("innerWidth") == width
    assert page.value("document.documentElement.scrollWidth") <= width


def test_the_first_page_fits_on_one_sheet(page):
    page.value("document.querySelectorAll('details').forEach(fold => { fold.open = false })")
    assert page.sheets() == 1
