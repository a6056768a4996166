"""A click means the pixel that is drawn under it, at every scale of the screen."""

from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser

from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver
from tests.image_recording import ImageRecording
from tests.serving import OWN_PORT, serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

DOTS = [(200, 150), (641, 77), (333, 402)]
"""White pixels on black images, one per frame."""


@pytest.fixture(scope="module")
def dots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    images = [np.zeros((480, 800, 3), dtype=np.uint8) for _ in DOTS]
    for image, (u, v) in zip(images, DOTS, strict=True):
        image[v, u] = 255
    recording = ImageRecording(images)
    with serving(recording, tmp_path_factory.mktemp("dots") / "s", name="dots", port=OWN_PORT, token="test") as (
        running,
        _,
    ):
        yield running


def drawn_at(page: Driver, u: float, v: float, ratio: float) -> tuple[float, float]:
    """Return where the white pixel really is on the screen [CSS px], by its centre of light in a screenshot."""
    x, y = page.place_of(u, v)
    left, top = 20 * (int(x) // 20 - 1), 20 * (int(y) // 20 - 1)  # on device pixels at 100, 125 and 200 %
    shot = page.page.screenshot(clip={"x": left, "y": top, "width": 60, "height": 60}, scale="device")
    image = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image is not None
    light = np.where(image > 120, image, 0).astype(float)
    rows, columns = np.indices(light.shape) + 0.5
    assert light.sum() > 0
    return left + float((columns * light).sum() / light.sum()) / ratio, top + float(
        (rows * light).sum() / light.sum()
    ) / ratio


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1, 1.25, 2])
def test_a_click_on_what_is_drawn_comes_back_within_a_tenth_of_a_pixel(
    open_page: Callable[..., Driver], launch: Callable[..., Browser], dots: RunningServer, ratio: float
) -> None:
    browser = launch(f"--force-device-scale-factor={ratio}", "--window-size=1280,800")
    page = open_page(dots.url, browser, no_viewport=True)
    assert page.value("devicePixelRatio") == ratio
    for chip in ("1", "2", "3", "4"):
        page.press(chip)
    for frame, (u, v) in enumerate(DOTS):
        page.go_to(frame)
        page.press("f")
        page.zoom_to(u, v, 4)
        page.page.mouse.move(2, 2)
        page.until("__cocalib.state.hover === null")
        if page.value("__cocalib.clickIn(__cocalib.state.shown.index) !== undefined"):
            page.press("Delete")
        page.drawn()
        x, y = drawn_at(page, u, v, ratio)
        page.page.mouse.click(round(x), round(y))  # a mouse knows whole CSS pixels only
        page.settle()
        click = page.value("__cocalib.clickIn(__cocalib.state.shown.index)")
        zoom = page.value("__cocalib.zoom()")
        expected = (u + (round(x) - x) / zoom, v + (round(y) - y) / zoom)
        assert (click["u_px"], click["v_px"]) == pytest.approx(expected, abs=0.1)
        page.press("Delete")


def test_the_wheel_keeps_the_point_under_the_cursor(open_page: Callable[..., Driver], dots: RunningServer) -> None:
    page = open_page(dots.url)
    box = page.value("document.getElementById('marks').getBoundingClientRect().top")
    x, y = 540, 380
    u, v = page.value(f"__cocalib.toImage({x}, {y - box})")
    page.page.mouse.move(x, y)
    for notches in (-300, -300, 200, -500):
        before = page.value("__cocalib.zoom()")
        page.page.mouse.wheel(0, notches)
        page.until(f"__cocalib.zoom() !== {before!r}")
        assert page.place_of(u, v) == pytest.approx((x, y), abs=1e-6)


def test_the_canvas_lies_on_device_pixels_whatever_the_window(
    open_page: Callable[..., Driver], dots: RunningServer
) -> None:
    page = open_page(dots.url)
    for width, height in ((1280, 720), (1003, 611), (1441, 877)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.until(f"innerWidth === {width}")
        page.drawn()
        box: Any = page.value("document.getElementById('marks').getBoundingClientRect().toJSON()")
        assert [box[side] % 4 for side in ("left", "top", "width", "height")] == [0, 0, 0, 0]
