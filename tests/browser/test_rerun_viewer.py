"""Rerun's web viewer, as `cocalib show --web` serves it, in a real browser: what it draws, and whom it asks."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from cocalib.rerun import write_view
from cocalib.rerun.viewer import serve_view
from tests.recorded_view import nearest_rows, opened_view

pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
pytestmark = pytest.mark.browser

GREY = 90
"""Of every pixel of the recorded images."""
LATEST_S = 120


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[str, np.ndarray, tuple[int, int, int]]]:
    """Serve the view of a small recording; yield its link, and where and in which colour its first return is."""
    with opened_view(tmp_path) as view:
        write_view(view, tmp_path / "view.rrd")
        pixel_px = view.calibration.reproject(nearest_rows(view.recording, int(view.recording.image_times[0])))[0]
        colour = view.colours.of(view.recording.radar_scans_around([view.recording.image_times[0]], 0.0))[0]
    with serve_view(tmp_path / "view.rrd") as running:
        thread = threading.Thread(target=running.server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        yield running.url, pixel_px, colour
        running.server.shutdown()
        thread.join()


def image_in(page: Page) -> tuple[np.ndarray, tuple[int, int, int, int]]:
    """Return what the page shows, red first, and the rectangle of the recorded image in it (left, top, width, height)."""
    shown = cv2.imdecode(np.frombuffer(page.screenshot(timeout=LATEST_S * 1000), np.uint8), cv2.IMREAD_COLOR)[
        :, :, ::-1
    ]
    left_half = shown[:, : shown.shape[1] // 2].astype(int)
    grey = (np.abs(left_half - GREY).max(axis=2) <= 3).astype(np.uint8)
    _, _, regions, _ = cv2.connectedComponentsWithStats(grey)
    largest = max(regions[1:].tolist(), key=lambda region: region[4], default=[0, 0, 0, 0, 0])
    return shown, tuple(largest[:4])


@pytest.mark.slow
def test_the_viewer_draws_the_image_with_its_returns_and_asks_nobody_else(
    served: tuple[str, np.ndarray, tuple[int, int, int]], launch: Callable[..., Browser]
) -> None:
    link, pixel_px, colour = served
    page = launch().new_page(viewport={"width": 700, "height": 420})
    answered: list[str] = []
    page.on("response", lambda response: answered.append(response.url))
    page.goto(f"{link}&renderer=webgl")
    for _ in range(LATEST_S):
        shown, (left, top, width, height) = image_in(page)
        if width * height > 20_000:
            break
        page.wait_for_timeout(500)
    assert width / height == pytest.approx(320 / 240, rel=0.02), "the image was not drawn"
    near = (np.array([left, top]) + (pixel_px + 0.5) * width / 320).astype(int)
    around = shown[near[1] - 3 : near[1] + 4, near[0] - 3 : near[0] + 4].reshape(-1, 3).astype(int)
    assert np.abs(around - np.array(colour, dtype=int)).max(axis=1).min() <= 40
    assert {urlsplit(url).netloc for url in answered} == {urlsplit(link).netloc}
