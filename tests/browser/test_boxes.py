"""Boxes: drawn on the picture, followed through the frames, corrected, judged, and kept."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from cocalib.web.port.server import RunningServer
from tests.browser.accessibility import violations
from tests.browser.driving import Driver
from tests.serving import serving
from tests.street_recording import StreetRecording, reference_calibration, true_edges

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


def judged(page: Driver) -> float:
    """Wait until the boxes have been followed and judged; return Acc [%]."""
    page.settle()
    page.until("__cocalib.state.view.boxes.every((track) => !track.following)")
    page.until("__cocalib.state.view.acc.figures.length > 0 && !__cocalib.state.view.acc.judging")
    [acc] = [figure["value"] for figure in page.view["acc"]["figures"] if figure["key"] == "acc"]
    return float(re.split(" ±", acc)[0])


def box_here(page: Driver) -> list[float]:
    """The edges of the only box of the frame on screen, as last sent."""
    page.until("__cocalib.boxing.frame.index === __cocalib.state.cursor && !__cocalib.boxing.draft")
    [row] = page.value("__cocalib.boxing.frame.boxes")
    return list(row[2])


def corners(edges: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    return (edges[0], edges[1]), (edges[2], edges[3])


def test_a_box_is_drawn_followed_corrected_judged_and_kept(
    open_page: Callable[..., Driver], street_server: RunningServer, walk: StreetRecording
) -> None:
    page = open_page(street_server.url, reduced_motion="reduce")
    page.press("a")
    page.go_to(3)
    page.drag(*corners(true_edges(walk.street, 3)))
    first = judged(page)
    [track] = page.view["boxes"]
    assert (track["label"], track["first"], track["last"], track["keyframes"]) == ("person", 3, 39, [3])
    page.go_to(30)
    assert box_here(page) == pytest.approx(true_edges(walk.street, 30), abs=9)
    assert page.view["clicks"] == []
    expect(page.page.locator(".acc-caution")).to_contain_text("1 of 3 targets with a box")
    assert page.page.locator(".acc-angles").count() == 0

    left, top, right, bottom = box_here(page)
    page.drag(((left + right) / 2, (top + bottom) / 2), ((left + right) / 2 + 120, (top + bottom) / 2))
    page.until("__cocalib.state.view.boxes[0].keyframes.length === 2")
    assert judged(page) < first - 20
    assert box_here(page) == pytest.approx([left + 120, top, right + 120, bottom], abs=1.5)
    page.go_to(17)  # halfway between the two, so that half of the correction reaches it
    assert box_here(page)[0] == pytest.approx(true_edges(walk.street, 17)[0] + 60, abs=12)
    page.press("Control+z")
    page.until("__cocalib.state.view.boxes[0].keyframes.length === 1")
    assert judged(page) == first

    page.go_to(35)
    page.press("h")
    page.until("__cocalib.state.view.boxes[0].last === 34")
    before = judged(page)
    page.page.reload()
    page.until("__cocalib.state.shown && __cocalib.state.view")
    assert judged(page) == before
    assert page.view["boxes"][0]["hidden"] == [35]
    page.press("a")
    with page.page.expect_download() as download:
        page.page.click("text=Download boxes")
    found = json.loads(Path(download.value.path()).read_text())
    assert found["schema"] == "cocalib/boxes-1"
    assert [len(frame["boxes"]) for frame in found["frames"]] == [1] * 32

    page.page.get_by_label("File of boxes").set_input_files(download.value.path())
    page.until("__cocalib.state.view.boxes[0].keyframes.length === 0")  # they stay in the frames of the file
    assert judged(page) == before
    other = json.dumps({**found, "frames": [{**found["frames"][0], "image_time": {"sec": 5, "nanosec": 0}}]})
    page.page.get_by_label("File of boxes").set_input_files(
        {"name": "other.json", "mimeType": "application/json", "buffer": other.encode()}
    )
    expect(page.page.locator(".toast")).to_contain_text("other.json")
    assert len(page.view["boxes"]) == 1


def test_boxes_need_no_mouse_and_fit_every_window(
    open_page: Callable[..., Driver], street_server: RunningServer
) -> None:
    page = open_page(street_server.url, reduced_motion="reduce")
    page.press("a", "Enter")
    page.until("__cocalib.state.view.boxes.length === 1 && !__cocalib.boxing.draft")
    before = box_here(page)
    page.press("Alt+ArrowRight", "Alt+Shift+ArrowDown")
    page.until("__cocalib.boxing.frame.boxes[0][2][1] > " + str(before[1] + 5))
    assert box_here(page) == pytest.approx([before[0] + 1, before[1] + 10, before[2] + 1, before[3] + 10], abs=0.02)
    page.page.keyboard.press("r")
    page.page.keyboard.type("wheelchair")
    page.page.keyboard.press("Tab")
    page.until("__cocalib.state.view.boxes[0].label === 'wheelchair'")
    page.page.get_by_label("right edge [px]").fill("900")
    page.until("__cocalib.boxing.frame.boxes[0][2][2] === 900")
    page.page.keyboard.press("Tab")
    at_rest = "!__cocalib.state.view.boxes[0].following && !document.querySelector('.stale')"
    judged_or_not = f"!__cocalib.state.view.acc.judging && {at_rest}"
    page.until(judged_or_not)
    for theme in ("dark", "light"):
        assert page.value("document.documentElement.dataset.theme") == theme
        assert violations(page) == []
        page.page.click("#menu-button")
        page.page.click("#theme")
    for width, height in ((1440, 900), (1280, 720), (390, 844)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.drawn()
        tab = page.page.locator("#page-evaluate")
        assert tab.evaluate("(tab) => tab.scrollWidth <= tab.clientWidth"), f"{width} px wide"
        assert page.page.locator("#tabs").evaluate("(tabs) => tabs.scrollWidth <= tabs.clientWidth"), f"{width} px wide"
    page.page.locator("#picture-pane").focus()
    page.press("Escape")
    assert page.value("__cocalib.boxing.selected") is None
    page.press("a")
    assert not page.value("__cocalib.boxing.on")
