"""The dialog that chooses what is opened: a camera file is dropped, a radar is chosen, a folder is browsed."""

import base64
import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import simulate
from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver
from tests.image_recording import grey_frames
from tests.served_process import ServedProcess, served_process

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

DIALOG = "document.querySelector('#opening-dialog[open]')"
SMALL: dict[str, Any] = {"dwell_s": 4.0, "width_px": 320, "height_px": 200, "camera_rate_hz": 2.0}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a recording without intrinsics, one with two radars, and a damaged one."""
    folder = tmp_path_factory.mktemp("recordings")
    two_radars = replace(PRESETS["two-radars"], placements=1, surroundings=SimulationOptions().surroundings, **SMALL)
    (folder / "two").mkdir()
    with grey_frames():
        write_recording(simulate(SimulationOptions(placements=6, **SMALL)), folder, ("csv",))
        write_recording(simulate(two_radars), folder / "two", ("ros1",))
    (folder / "recording_csv" / "camera.yaml").rename(folder / "camera.yaml")
    (folder / "damaged.bag").write_bytes(b"GIF89a")
    return folder


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., ServedProcess]]:
    """Start the command; it is ended with the test."""
    with ExitStack() as stack:
        yield lambda *arguments: stack.enter_context(
            served_process(*arguments, "--on-problem", "ask", "--token", "choosing-1", state=tmp_path)
        )


def drop(page: Driver, name: str, data: bytes) -> None:
    """Drop a file on the page, as a file manager does."""
    page.page.evaluate(
        """([name, data]) => {
            const carried = new DataTransfer();
            carried.items.add(new File([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))], name));
            for (const type of ["dragover", "drop"])
                document.body.dispatchEvent(new DragEvent(type, { dataTransfer: carried, bubbles: true, cancelable: true }));
        }""",
        [name, base64.b64encode(data).decode()],
    )


@pytest.mark.slow
def test_without_intrinsics_one_can_click_and_a_dropped_camera_file_gives_the_pose(
    recordings: Path, serve: Callable[..., ServedProcess], open_page: Callable[..., Driver]
) -> None:
    camera = (recordings / "camera.yaml").read_bytes()
    server = serve(recordings / "recording_csv", "--clicks", recordings / "clicks.json")
    page = open_page(server.url)
    page.until("!document.getElementById('intrinsics-strip').hidden && __cocalib.state.view.stage === 'unsolvable'")
    before = page.view["clicks"]
    assert len(before) == 6
    for name, data, words in (
        ("photo.png", b"\x89PNG\r\n\xff", "photo.png is no camera"),
        ("large.yaml", camera + b"\n# large" * 80_000, "large.yaml is no camera"),
        ("drive.bag", b"#ROSBAG V2.0\n" * 300_000, "cocalib open drive.bag"),
        ("other.yaml", camera.replace(b"320", b"640"), "calibrated for 640 x 200 px, but the frames have 320 x 200 px"),
    ):
        drop(page, name, data)
        page.until(f"document.getElementById('toasts').innerText.includes({words!r})")
    assert page.value("__cocalib.state.recording.intrinsics") == ""
    with page.page.expect_navigation():
        drop(page, "camera.yaml", camera)
    page.until("__cocalib.state.view && !__cocalib.state.view.solving && __cocalib.state.view.has_calibration")
    assert [(click["id"], click["u_px"], click["v_px"]) for click in page.view["clicks"]] == [
        (click["id"], click["u_px"], click["v_px"]) for click in before
    ]
    assert page.value("__cocalib.state.recording.intrinsics") == "camera.yaml"
    assert page.page.is_hidden("#intrinsics-strip")
    page.forget_lost_connections()


def test_clicks_a_calibration_and_boxes_are_taken_wherever_they_are_dropped(
    open_page: Callable[..., Driver], server: RunningServer, project_root: Path
) -> None:
    page = open_page(server.url)
    drop(page, "marks.txt", (project_root / "sample_data/rooftop/clicks.json").read_bytes())
    page.until("__cocalib.state.view.clicks.length === 20 && __cocalib.state.view.has_calibration")
    page.settle()
    drop(page, "other.json", page.page.request.get(f"{page.page.url}api/calibration.json").body())
    page.until("document.querySelector('.compare .verdict').innerText.includes('other.json')")
    assert page.page.is_visible("#page-check")
    image = {"id": 1, "file_name": "1.jpg", "width": 4, "height": 4}
    coco = {"images": [image], "annotations": [], "categories": []}
    drop(page, "boxes.txt", json.dumps(coco).encode())
    page.until("document.getElementById('toasts').innerText.includes('boxes.txt')")
    assert page.page.is_visible("#page-evaluate")


@pytest.mark.slow
def test_a_recording_is_found_below_the_root_and_its_other_radar_is_chosen(
    recordings: Path, serve: Callable[..., ServedProcess], open_page: Callable[..., Driver]
) -> None:
    server = serve("--root", recordings)
    page = open_page(server.url, ready=DIALOG)
    page.page.check("#opening-dialog label:has-text('damaged.bag') input")
    page.page.click("#opening-dialog .primary")
    page.until(f"{DIALOG} && document.querySelector('#opening-dialog .problem').innerText.includes('damaged.bag')")
    page.page.keyboard.press("Escape")
    assert page.value(f"Boolean({DIALOG})")  # there is nothing behind the question
    page.page.click("#opening-dialog details.others summary")
    page.page.click("#opening-dialog button:has-text('look into two /')")
    for name in ("radar.bag", "camera.bag"):
        page.page.check(f"#opening-dialog label:has-text('{name}') input")
    page.page.click("#opening-dialog .primary")
    page.until(f"!{DIALOG} && __cocalib.state.shown")
    used = page.value("__cocalib.state.recording.radar_topic")
    page.page.click("#choose-recording")
    page.until("document.querySelector('input[name=radar]:not(:checked)')")
    other = page.value(
        "[...document.querySelectorAll('input[name=radar]:not(:checked)')][0].parentNode.children[1].innerText"
    )
    page.page.check(f"#opening-dialog label:has-text('{other}') input")
    with page.page.expect_navigation():
        page.page.click("#opening-dialog .primary")
    page.until("__cocalib.state.shown")
    assert page.value("__cocalib.state.recording.radar_topic") == other != used
    second = open_page(server.url)
    second.page.click("#choose-recording")
    second.until(DIALOG)
    second.page.click("#opening-dialog details.others summary")
    assert "radar.bag" in second.text("#opening-dialog .others")
    second.page.click("text=Clear the list")
    second.until("document.querySelector('#opening-dialog .others').innerText.includes('No other recording')")
    second.page.keyboard.press("Escape")
    assert not second.value(f"Boolean({DIALOG})")
    page.forget_lost_connections()
