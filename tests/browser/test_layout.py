"""The page as a user finds it: what it says first, its layout, and what it remembers."""

from collections.abc import Callable
from typing import Any

import pytest

from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def test_a_new_user_is_told_what_to_do_and_led_to_the_first_click(page: Driver) -> None:
    page.until("__cocalib.state.placementsKnown")
    assert "inner corner" in page.text(".reflector")
    page.until("__cocalib.state.shown.index === __cocalib.state.placements[0].frame")
    assert page.value("document.getElementById('guide').classList.contains('act')")
    assert page.text("#guide").startswith("Placement 1 of ")
    page.press("n")
    page.until("__cocalib.state.shown.index === __cocalib.state.placements[1].frame")
    u, v = page.value("[__cocalib.viewport.imageWidth / 2, __cocalib.viewport.imageHeight / 2]")
    page.click(u, v)
    assert "Next placement" in page.text("#guide")
    assert page.page.locator(".reflector").count() == 0
    assert page.page.locator(".pairs .row").count() == 1


def test_dividers_and_theme_are_remembered(page: Driver) -> None:
    before = page.value("__cocalib.viewport.width")
    bar = page.page.locator("#divider-x").bounding_box()
    assert bar is not None
    page.page.mouse.move(bar["x"] + 2, bar["y"] + 200)
    page.page.mouse.down()
    page.page.mouse.move(bar["x"] - 102, bar["y"] + 200, steps=4)
    page.page.mouse.up()
    page.until(f"Math.abs({before} - 104 - __cocalib.viewport.width) <= 4")
    narrow = page.value("__cocalib.viewport.width")
    page.page.click("#menu-button")
    page.page.click("#theme")
    page.page.reload()
    page.until("__cocalib.state.shown")
    assert page.value("__cocalib.viewport.width") == narrow
    assert page.value("document.documentElement.dataset.theme") == "light"
    assert page.pixels("#bar").mean() > 200


SIZES = (
    (390, 844),
    (768, 1024),
    (640, 360),
    (1024, 768),
    (1280, 480),
    (1280, 720),
    (1440, 900),
    (1920, 1080),
    (3840, 2160),
)
"""From a phone to a 4K monitor; 640 x 360 is 1280 x 720 at 200 %."""
EXTREME_NAMES = {
    "name": "مسح رادار السيارة الأمامي في الطريق السريع الطويل جدا " + "2026_03_12_run_007_front_left" * 4 + ".bag",
    "topics": [
        "/vehicle/perception/sensors/front_left_corner/radar/points_raw",
        "/vehicle/perception/sensors/front_center/camera_wide/image_rect/compressed",
    ],
}


def give_extreme_names(page: Driver) -> None:
    """Let the recording and its topics have names as long as they come."""
    page.page.evaluate(
        "async ({ name, topics }) => { const { emit, state } = await import('/base/state.js'); state.recording.name = name;"
        "topics.forEach((topic, place) => (state.recording.sensors[place].topic = topic)); emit('recording'); }",
        EXTREME_NAMES,
    )
    page.until("document.getElementById('recording-name').textContent.length > 100")


def out_of_reach(page: Driver, *selectors: str) -> Any:
    """Return what is not in the window, has no size, or is covered by something else."""
    return page.page.evaluate(
        "(selectors) => selectors.filter((selector) => { const part = document.querySelector(selector);"
        "const box = part.getBoundingClientRect();"
        "const inside = box.left >= -1 && box.top >= -1 && box.right <= innerWidth + 1 && box.bottom <= innerHeight + 1;"
        "const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);"
        "return !inside || box.width < 8 || box.height < 8 || !(part.contains(top) || top?.contains(part)); })",
        list(selectors),
    )


@pytest.mark.slow
def test_everything_is_in_the_window_or_a_tab_away_at_any_size_whatever_the_names(page: Driver) -> None:
    page.page.click("#menu-button")
    page.page.click("#theme")
    give_extreme_names(page)
    for width, height in SIZES:
        page.page.set_viewport_size({"width": width, "height": height})
        page.until(f"innerWidth === {width} && innerHeight === {height} && document.documentElement.dataset.shape")
        page.drawn()
        always = (
            "#undo",
            "#menu-button",
            "#play",
            "#next-placement",
            "#status-text",
            "#timeline",
            "#image-pane",
            "#zoom",
        )
        assert out_of_reach(page, *always, ".recording", ".over-image summary") == [], (width, height)
        panel = ("#panel", "#verdict", "#tab-mark", "#tab-deliver", "#page-mark")
        if page.value("document.documentElement.dataset.shape") == "wide":
            assert out_of_reach(page, *panel, "#space", ".over-space summary") == [], (width, height)
        else:
            page.page.click('[data-pane="space"]')
            assert out_of_reach(page, "#space", ".over-space summary", *always) == [], (width, height)
            page.page.click('[data-pane="image"]')
            assert page.value("document.getElementById('image-pane').offsetWidth") >= width - 4
            page.page.click('[data-pane="panel"]')
            assert out_of_reach(page, *panel, *always) == [], (width, height)
        apart = page.value(
            "document.querySelector('.recording').getBoundingClientRect().right"
            " <= document.querySelector('.tools').getBoundingClientRect().left + 1"
        )
        assert apart, (width, height)
        page.press("n")  # the first row and the first mark are asked to come into view
    assert page.value("[scrollX, scrollY, document.body.scrollTop, document.getElementById('work').scrollTop]") == [
        0,
        0,
        0,
        0,
    ]
    assert page.value("document.documentElement.scrollWidth") == SIZES[-1][0]


def test_at_200_percent_a_click_hits_its_pixel_and_moves_nothing_else(
    open_page: Callable[..., Driver], server: RunningServer
) -> None:
    page = open_page(server.url, viewport={"width": 640, "height": 360}, device_scale_factor=2)
    before = page.value("document.getElementById('image-pane').getBoundingClientRect().toJSON()")
    page.click(500, 300)
    (click,) = page.view["clicks"]
    assert abs(click["u_px"] - 500) < 2
    assert abs(click["v_px"] - 300) < 2
    assert page.value("document.getElementById('image-pane').getBoundingClientRect().toJSON()") == before
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.locator(".options input").last.evaluate("(part) => part.focus()")
    assert page.value("[scrollX, scrollY, document.body.scrollTop]") == [0, 0, 0]
    assert page.value("document.getElementById('image-pane').getBoundingClientRect().toJSON()") == before


@pytest.mark.slow
def test_dividers_keep_their_part_in_another_window_and_move_by_keys(page: Driver) -> None:
    bar = page.page.locator("#divider-x")
    bar.focus()
    for _ in range(6):
        page.page.keyboard.press("ArrowLeft")
    part = page.value("document.getElementById('right').offsetWidth / innerWidth")
    told = float(page.value("document.getElementById('divider-x').getAttribute('aria-valuenow')"))
    assert told == pytest.approx(100 * (1 - part), abs=1)
    page.page.set_viewport_size({"width": 1800, "height": 900})
    page.until(f"Math.abs(document.getElementById('right').offsetWidth / 1800 - {part}) < 0.01")
    page.page.set_viewport_size({"width": 600, "height": 900})
    page.until("document.getElementById('divider-x').getAttribute('aria-orientation') === 'horizontal'")
    page.drawn()
    high = page.value("document.getElementById('image-pane').offsetHeight")
    bar.focus()
    page.page.keyboard.press("ArrowDown")
    page.until(f"document.getElementById('image-pane').offsetHeight > {high} + 10")


FULLY_IN_SIGHT = """(selector) => { const box = document.getElementById("page-mark").getBoundingClientRect();
    const head = document.querySelector("#page-mark thead").getBoundingClientRect().bottom;
    return [...document.querySelectorAll(`#page-mark ${selector}`)].map((row) => row.getBoundingClientRect())
        .filter(({ top, bottom }) => top >= head - 1 && bottom <= Math.min(box.bottom, innerHeight) + 1).length; }"""


@pytest.mark.slow
def test_ten_pairs_or_four_and_six_returns_are_in_sight_beside_seven_warnings(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(truth, 12)
    page.until("!__cocalib.state.view.checking")
    page.page.evaluate(
        "async () => { const { emit, state } = await import('/base/state.js');"
        "const hint = { parts: ['a warning that takes a line'] };"
        "const row = (n) => ({ code: `code-${n}`, message: { parts: [...hint.parts, ` ${n}`] }, hint, kind: '', option: '' });"
        "const seven = [1, 2, 3, 4, 5, 6, 7].map(row);"
        "const { follower } = __cocalib; follower.view = state.view = { ...follower.view, warnings: seven }; emit('view'); }"
    )  # what the server still sends changes this View
    assert page.text("#warning-count") == "7 warnings"
    page.value("document.getElementById('page-mark').scrollTo(0, 0)")
    assert page.page.evaluate(FULLY_IN_SIGHT, "tr.row") >= 10
    page.page.locator("#page-mark tr.row").nth(2).click()
    page.until("document.querySelectorAll('.choices-list .choice').length >= 6")
    page.drawn()
    assert page.page.evaluate(FULLY_IN_SIGHT, ".choice") >= 6
    assert page.page.evaluate(FULLY_IN_SIGHT, "tr.row") >= 4
    assert page.value("document.getElementById('space').clientHeight") >= 220
