"""The sheet Evaluate: the calibration judged by boxes of a file, or around what moves."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import expect

from calib_core.boxes import boxes_text
from calib_core.measurements import Boxes, TimeNs
from cocalib.web.port.server import RunningServer
from tests.browser.accessibility import violations
from tests.browser.driving import Driver
from tests.serving import serving
from tests.street_recording import StreetRecording, reference_calibration

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


@pytest.fixture(scope="module")
def walk() -> StreetRecording:
    return StreetRecording()


@pytest.fixture
def street_server(walk: StreetRecording, tmp_path: Path) -> Iterator[RunningServer]:
    with serving(
        walk, tmp_path / "s", camera=walk.camera(), name="street", reference=reference_calibration(), token="test"
    ) as (running, _):
        yield running


def acc(page: Driver) -> float:
    """Wait for figures; return Acc [%]."""
    page.until("document.querySelector('.acc[aria-busy=false] [data-acc=acc]')")
    return float(re.split(" ±", page.text(".acc [data-acc=acc] dd"))[0])


def give(page: Driver, name: str, text: str) -> None:
    page.page.get_by_label("File of boxes").set_input_files(
        {"name": name, "mimeType": "application/json", "buffer": text.encode()}
    )


@pytest.mark.slow
def test_the_calibration_is_judged_by_boxes_of_a_file_and_around_what_moves(
    open_page: Callable[..., Driver], street_server: RunningServer, walk: StreetRecording
) -> None:
    page = open_page(street_server.url, reduced_motion="reduce")
    page.press("a")
    give(page, "boxes.json", boxes_text(walk.street.boxes))
    given = acc(page)
    assert given > 50
    expect(page.page.locator(".acc-about")).to_contain_text("boxes.json: 40")
    expect(page.page.locator(".acc-caution")).to_contain_text("1 of 3")
    assert page.page.locator(".acc-angles").count() == 0
    assert not page.view["can_undo"], "boxes are no step of the session"

    elsewhere = replace(walk.street.boxes.frames[0], image_time=TimeNs(5_000_000_000))
    give(page, "other.json", boxes_text(Boxes((elsewhere,), "other.json")))
    expect(page.page.locator(".toast")).to_contain_text("other.json")
    assert acc(page) == given

    page.page.reload()
    page.until("__cocalib.state.shown && __cocalib.state.view")
    page.press("a")
    assert acc(page) == given
    page.page.get_by_role("button", name="Find what moves").click()
    page.until("document.querySelector('.acc-about').textContent.startsWith('what moves')")
    assert acc(page) > 20


@pytest.mark.slow
def test_the_sheet_needs_no_mouse_and_fits_every_window(
    open_page: Callable[..., Driver], street_server: RunningServer, walk: StreetRecording
) -> None:
    page = open_page(street_server.url, reduced_motion="reduce")
    page.press("a")
    give(page, "boxes.json", boxes_text(walk.street.boxes))
    acc(page)
    for theme in ("dark", "light"):
        assert page.value("document.documentElement.dataset.theme") == theme
        assert violations(page) == []
        page.page.click("#menu-button")
        page.page.click("#theme")
    for width, height in ((1440, 900), (1280, 720), (390, 844)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.drawn()
        sheet = page.page.locator("#page-evaluate")
        assert sheet.evaluate("(sheet) => sheet.scrollWidth <= sheet.clientWidth"), f"{width} px wide"
    page.page.locator("#image-pane").focus()
    page.press("a")
    assert sheet.is_hidden()
