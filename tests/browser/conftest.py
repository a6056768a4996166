"""A real browser, the sample recording served in this process, and a fresh page for every test."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Playwright, expect, sync_playwright

from calib_core.arrays import TimesNs
from calib_core.measurements import RadarScans
from calib_core.options import GatingOptions
from calib_core.recordings import Recording, open_recording
from cocalib.web.channel import hub
from cocalib.web.channel.radar_survey import Survey, survey_of
from cocalib.web.port import routes
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Workspace, open_workspace
from tests.browser.driving import FLAGS, PATIENCE_S, Driver
from tests.find_browser import find_browser
from tests.serving import OWN_PORT, serving

expect.set_options(timeout=PATIENCE_S * 1000)

EMPTY_3D_VIEW = """document.addEventListener("readystatechange", () => {
  if (document.readyState === "interactive") document.getElementById("space-view")?.setAttribute("src", "about:blank");
});"""
"""The page loads viser only where its frame is empty."""


@pytest.fixture(scope="package")
def playwright_driver() -> Iterator[Playwright]:
    """Start Playwright for this folder only: it keeps an event loop running in this thread, which would disturb others."""
    with sync_playwright() as driver:
        yield driver


@pytest.fixture(scope="session")
def browser_path() -> Path:
    return find_browser()


@pytest.fixture(scope="package")
def launch(playwright_driver: Playwright, browser_path: Path) -> Iterator[Callable[..., Browser]]:
    """Start browsers with extra flags; all are closed at the end."""
    running: list[Browser] = []

    def start_browser(*flags: str) -> Browser:
        browser = playwright_driver.chromium.launch(executable_path=str(browser_path), args=[*FLAGS, *flags])
        running.append(browser)
        return browser

    yield start_browser
    for browser in running:
        browser.close()


@pytest.fixture(scope="package")
def chromium(launch: Callable[..., Browser]) -> Browser:
    return launch()


def new_window(browser: Browser, *, without_3d_view: bool, script: str = "", **options: Any) -> BrowserContext:
    """Open a window with its own cookies, settings and files; the script runs first on each of its pages."""
    window = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
    for first in filter(None, (script, EMPTY_3D_VIEW if without_3d_view else "")):
        window.add_init_script(first)
    return window


@pytest.fixture(scope="package")
def shared_window(chromium: Browser) -> Callable[[bool], BrowserContext]:
    """Return the window of ordinary pages, without or with the 3D view; it has the page's files from the second time on."""
    return cache(lambda without_3d_view: new_window(chromium, without_3d_view=without_3d_view))


@pytest.fixture(scope="package", autouse=True)
def files_may_be_kept() -> Iterator[None]:
    """Let browsers keep the files of the page, whose server has the same port in each test where it can."""
    patch, answer = pytest.MonkeyPatch(), routes._file

    def kept(*arguments: Any, **options: Any) -> routes.Reply:
        reply = answer(*arguments, **options)
        headers = {**dict(reply.headers), "Cache-Control": "max-age=3600"}
        return replace(reply, headers=tuple(headers.items()))

    patch.setattr(routes, "_file", kept)
    yield
    patch.undo()


@pytest.fixture(scope="session", autouse=True)
def own_state_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the cookie's key out of the user's state folder."""
    patch = pytest.MonkeyPatch()
    patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
    yield
    patch.undo()


@pytest.fixture(scope="session")
def truth(project_root: Path) -> Any:
    return json.loads((project_root / "sample_data" / "rooftop" / "truth.json").read_text())


@pytest.fixture(scope="session")
def sample(project_root: Path) -> Iterator[Recording]:
    folder = project_root / "sample_data" / "rooftop"
    with open_recording([folder / "radar.bag", folder / "camera.bag"]) as recording:
        yield recording


@pytest.fixture
def workspace(sample: Recording, tmp_path: Path) -> Iterator[Workspace]:
    opened = open_workspace(sample, camera=sample.camera(), session_folder=tmp_path / "session", name="sample")
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def survey_of_sample() -> Callable[..., Survey]:
    """Search the sample's radar for placements once, whatever it is asked with, and not for each server of it."""
    known: dict[GatingOptions, Survey] = {}

    def survey(windows: Iterable[RadarScans], moments: TimesNs, options: GatingOptions) -> Survey:
        if options not in known:
            known[options] = survey_of(windows, moments, options)
        return known[options]

    return survey


@pytest.fixture
def server(
    workspace: Workspace,
    sample: Recording,
    survey_of_sample: Callable[..., Survey],
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[RunningServer]:
    monkeypatch.setattr(hub, "survey_of", survey_of_sample)
    running = start(workspace, sample, ServerOptions(port=OWN_PORT, token="test"))
    yield running
    running.close()


@pytest.fixture
def radar_only_server(project_root: Path, tmp_path: Path) -> Iterator[RunningServer]:
    """Serve a recording without images; nothing is stored, because the session belongs to a recording with images."""
    radar, folder = project_root / "sample_data" / "rooftop" / "radar.bag", tmp_path / "s"
    with (
        open_recording(radar, require=("radar",)) as recording,
        serving(recording, folder, name="radar.bag", token="test") as (running, _),
    ):
        yield running
    assert not folder.exists()


@pytest.fixture
def open_page(
    chromium: Browser, shared_window: Callable[[bool], BrowserContext], request: pytest.FixtureRequest
) -> Iterator[Callable[..., Driver]]:
    """Open pages; at the end, check that none logged an error or contacted another machine.

    Those marked no_3d_view have an empty frame in the place of the 3D view, whose loading costs two seconds. The first page
    of a test that asks for nothing else shares its window with those of other tests, without their cookies and settings.
    """
    without_3d_view = request.node.get_closest_marker("no_3d_view") is not None
    drivers: list[Driver] = []
    windows: list[BrowserContext] = []
    shared = shared_window(without_3d_view)

    def open_one(
        url: str,
        browser: Browser | None = None,
        ready: str = "__cocalib.state.shown",
        **window_options: Any,
    ) -> Driver:
        if browser or window_options or drivers:
            windows.append(new_window(browser or chromium, without_3d_view=without_3d_view, **window_options))
            page = windows[-1].new_page()
        else:
            page = shared.new_page()
            origin = {"origin": url.partition("/?")[0], "storageTypes": "local_storage"}
            shared.new_cdp_session(page).send("Storage.clearDataForOrigin", origin)
        drivers.append(Driver(page, url, ready))
        return drivers[-1]

    yield open_one
    try:
        for driver in drivers:
            assert driver.complaints == []
            assert driver.strangers == []
    finally:
        for page in shared.pages:
            page.close()
        shared.clear_cookies()
        shared.clear_permissions()
        for window in windows:
            window.close()


@pytest.fixture
def page(open_page: Callable[..., Driver], server: RunningServer) -> Driver:
    return open_page(server.url)
