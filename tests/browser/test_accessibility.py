"""The page for people who do not see it, or do not use a mouse: axe in every state, words for the image, Tab and arrows."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect

from calib_core.recordings import Recording
from cocalib.web.messages.outgoing import Opening
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer
from cocalib.web.port.serving import Service
from tests.browser.accessibility import violations
from tests.browser.driving import Driver

pytestmark = pytest.mark.browser


@pytest.fixture
def page(open_page: Callable[..., Driver], server: RunningServer) -> Driver:
    """Open a page in which nothing moves, so that colours are what they will be."""
    return open_page(server.url, reduced_motion="reduce")


@pytest.mark.slow
@pytest.mark.no_3d_view
def test_axe_finds_nothing_in_any_state_of_the_page(page: Driver, truth: Any) -> None:
    found: dict[str, list[str]] = {}
    user = page.page

    def look(state: str) -> None:
        for theme in ("light", "dark"):
            page.value(f"document.documentElement.dataset.theme = '{theme}'")
            found[f"{state}, {theme}"] = violations(page)

    look("no click")
    page.load_sample(truth, 1)
    look("one click")
    page.load_sample(truth, 5)
    look("solved")
    u, v = truth["placements"][4]["pixel_px"]
    page.drag((u, v), (u + 150, v - 90))
    look("a wrong pair")
    page.press("x")
    user.click("#tab-check")
    look("pose")
    user.click("#tab-deliver")
    look("deliver")
    for sheet in ("evaluate", "lens", "recording", "options"):
        user.click("#menu-button")
        look("the menu")
        user.click(f'#menu [data-action="{sheet}"]')
        look(sheet)
        user.keyboard.press("Escape")
        if sheet != "options" and user.is_visible("#sheet-close"):
            user.click("#sheet-close")
    user.click("#page-options summary")
    look("all options")
    user.fill("#option-gating-max_range_m", "-5")
    user.keyboard.press("Enter")
    page.until("document.querySelector('.toast')")
    look("a refusal")
    page.value(
        "document.querySelectorAll('.toast button').forEach((button) => button.click())"
    )  # it may have gone by itself
    user.click("#sheet-close")
    user.click("#tab-mark")
    look("pairs with an excluded one")
    for key, selector in (("?", "#help-dialog"), ("Control+k", "#palette")):
        user.keyboard.press(key)
        user.locator(f"{selector}[open]").wait_for()
        look(selector)
        user.keyboard.press("Escape")
    user.keyboard.press("e")
    expect(user.locator("#page-deliver .text")).to_contain_text("camera_from_radar")
    look("#page-deliver")
    user.fill("#page-deliver [data-field=radar_frame]", "")
    user.locator("#page-deliver .names .error").wait_for()
    user.fill("#page-deliver .find", "ros")
    look("export with a refused frame name, some formats")
    user.keyboard.press("Escape")
    page.load_sample(truth)
    user.click("#tab-check")
    user.locator(".sheet .crop").first.focus()
    user.keyboard.press("r")
    user.locator(".sheet .reviewed img[src]").wait_for()
    look("contact sheet with a mark that was reviewed")
    user.locator("[data-plot=residuals]").hover(position={"x": 200, "y": 40})
    look("a bar under the pointer")
    user.click("#tab-deliver")
    user.fill("#page-deliver .find", "")
    user.fill("#page-deliver [data-field=radar_frame]", "radar")
    for shown, selector in (("opencv", ".returns"), ("report", ".report"), ("rerun", ".text"), ("clicks", ".loader")):
        user.click(f'#page-deliver [data-export="{shown}"]')
        user.locator(f"#page-deliver {selector}").wait_for()
        look(f"deliver {shown}")
    page.value("import('/options/options.js').then(({ openOption }) => openOption('solving.camera_position'))")
    user.locator("dialog[open]").wait_for()
    look("the camera's position")
    user.keyboard.press("Escape")
    user.keyboard.press("Control+k")
    user.keyboard.type("placement")
    user.locator("#palette .entry").first.wait_for()
    look("the palette with what was found")
    user.keyboard.press("Escape")
    for width, height in ((1024, 700), (640, 700)):
        user.set_viewport_size({"width": width, "height": height})
        page.drawn()
        look(f"{width} px wide")
    assert len(found) >= 56
    assert {state: words for state, words in found.items() if words} == {}


@pytest.mark.no_3d_view
def test_axe_finds_nothing_while_a_recording_is_opened(sample: Recording, open_page: Callable[..., Driver]) -> None:
    note = Opening("long.bag", "Opening long.bag (5.1 GB): reading its index and times…")
    with Service(ServerOptions(port=0, token="test", no_browser=True), note, lambda: None, let_in_after_s=0) as service:
        server = service._early.result(timeout=40)
        assert server is not None
        page = open_page(server.url, ready="__cocalib.state.opening", reduced_motion="reduce")
        page.until("document.getElementById('status-text').textContent.includes('5.1 GB')")
        assert violations(page) == []


@pytest.mark.no_3d_view
def test_axe_finds_nothing_without_images_and_keys_reach_each_placement(
    open_page: Callable[..., Driver], radar_only_server: RunningServer
) -> None:
    page = open_page(radar_only_server.url, ready="__cocalib.state.look", reduced_motion="reduce")
    page.until("document.querySelectorAll('#page-mark .row').length > 3")
    assert violations(page) == []
    page.page.locator("#page-mark .row").first.focus()
    page.page.keyboard.press("ArrowDown")
    page.page.keyboard.press("ArrowDown")
    page.page.keyboard.press("Enter")
    page.until("__cocalib.state.look.index === __cocalib.state.placements[2].frame")
    page.until("document.activeElement.dataset.placement === '2'")  # though the table was drawn again
    page.until("document.getElementById('image-words').textContent.includes('Placement 3 of')")


@pytest.mark.no_3d_view
def test_the_image_and_its_marks_are_told_in_words(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 5)
    words = page.page.locator("#image-words")
    expect(words).to_contain_text("Placement 5 of 20")
    expect(words).to_contain_text("5 at column")
    expect(words).to_contain_text("agrees with the others")
    expect(words).to_contain_text("4 marks in other frames")
    assert page.page.locator("#marks").get_attribute("aria-describedby") == "image-words"
    page.press("n")
    expect(words).to_contain_text("Placement 6 of 20")
    expect(words).to_contain_text("the reflector is expected at column")
    page.press("p", "x")
    expect(words).to_contain_text("5 at column")
    expect(words).to_contain_text("excluded")
    for name, low, high in (("Width of the image", 30, 90), ("Height of the 3D view", 20, 60)):
        divider = page.page.get_by_role("separator", name=name)
        before = int(divider.get_attribute("aria-valuenow") or -1)
        assert low < before < high
        divider.focus()
        for _ in range(4):
            page.page.keyboard.press("ArrowLeft" if low == 30 else "ArrowDown")
        page.until(f"Number(document.activeElement.getAttribute('aria-valuenow')) !== {before}")


@pytest.mark.slow
def test_tab_reaches_every_control_in_order_and_is_never_caught(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 5)
    user = page.page
    page.value(
        "(window.reached = [], document.addEventListener('focusin', (event) => window.reached.push(event.target)), 0)"
    )
    for _ in range(2):  # to the end of the page, and once through all of it
        page.value("(window.reached.length = 0)")
        for _ in range(80):
            user.keyboard.press("Tab")
            if page.value("document.activeElement === document.body"):
                break
        else:
            pytest.fail("Tab never left the page")
    assert page.value("window.reached.length") > 25
    assert page.value(
        "window.reached.slice(1).every((element, at) =>"
        " window.reached[at].compareDocumentPosition(element) & Node.DOCUMENT_POSITION_FOLLOWING)"
    )
    missed = page.value(
        "[...document.querySelectorAll('button, input, select, [tabindex=\"0\"]')]"
        ".filter((element) => element.checkVisibility() && !element.disabled && element.tabIndex >= 0"
        " && !window.reached.includes(element)).map((element) => element.outerHTML.slice(0, 120))"
    )
    assert missed == []
    assert page.value("window.reached.filter((element) => element.matches('tr')).length") == 1, "one stop per table"


@pytest.mark.no_3d_view
@pytest.mark.slow
def test_arrows_go_through_the_pairs_and_the_figures(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 5)
    user = page.page
    rows = user.locator("#page-mark tr.row")
    expect(rows).to_have_count(5)
    rows.nth(3).focus()
    for key in ("ArrowUp", "ArrowUp", "Enter"):
        user.keyboard.press(key)
    page.until("document.activeElement.dataset.id === 'c2' && __cocalib.state.selected === 'c2'")
    page.until("__cocalib.state.shown.index === __cocalib.clicks()[1].frame")
    page.press("x")
    page.until("__cocalib.state.view.clicks[1].state === 'excluded'")
    page.until("document.activeElement.dataset.id === 'c2'")  # the row was drawn again
    user.click("#tab-check")
    user.locator("#figures .figure").first.focus()
    user.keyboard.press("ArrowRight")
    page.until("document.activeElement.dataset.key === 'held_out_aed'")
    expect(user.locator("#tip")).to_be_visible()
    held_out = next(figure for figure in page.view["metrics"] if figure["key"] == "held_out_aed")
    assert held_out["hint"] in page.text("#tip")
    assert user.locator("#figures .figure").nth(1).get_attribute("aria-describedby") == "tip"
    assert held_out["label"] in page.text("#figures")
    user.keyboard.press("Escape")
    expect(user.locator("#tip")).to_be_hidden()
