"""A real browser, the sample recording served in this process, and a fresh page for every test."""

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Playwright, expect, sync_playwright

from calib_core.arrays import TimesNs
from calib_core.measurements import RadarScans
from calib_core.options import GatingOptions
from calib_core.recordings import Recording, open_recording
from cocalib.web.channel import hub
from cocalib.web.channel.radar_survey import Survey, survey_of
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Workspace, open_workspace
from tests.browser.driving import FLAGS, PATIENCE_S, Driver
from tests.find_browser import find_browser
from tests.serving import serving

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
    running = start(workspace, sample, ServerOptions(port=0, token="test"))
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
def open_page(chromium: Browser, request: pytest.FixtureRequest) -> Iterator[Callable[..., Driver]]:
    """Open pages; at the end, check that none logged an error or contacted another machine.

    Those marked no_3d_view have an empty frame in the place of the 3D view, whose loading costs two seconds.
    """
    without_3d_view = request.node.get_closest_marker("no_3d_view") is not None
    drivers: list[Driver] = []
    contexts = []

    def open_one(
        url: str,
        browser: Browser | None = None,
        ready: str = "__cocalib.state.shown",
        script: str = "",
        **context_options: Any,
    ) -> Driver:
        context = (browser or chromium).new_context(**{"viewport": {"width": 1280, "height": 720}, **context_options})
        contexts.append(context)
        if script:
            context.add_init_script(script)
        if without_3d_view:
            context.add_init_script(EMPTY_3D_VIEW)
        drivers.append(Driver(context.new_page(), url, ready))
        return drivers[-1]

    yield open_one
    for driver in drivers:
        assert driver.complaints == []
        strangers = [
            url
            for url in driver.addresses
            if not url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "blob:", "data:"))
        ]
        assert strangers == []
    for context in contexts:
        context.close()


@pytest.fixture
def page(open_page: Callable[..., Driver], server: RunningServer) -> Driver:
    return open_page(server.url)
