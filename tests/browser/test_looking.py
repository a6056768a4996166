"""A recording without images: its radar can be looked at, nothing can be clicked, and the page says what was found."""

import re
from collections.abc import Callable

import pytest

from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


@pytest.fixture
def page(open_page: Callable[..., Driver], radar_only_server: RunningServer) -> Driver:
    driver = open_page(radar_only_server.url, ready="__cocalib.state.look")
    driver.until("__cocalib.state.placementsKnown && __cocalib.state.radarMap")
    return driver


def test_the_page_says_what_was_found_and_that_nothing_can_be_clicked(page: Driver) -> None:
    assert re.match(r"\d+ placements found, [\d.]+ to", page.text("#status-text"))
    assert "nothing can be clicked" in page.text("#warnings")
    assert "Add the camera's file" in page.text("#warnings")
    for name in ("undo", "redo"):
        assert page.page.is_disabled(f"#{name}")
    assert not page.page.is_visible("#tab-check")
    assert not page.page.is_visible("#tab-deliver")
    assert not page.page.is_visible("#marks")


@pytest.mark.slow
def test_keys_and_the_table_go_from_placement_to_placement(page: Driver) -> None:
    rows = page.page.locator("#page-mark [data-placement]")
    assert rows.count() == page.value("__cocalib.state.placements.length") >= 10
    page.press("n")
    page.until("__cocalib.state.look.index === __cocalib.state.placements[0].frame")
    assert page.text("#guide").startswith("Placement 1 of ")
    rows.nth(4).click()
    page.until("__cocalib.state.look.index === __cocalib.state.placements[4].frame")
    assert rows.nth(4).get_attribute("aria-selected") == "true"


@pytest.mark.slow
def test_the_view_from_above_explains_what_is_under_the_pointer(page: Driver) -> None:
    page.press("n")
    page.until("__cocalib.state.look.index === __cocalib.state.placements[0].frame")
    place = page.page.evaluate(
        """async () => {
            const { toCanvas } = await import("/image/birdseye.js");
            const box = document.getElementById("birdseye").getBoundingClientRect();
            const [x, y] = __cocalib.state.placements[0].position_radar_m;
            const [px, py] = toCanvas(x, y);
            return [box.left + px, box.top + py];
        }"""
    )
    page.page.mouse.move(*place)
    page.until("!document.getElementById('tip').hidden")
    tip = page.text("#tip")
    assert "Placement 1 of" in tip
    assert f"{page.value('__cocalib.state.placements[0].range_m'):.1f} m" in tip


@pytest.mark.slow
def test_returns_stay_as_long_as_chosen_and_playing_goes_through_the_scans(page: Driver) -> None:
    page.press("n", "n")
    page.until("__cocalib.state.look.index === __cocalib.state.placements[1].frame")
    oldest = "Math.max(...__cocalib.state.look.returns.map((row) => row[9]))"
    assert 1.0 < page.value(oldest) <= 2.0
    page.page.click("#look-options .chip >> nth=0")
    page.until(f"{oldest} > 5")
    page.page.click("#look-options .chip >> nth=0")
    page.until(f"{oldest} === 0")
    before = page.value("__cocalib.state.cursor")
    page.press(" ")
    page.until(f"__cocalib.state.look.index > {before} + 5")
    page.press(" ")
    page.until("!__cocalib.state.playing && __cocalib.state.look.index === __cocalib.state.cursor")
