"""The page under fingers: pinch, pan, tap and long press, sent as touches through the browser's own protocol."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

TABLET = {"viewport": {"width": 768, "height": 1024}, "has_touch": True, "is_mobile": True}


class Fingers:
    """Fingers on the image, by image points."""

    def __init__(self, page: Driver) -> None:
        self._page = page
        self._protocol = page.page.context.new_cdp_session(page.page)

    def put(self, kind: str, *points: tuple[float, float]) -> None:
        """Send a touch event with all fingers that are down [CSS px of the page]."""
        touches = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        self._protocol.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    def move(self, *ways: tuple[tuple[float, float], tuple[float, float]], steps: int = 8) -> None:
        """Put fingers down, move each from one place to another, and lift them."""
        self.put("touchStart", *(start for start, _ in ways))
        for step in range(1, steps + 1):
            part = step / steps
            self.put("touchMove", *((x + part * (to_x - x), y + part * (to_y - y)) for (x, y), (to_x, to_y) in ways))
        self.put("touchEnd")


@pytest.fixture
def page(open_page: Callable[..., Driver], server: RunningServer) -> Driver:
    return open_page(server.url, **TABLET)


def image_point(page: Driver, x: float, y: float) -> tuple[float, float]:
    """Return the image point at a place on the page [CSS px]."""
    u, v = page.value(
        "(() => { const box = document.getElementById('marks').getBoundingClientRect();"
        f"return __cocalib.toImage({x} - box.left, {y} - box.top); }})()"
    )
    return float(u), float(v)


def test_two_fingers_zoom_at_their_centre_and_one_finger_pans(page: Driver) -> None:
    fingers = Fingers(page)
    before = page.value("__cocalib.zoom()")
    x, y = page.place_of(480, 300)
    held = image_point(page, x, y)
    fingers.move(((x - 40, y), (x - 120, y)), ((x + 40, y), (x + 120, y)))
    page.drawn()
    assert page.value("__cocalib.zoom()") == pytest.approx(3 * before, rel=0.02)
    assert math.dist(image_point(page, x, y), held) < 2
    fingers.move(((x - 50, y), (x - 20, y + 40)), ((x + 50, y), (x + 80, y + 40)))  # two fingers pan
    page.drawn()
    assert page.value("__cocalib.zoom()") == pytest.approx(3 * before, rel=0.02)
    assert math.dist(image_point(page, x + 30, y + 40), held) < 3
    fingers.move(((x + 30, y + 40), (x - 30, y + 10)))
    page.drawn()
    slack = 10 / page.value("__cocalib.zoom()")  # what a finger moves before it pans
    assert math.dist(image_point(page, x - 30, y + 10), held) < 3 + slack
    assert page.value("__cocalib.clicks().length") == 0
    assert page.value("[scrollX, scrollY, visualViewport.scale]") == [0, 0, 1]


def test_a_tap_places_a_mark_and_a_long_press_moves_it_under_the_loupe(page: Driver) -> None:
    fingers = Fingers(page)
    x, y = page.place_of(500, 400)
    fingers.put("touchStart", (x, y))
    fingers.put("touchEnd")
    page.until("__cocalib.clicks().length === 1 && __cocalib.clicks()[0].id")
    page.settle()
    placed = click_of(page)
    assert math.dist((placed["u_px"], placed["v_px"]), (500, 400)) < 2
    x, y = page.place_of(placed["u_px"] + 6, placed["v_px"])  # not exactly on it
    fingers.put("touchStart", (x, y))
    page.until("!document.getElementById('touch-cross').hidden && !document.getElementById('loupe').hidden")
    loupe = page.page.locator("#loupe").bounding_box()
    assert loupe is not None
    assert loupe["y"] + loupe["height"] < y - 30 or loupe["y"] > y + 30  # the finger does not cover it
    fingers.put("touchMove", (x + 12, y))
    fingers.put("touchMove", (x + 24, y + 8))
    fingers.put("touchEnd")
    page.until(f"__cocalib.clicks()[0].u_px !== {placed['u_px']!r}")
    page.settle()
    moved = click_of(page)
    scale = page.value("__cocalib.zoom()")
    assert 24 * 0.25 / scale - 1 < moved["u_px"] - placed["u_px"] <= 24 / scale + 1
    assert page.value("document.getElementById('touch-cross').hidden")
    assert page.value("[scrollX, scrollY]") == [0, 0]
    assert too_small_for_a_finger(page) == []


STILL_COMPARING = """(() => {
  const ask = window.fetch;
  const told = () => new Response(JSON.stringify({ seconds: [], grey_levels: [], complete: false }));
  const isAsked = (address) => String(address).includes("image_changes");
  window.fetch = (address, ...more) => (isAsked(address) ? Promise.resolve(told()) : ask(address, ...more));
})()"""
"""The server never gets to the end of comparing the images, so that the page asks again and again."""


def test_a_long_press_goes_on_while_the_timeline_is_still_being_filled(
    open_page: Callable[..., Driver], server: RunningServer
) -> None:
    page = open_page(server.url, script=STILL_COMPARING, **TABLET)
    page.until("__cocalib.state.placementsKnown")
    fingers = Fingers(page)
    fingers.put("touchStart", page.place_of(500, 400))
    page.until("!document.getElementById('touch-cross').hidden")
    page.value("import('/base/state.js').then(({ emit }) => emit('placements'))")
    page.drawn()
    assert not page.value("document.getElementById('touch-cross').hidden")
    fingers.put("touchEnd")


def click_of(page: Driver) -> Any:
    """Return the only click, as the server has it."""
    (click,) = page.view["clicks"]
    return click


def too_small_for_a_finger(page: Driver) -> Any:
    """Return what can be pressed and is not hit 19 px above or below its middle."""
    return page.value(
        "[...document.querySelectorAll('button, summary, select, input')]"
        ".filter((part) => part.checkVisibility({visibilityProperty: true}))"
        ".filter((part) => { const box = part.getBoundingClientRect(); const x = (box.left + box.right) / 2;"
        "const y = (box.top + box.bottom) / 2;"
        "const page = part.closest('[role=tabpanel]')?.getBoundingClientRect();"
        "if (page && (y - 19 < page.top || y + 19 > page.bottom)) return false;"  # scrolled out
        "return [-19, 19].some((dy) => !part.contains(document.elementFromPoint(x, y + dy))); })"
        ".map((part) => `${part.id} ${part.className} ${part.textContent}`)"
    )
