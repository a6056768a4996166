"""The main path in browsers other than Chromium: open, mark, accept proposals, drag, undo, export, reload."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from calib_core.interchange.importing import read_any
from calib_core.recordings import Recording
from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver
from tests.browser.remote import RemoteDriver, RemotePage, firefox, webkit
from tests.serving import serving

pytestmark = pytest.mark.browser

_OFFERED = "__cocalib.shownOffer() && __cocalib.state.shown.index === __cocalib.state.cursor && !__cocalib.justMoved()"
_LOOKING_S = 120.0  # until so many images are looked at, beside other tests
_WHY = "document.querySelector('#space > .space-why').textContent"


@pytest.fixture
def server(sample: Recording, tmp_path: Path) -> Iterator[RunningServer]:
    folder = tmp_path / "session"
    with serving(sample, folder, camera=sample.camera(), name="sample", token="test", proposes=True) as (running, _):
        yield running


@pytest.mark.parametrize("browser", [firefox, webkit])
def test_the_main_path_runs(
    browser: Callable[[Path], AbstractContextManager[RemotePage]], server: RunningServer, tmp_path: Path
) -> None:
    folder = tmp_path / "browser"
    folder.mkdir()
    with browser(folder) as remote:
        page = RemoteDriver(remote, server.url)
        page.press("v")  # without the 3D view, which is drawn in software, the search is faster
        accept_proposals(page, 4)
        mark_drag_and_undo(page)
        export(page)
        before = marks(page)
        page.open(server.origin)
        page.settle()
        assert marks(page) == before
        page.press("v")
        the_radar_is_shown(page)
        assert remote.errors() == []


def marks(page: Driver) -> list[tuple[float, float]]:
    return [(row["u_px"], row["v_px"]) for row in page.view["clicks"]]


def accept_proposals(page: Driver, count: int) -> None:
    page.until(f"__cocalib.state.proposals?.rows.length > {count}", _LOOKING_S)
    for number in range(count):
        while len(marks(page)) == number:  # what has just moved is not accepted
            page.until(_OFFERED)
            page.press("Enter")
    page.until("__cocalib.state.view.has_calibration")


def mark_drag_and_undo(page: Driver) -> None:
    """Correct the proposal on screen by a click, which may lead to the next one; then drag that mark."""
    page.until(_OFFERED)
    count, offer = len(marks(page)), page.value("__cocalib.shownOffer()")
    frame, (u, v) = offer["row"]["frame"], offer["place"]["pixel_px"]
    page.click(u + 2, v - 1)
    page.until(f"__cocalib.state.view.clicks.length === {count + 1}")
    page.go_to(frame)
    page.press("f")
    before, clicked = marks(page), page.value(f"__cocalib.clicksIn({frame})[0]")
    start, end = (clicked["u_px"], clicked["v_px"]), (u - 30, v - 20)
    assert start == pytest.approx((u, v), abs=3.0)
    page.drag(start, end)
    [dragged] = set(marks(page)) - set(before)
    assert dragged == pytest.approx(end, abs=4.0)
    page.press("Control+z")
    assert marks(page) == before


def export(page: Driver) -> None:
    """Read what the page Deliver shows."""
    page.value("document.getElementById('tab-deliver').click()")
    page.until("document.querySelector('#page-deliver .text').textContent.includes('cocalib/calibration')")
    file = read_any(page.value("document.querySelector('#page-deliver .text').textContent"))
    assert file.format == "json"
    assert file.camera is not None


def the_radar_is_shown(page: Driver) -> None:
    """Look for the 3D view; without WebGL2, for the reason and the returns from above."""
    if page.value("document.createElement('canvas').getContext('webgl2') !== null"):
        page.until(f"__cocalibSpace.frameShown() !== null && {_WHY} === ''")
    else:
        page.until(f"{_WHY}.includes('WebGL2')")
        assert page.value("document.querySelector('#space > #birdseye').getBoundingClientRect().width > 100")
