"""The report in a real browser: printed it has at most four pages, and the export panel downloads it."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from cocalib.report.page import report_html
from cocalib.report.printing import print_pdf
from cocalib.workspace import Workspace
from tests.browser.accessibility import page_violations
from tests.browser.driving import Driver
from tests.find_browser import find_browser
from tests.unit.app.report.planted import fullest_subject

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def _pages(pdf: bytes) -> int:
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf))


@pytest.mark.slow
def test_it_prints_to_four_pages_at_most_and_fits_a_telephone_without_a_word_from_elsewhere(
    chromium: Browser, project_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COCALIB_BROWSER", str(find_browser()))
    full = report_html(fullest_subject(project_root))
    assert _pages(print_pdf(full)) == 4
    (tmp_path / "report.html").write_text(full, encoding="utf-8")
    asked: list[str] = []
    for width, scheme in ((1280, "light"), (1280, "dark"), (390, "light")):
        context = chromium.new_context(viewport={"width": width, "height": 720}, color_scheme=scheme)  # type: ignore[arg-type]
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.goto((tmp_path / "report.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page_violations(page) == []
        context.close()
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


@pytest.mark.slow
def test_the_export_panel_downloads_the_report_of_the_answer_on_the_page(
    page: Driver, workspace: Workspace, project_root: Path, tmp_path: Path
) -> None:
    page.page.click("#tab-deliver")
    page.page.click('#page-deliver [data-export="report"]')
    expect(page.page.locator("#page-deliver .reason")).to_contain_text("four placements")
    workspace.import_clicks((project_root / "sample_data/rooftop/clicks.json").read_text(), "clicks.json")
    page.until("__cocalib.state.view.clicks.length > 4 && __cocalib.state.view.has_calibration")
    page.settle()
    shown = page.page.frame_locator("#page-deliver .report")
    expect(shown.locator("body")).to_contain_text("Mounting and its error")
    with page.page.expect_download() as download:
        page.page.click("#page-deliver .first")
    assert download.value.suggested_filename == "report.html"
    download.value.save_as(tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    translation = workspace.session.outcome.unwrap().camera_from_radar.translation_m.tolist()  # type: ignore[union-attr]
    assert all(f'value="{value!r}"' in html for value in translation)
