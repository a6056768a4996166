"""The page as a user finds it: what it says first, its layout, what the 3D view shows, and what it remembers."""

import cv2
import numpy as np
import pytest

from tests.browser.driving import Driver

pytestmark = pytest.mark.browser


def pixels(page: Driver, selector: str) -> np.ndarray:
    """Return a screenshot of an element: (h, w, 3) BGR."""
    picture = cv2.imdecode(np.frombuffer(page.page.locator(selector).screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture)


def test_a_new_user_is_told_what_to_do_and_led_to_the_first_click(page: Driver) -> None:
    page.until("__cocalib.state.placementsKnown")
    assert page.page.locator(".steps li").count() == 3
    assert "found in the radar data" in page.text(".steps li.now")
    assert page.text('[data-key="aed"] dd') == "–"
    assert page.page.get_attribute("#export", "class") in (None, "")
    page.press("n")
    page.until("document.getElementById('guide').classList.contains('act')")
    assert page.text("#guide").startswith("Placement 1 of")
    u, v = page.value("[__cocalib.viewport.imageWidth / 2, __cocalib.viewport.imageHeight / 2]")
    page.click(u, v)
    assert page.text("#guide").endswith("placements that are left. Press N")
    assert page.text("#guide") in page.text("#status-text")
    assert page.page.locator(".steps li.done").count() == 1
    assert page.page.locator(".pairs .row").count() == 1


def test_the_3d_view_shows_the_scene_and_none_of_visers_own_panels(page: Driver) -> None:
    space = page.page.frame_locator("#space-view")
    space.locator("canvas").last.wait_for(state="attached")
    page.press("n")
    for _ in range(100):
        blue, green, red = (pixels(page, "#space-view")[..., channel].astype(int) for channel in range(3))
        sky = (blue > 150) & (blue > red + 15)
        if sky.sum() > 200 and (green > red + 60).sum() > 20:
            break  # the picture on the frustum, and the radar's y axis
    else:
        pytest.fail("the 3D view stayed empty")
    for panel in (".mantine-Paper-root", ".mantine-Notifications-root"):
        assert all(not part.is_visible() for part in space.locator(panel).all())


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
    page.page.click("#theme")
    page.page.reload()
    page.until("__cocalib.state.shown")
    assert page.value("__cocalib.viewport.width") == narrow
    assert page.value("document.documentElement.dataset.theme") == "light"
    assert pixels(page, "#bar").mean() > 200


def test_nothing_is_cut_off_or_covered_at_any_common_size(page: Driver) -> None:
    for width, height in ((1280, 720), (1440, 900), (1920, 1080), (1024, 640)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.until(f"innerWidth === {width} && innerHeight === {height}")
        page.drawn()
        outside = page.value(
            "[...document.querySelectorAll('button, canvas:not([hidden]), .figure, #status-text')]"
            ".filter((part) => part.offsetParent !== null)"
            ".map((part) => [part.id || part.className, part.getBoundingClientRect()])"
            ".filter(([, box]) => box.left < -1 || box.top < -1 || box.right > innerWidth + 1 || box.bottom > innerHeight + 1)"
            ".map(([name]) => name)"
        )
        assert outside == []
        for button in ("#play", "#export", "#undo", "#tab-options", '[data-layer="returns"]'):
            covered = page.value(
                f"(() => {{ const part = document.querySelector('{button}'); const box = part.getBoundingClientRect();"
                "const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);"
                "return !part.contains(top); })()"
            )
            assert not covered, button


@pytest.mark.parametrize("width", [1024, 1440])
def test_long_names_are_cut_short_and_push_nothing_out_of_the_window(page: Driver, width: int) -> None:
    page.page.set_viewport_size({"width": width, "height": 720})
    page.value(
        "document.querySelectorAll('#recording-topics .fact').forEach((fact, place) => "
        "{ if (!place) fact.append(' + /front_radar/points_with_a_long_name'.repeat(5)); })"
    )
    page.value("document.getElementById('recording-name').append('_of_a_long_day'.repeat(20))")
    page.drawn()
    for part in ("#bar", "#help", "#right", "#timeline", "#recording-topics .fact:last-child"):
        assert page.value(f"document.querySelector('{part}').getBoundingClientRect().right") <= width, part
    assert page.value("document.querySelector('#recording-topics .fact:nth-child(2)').offsetWidth") >= 88
