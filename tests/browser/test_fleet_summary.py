"""The fleet's summary page in a real browser: it sorts by mouse and keyboard, prints on landscape pages, and fetches nothing."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from cocalib.fleet.reading import read_fleet
from cocalib.fleet.summary_page import summary_html
from tests.browser.accessibility import page_violations
from tests.unit.app.fleet.made_results import FIRST_NS, make_fleet, make_result

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder, 12, 3, moved={"V003": np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])})
    make_result(folder, "V100", "s0", status="failed", reason="no such file")
    make_result(folder, "<script>document.title='x'</script> " + "a long name " * 6, "s0", recorded_ns=FIRST_NS)
    path = folder / "summary.html"
    path.write_text(summary_html(read_fleet(folder)), encoding="utf-8")
    return path


def _column(page: Page, index: int) -> list[str]:
    cells = page.locator("table.sortable").first.locator(f"tbody tr > :nth-child({index + 1})")
    return cells.all_inner_texts()


def test_it_sorts_by_mouse_and_keyboard_and_what_is_unknown_comes_last(chromium: Browser, summary: Path) -> None:
    page = chromium.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text))
    page.goto(summary.as_uri())
    assert page.title() == "Fleet calibration"
    table = page.locator("table.sortable").first
    head = table.locator("th", has=page.get_by_role("button", name="Δ deg"))
    page.get_by_role("button", name="Δ deg").first.click()
    expect(head).to_have_attribute("aria-sort", "ascending")
    numbers = [float(text.split()[0]) for text in _column(page, 8) if text != "–"]
    assert numbers == sorted(numbers)
    assert _column(page, 8)[-2:] == ["–", "–"]
    page.get_by_role("button", name="Δ deg").first.focus()
    page.keyboard.press("Enter")
    expect(head).to_have_attribute("aria-sort", "descending")
    assert _column(page, 0)[0] == "V003"
    assert _column(page, 8)[-2:] == ["–", "–"]
    assert table.locator("th[aria-sort=ascending], th[aria-sort=descending]").count() == 1
    page.get_by_role("button", name="verdict").first.click()
    assert _column(page, 0)[-1] == "V100"
    assert errors == []
    page.close()


def test_it_fits_screens_in_light_and_dark_and_anybody_can_read_it(chromium: Browser, summary: Path) -> None:
    asked: list[str] = []
    for width, height, scheme in ((1440, 900, "light"), (1280, 720, "dark"), (390, 720, "light")):
        context = chromium.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)  # type: ignore[arg-type]
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.goto(summary.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        table = page.locator("table.sortable").first
        if width > 1000:
            assert table.evaluate("table => table.scrollWidth <= table.parentElement.clientWidth")
        assert page_violations(page) == []
        context.close()
    assert asked == [summary.as_uri()] * 3


def test_it_prints_on_landscape_pages_with_the_table_within_the_paper(chromium: Browser, summary: Path) -> None:
    page = chromium.new_page(viewport={"width": 1047, "height": 725})  # A4 landscape without its margins
    page.goto(summary.as_uri())
    page.emulate_media(media="print")
    assert page.evaluate("document.documentElement.scrollWidth") <= 1047
    for table in page.locator("table.sortable").all():
        assert table.evaluate("table => table.scrollWidth <= table.parentElement.clientWidth")
    pdf = page.pdf(prefer_css_page_size=True)
    boxes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", pdf)
    assert boxes
    assert all(float(width) > float(height) for width, height in boxes)
    page.close()
