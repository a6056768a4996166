"""While a large recording is being opened: its first image is shown, nothing can be clicked, and then the page starts."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from queue import Queue

import numpy as np
import pytest
from playwright.sync_api import Browser

from calib_core.recordings import Recording, first_image
from cocalib.web.messages.outgoing import Opening
from cocalib.web.port.link import HandOver, ServerOptions
from cocalib.web.port.server import RunningServer
from cocalib.web.port.serving import Service
from cocalib.workspace import Workspace
from tests.browser.driving import Driver
from tests.serving import OWN_PORT

pytestmark = pytest.mark.browser

OPTIONS = ServerOptions(port=OWN_PORT, token="test", no_browser=True)
OPENING = Opening("long.bag", "Opening long.bag (5.1 GB): reading its index and times…")


@contextmanager
def opening(image_of: Recording) -> Iterator[RunningServer]:
    """Serve a recording that is still being opened."""
    with Service(OPTIONS, OPENING, partial(first_image, image_of.paths), let_in_after_s=0) as service:
        server = service._early.result(timeout=40)
        assert server is not None
        yield server


@pytest.fixture
def open_early(open_page: Callable[..., Driver]) -> Callable[[RunningServer], Driver]:
    """Return a function that opens a page and waits until it shows the first image."""
    return lambda server: open_page(server.url, ready="__cocalib.state.preview")


def shade_at(page: Driver, u: float, v: float) -> np.ndarray:
    """Return what the canvas shows at an image point: red, green, blue."""
    return np.array(
        page.value(
            f"(() => {{ const box = document.getElementById('image'); const [x, y] = __cocalib.toCss({u}, {v});"
            "const ratio = box.width / box.clientWidth;"
            "return [...box.getContext('2d').getImageData(x * ratio, y * ratio, 1, 1).data.slice(0, 3)]; })()"
        ),
        dtype=float,
    )


@pytest.mark.slow
def test_the_first_image_is_there_and_nothing_can_be_done_to_it_until_the_recording_is(
    sample: Recording, workspace: Workspace, open_early: Callable[[RunningServer], Driver]
) -> None:
    with opening(sample) as server:
        page, second = open_early(server), open_early(server)
        page.drawn()
        image, (u, v) = sample.image(0), (300, 420)
        for at in ((u, v), (914, 242), (100, 130)):
            assert shade_at(page, *at) == pytest.approx(image[at[1], at[0], ::-1], abs=12)
        assert OPENING.doing in page.text("#status-text")
        assert "Preview" in page.text("#guide")
        assert page.text("#recording-name") == "long.bag"
        page.page.mouse.click(*page.place_of(u, v))
        for key in (
            "Enter",
            "n",
            "p",
            "j",
            "e",
            " ",
            "ArrowRight",
            "Alt+ArrowRight",
            "End",
            "x",
            "Delete",
            "Control+z",
        ):
            page.page.keyboard.press(key)
        assert page.value("__cocalib.unconfirmed() + __cocalib.clicks().length") == 0
        assert not page.page.is_visible("#page-deliver")
        assert page.page.is_disabled("#play")
        server.admit(workspace, sample)
        for each in (page, second):
            each.until("__cocalib.state.shown && __cocalib.state.view && __cocalib.state.preview === null")
        assert page.text("#recording-name") == "sample"
        assert page.page.is_enabled("#play")
        page.click(u, v)
        assert [round(row["u_px"]) for row in page.view["clicks"]] == [u]
        second.until("__cocalib.state.view.clicks.length === 1")
        page.page.frame_locator("#space-view").locator("canvas").last.wait_for(state="attached")


@pytest.mark.no_3d_view
def test_why_it_cannot_be_opened_stays_on_the_page(
    sample: Recording, open_early: Callable[[RunningServer], Driver]
) -> None:
    with opening(sample) as server:
        page = open_early(server)
        server.refuse("long.bag: no radar topic; it has /camera/image.")
    page.until("!__cocalib.state.connected")
    assert "no radar topic" in page.text("#banner")
    assert "no radar topic" in page.text("#status-text")
    assert not page.page.is_visible("#guide")
    assert not page.page.is_visible("#progress")
    page.forget_lost_connections()


@pytest.mark.no_3d_view
def test_a_page_that_comes_back_to_a_recording_still_being_opened_loses_no_click(
    sample: Recording, workspace: Workspace, server: RunningServer, page: Driver, tmp_path: Path
) -> None:
    port = server.port
    server.close()
    page.until("!__cocalib.state.connected")
    again = ServerOptions(port=port, token="test", no_browser=True)
    with Service(again, OPENING, lambda: None, let_in_after_s=0) as service:
        second = service._early.result(timeout=40)
        assert second is not None
        assert second.port == port
        page.until("__cocalib.state.connected && __cocalib.state.opening")
        assert OPENING.doing in page.text("#status-text")
        page.page.mouse.click(*page.place_of(300, 420))
        page.until("__cocalib.unconfirmed() === 1")
        second.admit(workspace, sample)
        page.settle()
        assert [round(row["u_px"]) for row in page.view["clicks"]] == [300]
    page.forget_lost_connections()


def test_the_private_file_leads_the_browser_to_the_page(
    chromium: Browser, server: RunningServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A browser sends no SameSite=Strict cookie along a redirect that a file began."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    opened: Queue[str] = Queue()
    given = HandOver(server.url, opened.put)
    context = chromium.new_context()
    page = context.new_page()
    page.goto(opened.get(timeout=20))
    page.wait_for_url(f"{server.origin}/")
    page.wait_for_function("() => window.__cocalib && window.__cocalib.state.shown")
    given.discard()
    context.close()
