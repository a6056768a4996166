"""Nothing is lost: not by killing the server, not by clicking while it is down, not by odd names in a recording."""

import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.browser.driving import Driver
from tests.image_recording import ImageRecording, grey_images
from tests.served_process import ServedProcess, served_process
from tests.serving import OWN_PORT, serving

pytestmark = pytest.mark.browser


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[Callable[[], ServedProcess]]:
    """Start `cocalib demo` on the same port each time."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with ExitStack() as stack:
        session = ("--session", tmp_path / "session")
        yield lambda: stack.enter_context(served_process(*session, state=tmp_path, command="demo", port=port))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 needs POSIX")
def test_killing_the_server_loses_no_click_and_the_page_reconnects_by_itself(
    demo: Callable[[], ServedProcess], open_page: Callable[..., Driver], truth: Any
) -> None:
    served = demo()
    page = open_page(served.url, viewport={"width": 1024, "height": 576})  # in which the 3D view is drawn sooner
    page.click_sample(truth, 5)
    before = page.view
    served.process.kill()
    served.process.wait()
    page.until("!__cocalib.state.connected")
    assert "is not responding" in page.text("#banner")
    u, v = truth["placements"][4]["pixel_px"]
    page.page.mouse.click(*page.place_of(u + 30, v + 20))
    page.until("__cocalib.unconfirmed() === 1")
    demo()
    page.until("__cocalib.state.connected")
    page.settle()
    after = page.view
    places = [[(row["id"], row["u_px"], row["v_px"]) for row in view["clicks"][:5]] for view in (before, after)]
    assert places[0] == places[1]
    added = after["clicks"][5]
    assert (added["u_px"], added["v_px"]) == pytest.approx((u + 30, v + 20), abs=1.0), (
        "the click made while the server was down arrived"
    )
    assert not page.page.is_visible("#banner")
    page.page.frame_locator("#space-view").locator("canvas").last.wait_for(state="attached")
    page.forget_lost_connections()


@pytest.mark.no_3d_view
def test_names_in_a_recording_are_text_and_never_run(open_page: Callable[..., Driver], tmp_path: Path) -> None:
    hostile = '<img src=x onerror="window.hit=1"><script>window.hit=1</script>'
    recording = ImageRecording(grey_images(3), image_topic=hostile, radar_topic=f"radar{hostile}")
    with serving(recording, tmp_path / "s", name=f"name{hostile}", port=OWN_PORT, token="test") as (running, _):
        page = open_page(running.url)
        page.click(100, 100)
        page.press("?")
        page.drawn()
        assert page.value("window.hit === undefined")
        assert page.value("document.getElementById('recording-name').textContent") == f"name{hostile}"
        page.page.keyboard.press("Escape")
        page.page.click("#choose-recording")
        assert hostile in page.page.text_content("#opening-dialog .reading")
        assert page.page.locator("img").count() == 0


@pytest.mark.slow
@pytest.mark.no_3d_view
def test_large_frames_play_at_half_size_and_stand_at_full_size(
    open_page: Callable[..., Driver], tmp_path: Path
) -> None:
    recording = ImageRecording(grey_images(30, 2400, 1200))
    with serving(recording, tmp_path / "s", name="large", port=OWN_PORT, token="test") as (running, _):
        page = open_page(running.url)
        assert page.value("__cocalib.state.shown.scale") == 1
        page.press(" ")
        page.until("__cocalib.state.shown.index > 1 && __cocalib.state.shown.scale === 0.5")
        page.press(" ")
        page.until("!__cocalib.state.playing && __cocalib.state.shown.scale === 1")
