"""The sheet Lens: from a recording that says nothing of its lens to a pose, and the image without distortion."""

import json
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from calib_core.interchange.cameras.files import read_camera_file
from calib_core.interchange.cameras.rectification import rectified_camera
from calib_core.recordings import Recording, open_recording
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import simulate
from cocalib.intrinsics import RecordedImages
from cocalib.web.port.server import RunningServer
from cocalib.workspace import Workspace
from tests.browser.accessibility import violations
from tests.browser.driving import Driver
from tests.serving import OWN_PORT, serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

OPTIONS = replace(
    PRESETS["intrinsics"],
    placements=4,
    dwell_s=3.5,
    width_px=400,
    height_px=250,
    camera_rate_hz=2.0,
    radar_rate_hz=8.0,
    waved_board_s=12.0,
)
HELD_FROM = 16
"""The search waits at this image until the test has cancelled it."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("waved")
    write_recording(simulate(OPTIONS), folder)
    return folder


@pytest.fixture
def waved(folder: Path, tmp_path: Path) -> Iterator[tuple[RunningServer, Workspace]]:
    """Serve a recording without intrinsics in which a board is waved first."""
    with open_recording([folder / "radar.bag", folder / "camera.bag"]) as recording:
        assert recording.camera() is None
        with serving(recording, tmp_path / "s", name="waved", port=OWN_PORT, token="test") as (running, workspace):
            yield running, workspace


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """Hold the search at an image until the event is set."""
    opened = threading.Event()

    class Held(RecordedImages):
        def image(self, index: int, /) -> np.ndarray:
            if index >= HELD_FROM:
                opened.wait(60)
            return super().image(index)

    monkeypatch.setattr("cocalib.web.channel.lens.RecordedImages", Held)
    yield opened
    opened.set()


def shade_at(page: Driver, u: float, v: float, canvas: str = "image") -> np.ndarray:
    """Return what a canvas shows at an image point: red, green, blue."""
    return np.array(
        page.value(
            f"(() => {{ const box = document.getElementById('{canvas}'); const [x, y] = __cocalib.toCss({u}, {v});"
            "const ratio = box.width / box.clientWidth;"
            "return [...box.getContext('2d').getImageData(x * ratio, y * ratio, 1, 1).data.slice(0, 3)]; })()"
        ),
        dtype=float,
    )


@pytest.mark.slow
def test_a_lens_is_calibrated_on_the_page_and_the_clicks_give_a_pose(
    gate: threading.Event, waved: tuple[RunningServer, Workspace], folder: Path, open_page: Callable[..., Driver]
) -> None:
    server, workspace = waved
    truth: Any = json.loads((folder / "truth.json").read_text())
    page = open_page(server.url)
    expect(page.page.locator("#page-lens")).to_be_visible()
    assert "not known yet" in page.text("#page-lens")
    assert "No camera intrinsics" in page.text("#intrinsics-strip")

    page.click_sample(truth)
    assert page.view["stage"] == "unsolvable"
    page.page.click("#sheet-close")
    expect(page.page.locator("#page-mark")).to_be_visible()
    page.page.click("#intrinsics-strip .chip")
    expect(page.page.locator("#page-lens")).to_be_visible()

    page.page.fill('[aria-label="Size of the board"]', "nine")
    page.page.fill('[aria-label="Side of a square"]', "22.14")
    page.page.click(".lens-form button[type=submit]")
    expect(page.page.locator(".lens-problem")).to_contain_text("such as 9x6")
    page.page.fill('[aria-label="Size of the board"]', "9x6")
    page.page.select_option('[aria-label="Lens model"]', "plumb_bob")
    page.page.click(".lens-form button[type=submit]")
    page.until("__cocalib.state.lens.stage === 'searching' && __cocalib.state.lens.views > 2")
    assert page.value("document.activeElement.textContent") == "Cancel", "kept while the progress changes"
    page.page.keyboard.press("Enter")
    page.until("__cocalib.unconfirmed() === 0")
    gate.set()
    page.until("__cocalib.state.lens.stage === 'cancelled'")
    kept = page.value("__cocalib.state.lens.views")
    assert f"found in {kept} of" in page.text(".lens-words")
    expect(page.page.get_by_role("button", name="Resume")).to_be_focused()
    page.page.keyboard.press("Enter")
    page.until("['done', 'failed'].includes(__cocalib.state.lens.stage) && __cocalib.state.lens.result", seconds=150)
    assert page.value("__cocalib.state.lens.problem") == ""
    assert page.value("__cocalib.state.lens.views") > kept
    assert workspace.camera is None, "nothing is used before the person says so"
    expect(page.page.get_by_role("heading", name="Calibrated lens")).to_be_in_viewport()

    page.page.click("text=Use these intrinsics")
    page.until("__cocalib.state.lens.in_use")
    page.settle()
    assert workspace.camera is not None
    assert workspace.camera.matrix_px[0, 0] == pytest.approx(truth["camera"]["matrix_px"][0][0], rel=0.01)
    assert page.view["has_calibration"]
    expect(page.page.locator("#intrinsics-strip")).to_be_hidden()
    page.press("Control+z")
    page.until("__cocalib.state.lens.intrinsics === null")
    page.press("Control+Shift+z")
    page.until("__cocalib.state.lens.in_use")
    page.settle()
    assert page.view["has_calibration"]

    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Save camera.yaml").last.click()
    saved = read_camera_file(download.value.path())
    np.testing.assert_allclose(saved.parameters, workspace.camera.parameters, rtol=1e-9)
    page.page.click(".lens-table:not(.trials) summary")
    row = page.page.locator(".lens-table .row").first
    frame = int(row.get_attribute("data-frame") or -1)
    with page.page.expect_response(f"**/api/board_corners.json?{frame}") as answered:
        row.click()
    page.until(f"__cocalib.state.shown.index === {frame}")
    u, v, *_ = answered.value.json()[0]
    page.until(
        f"(() => {{ const marks = document.getElementById('marks'); const [x, y] = __cocalib.toCss({u}, {v});"
        "const ratio = marks.width / marks.clientWidth;"
        "return marks.getContext('2d').getImageData(x * ratio - 8, y * ratio - 8, 16, 16).data.some((one) => one > 0); })()"
    )
    assert violations(page) == []


def test_the_rectified_image_is_that_of_a_pinhole_and_takes_lines_instead_of_marks(
    page: Driver, sample: Recording, workspace: Workspace
) -> None:
    page.go_to(40)
    page.until("__cocalib.state.lens")
    page.press("u")
    page.until("__cocalib.state.shown.rectified")
    page.drawn()
    camera = sample.camera()
    assert camera is not None
    wanted = cv2.undistort(
        sample.image(40), camera.matrix_px, camera.distortion, newCameraMatrix=rectified_camera(camera).matrix_px
    )
    flat = [
        (u, v)
        for u in range(60, 920, 86)
        for v in range(60, 560, 71)
        if np.ptp(wanted[v - 4 : v + 5, u - 4 : u + 5], axis=(0, 1)).max() < 20
    ]
    assert len(flat) > 20
    for u, v in flat:
        np.testing.assert_allclose(shade_at(page, u, v), wanted[v, u, ::-1], atol=14)

    page.click(300, 300)
    assert "rectified" in page.text("#toasts")
    assert workspace.session.clicks == ()
    assert shade_at(page, 440, 301, "marks").max() < 100
    page.drag((300, 280), (500, 310))
    page.drawn()
    assert shade_at(page, 440, 301, "marks")[0] > 150, "the line lies along what the person dragged"
    page.press("u")
    page.until("!__cocalib.state.shown.rectified")
    page.drawn()
    page.click(300, 300)
    assert len(workspace.session.clicks) == 1
