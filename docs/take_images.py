"""Take the images of the documentation: `make image` writes docs/images/*.png from the sample recording.

`python docs/take_images.py --sizes` writes docs/images/sizes.jpg: the page in windows of five sizes, dark and light;
`--commands` takes again only what the command line makes, the report and a frame of a video.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from calib_core.recordings import open_recording  # noqa: E402
from cocalib.web.port.link import ServerOptions  # noqa: E402
from cocalib.web.port.server import RunningServer, start  # noqa: E402
from cocalib.workspace import open_workspace  # noqa: E402
from tests.browser.driving import FLAGS, Driver  # noqa: E402
from tests.find_browser import find_browser  # noqa: E402

IMAGES = ROOT / "docs" / "images"
SIZE = {"width": 1440, "height": 900}
SIZES = ((390, 844), (1024, 768), (1280, 720), (1440, 900), (3840, 2160))
ROW_PX, GAP_PX = 400, 12
"""Height of an image in the contact sheet, and what is between two."""


def opened(
    browser: Browser,
    server: RunningServer,
    theme: str,
    ready: str = "__cocalib.state.shown",
    size: dict[str, int] = SIZE,
) -> Driver:
    """Open the page in a theme, 3D view included."""
    page = browser.new_page(viewport=size)  # type: ignore[arg-type]
    page.add_init_script(f"if (top === window) localStorage.setItem('cocalib-layout', '{{\"theme\": \"{theme}\"}}')")
    driver = Driver(page, server.url, ready)
    driver.until("__cocalib.state.placementsKnown")
    page.frame_locator("#space-view").locator("canvas").last.wait_for(state="attached")
    return driver


def shoot(driver: Driver, name: str) -> None:
    """Wait until the 3D view has drawn what it was told, then take the image."""
    driver.settle()
    driver.page.wait_for_timeout(3000)
    driver.page.screenshot(path=IMAGES / f"{name}.png")
    print(IMAGES / f"{name}.png")


def placed(driver: Driver, clicks: list[dict[str, Any]]) -> None:
    """Click what the sample's example clicks say."""
    for click in clicks:
        driver.go_to(driver.frame_at(click["image_time"]))
        driver.page.mouse.click(*driver.place_of(*click["pixel_px"]))
        driver.until("__cocalib.unconfirmed() === 0")
    driver.settle()


def take_all(browser: Browser, server: RunningServer, clicks: list[dict[str, Any]]) -> None:
    """Walk through one calibration: first look, a click under the loupe, the result, an outlier, the light theme."""
    driver = opened(browser, server, "dark")
    driver.press("n")
    shoot(driver, "empty")
    placed(driver, clicks)
    u, v = clicks[3]["pixel_px"]
    driver.go_to(driver.frame_at(clicks[3]["image_time"]))
    driver.zoom_to(u, v, 1.6)
    driver.page.mouse.move(*driver.place_of(u + 5, v + 3))
    shoot(driver, "page")
    driver.page.mouse.move(700, 860)
    driver.press("f", "j")
    driver.page.click("#tab-check")
    shoot(driver, "pose")
    driver.page.click("#panel-large")
    driver.press("5")
    driver.until("document.querySelectorAll('.review-pair dd').length > 1")
    shoot(driver, "review")
    driver.page.close()
    shoot(opened(browser, server, "light"), "light")


def take_radar_only(browser: Browser, folder: Path, session: Path) -> None:
    """Look at the sample's radar without its camera: the third placement."""
    with open_recording(folder / "radar.bag", require=("radar",)) as recording:
        workspace = open_workspace(recording, camera=None, session_folder=session, name="radar.bag")
        server = start(workspace, recording, ServerOptions(port=0, token="images"))
        driver = opened(browser, server, "dark", "__cocalib.state.look")
        driver.until("__cocalib.state.radarMap")
        driver.press("n", "n", "n")
        driver.until("__cocalib.state.look.index === __cocalib.state.placements[2].frame")
        shoot(driver, "radar")
        server.close()
        workspace.close()


def take_commands(browser: Browser, sample: Path, made: Path) -> None:
    """Make a report and a video of the sample with the commands that the gallery shows."""
    recording = [sample / "radar.bag", sample / "camera.bag"]
    answer, report, video = made / "calibration.json", made / "report.html", made / "overlay.mp4"
    assert run(["solve", *recording, "--clicks", sample / "clicks.json", "--out", answer]) == 0
    assert run(["evaluate", answer, *recording, "--report", report, "--require", "max-deg=3", "max-cm=30"]) == 0
    assert run(["show", *recording, "--calibration", answer, "--out", video]) == 0
    page = browser.new_page(viewport={"width": 1100, "height": 1270}, color_scheme="light")
    page.goto(report.as_uri())
    page.screenshot(path=IMAGES / "report.png")
    page.close()
    frames = cv2.VideoCapture(str(video))
    frames.set(cv2.CAP_PROP_POS_MSEC, 28_000)
    there, frame = frames.read()
    assert there
    cv2.imwrite(str(IMAGES / "overlay.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 85])


def run(words: list[str | Path]) -> int:
    """Run a command of cocalib."""
    return subprocess.run([sys.executable, "-m", "cocalib", *words]).returncode


def take_sizes(browser: Browser, server: RunningServer, clicks: list[dict[str, Any]]) -> None:
    """Put the page in windows of all sizes on one sheet, one row for each theme."""
    first = opened(browser, server, "dark")
    placed(first, clicks)
    first.page.close()
    rows = []
    for theme in ("dark", "light"):
        images = []
        for width, height in SIZES:
            driver = opened(browser, server, theme, size={"width": width, "height": height})
            driver.go_to(driver.frame_at(clicks[3]["image_time"]))
            driver.until("__cocalib.state.overlay.index === __cocalib.state.shown.index")
            driver.page.wait_for_timeout(3000)  # the 3D view draws what it was told
            images.append(scaled(driver.page.screenshot()))
            driver.page.close()
        rows.append(beside(images, axis=1))
    path = IMAGES / "sizes.jpg"
    cv2.imwrite(str(path), beside(rows, axis=0), [cv2.IMWRITE_JPEG_QUALITY, 78])
    print(path)


def scaled(screenshot: bytes) -> np.ndarray:
    """Decode a screenshot and bring it to the height of a row (h, w, 3)."""
    image = cv2.imdecode(np.frombuffer(screenshot, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    width_px = round(image.shape[1] * ROW_PX / image.shape[0])
    return np.asarray(cv2.resize(image, (width_px, ROW_PX), interpolation=cv2.INTER_AREA))


def beside(images: list[np.ndarray], axis: int) -> np.ndarray:
    """Join images (h, w, 3) with grey gaps between them."""
    shape = (images[0].shape[0], GAP_PX, 3) if axis == 1 else (GAP_PX, images[0].shape[1], 3)
    gap = np.full(shape, 128, dtype=np.uint8)
    parts = [part for image in images for part in (gap, image)]
    return np.concatenate(parts[1:], axis=axis)


def main() -> None:
    """Serve the sample with a session of its own and take the images."""
    only = sys.argv[1:]
    if only not in ([], ["--sizes"], ["--commands"]):
        sys.exit("usage: python docs/take_images.py [--sizes | --commands]")
    IMAGES.mkdir(parents=True, exist_ok=True)
    folder = ROOT / "sample_data" / "rooftop"
    clicks = json.loads((folder / "clicks.json").read_text(encoding="utf-8"))["clicks"]
    with (
        tempfile.TemporaryDirectory() as session,
        open_recording([folder / "radar.bag", folder / "camera.bag"]) as recording,
    ):
        workspace = open_workspace(
            recording, camera=recording.camera(), session_folder=Path(session) / "s", name="the sample recording"
        )
        server = start(workspace, recording, ServerOptions(port=0, token="images"))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=str(find_browser()), args=FLAGS)
            if only == ["--sizes"]:
                take_sizes(browser, server, clicks)
            if not only:
                take_all(browser, server, clicks)
                take_radar_only(browser, folder, Path(session) / "radar")
            if only != ["--sizes"]:
                take_commands(browser, folder, Path(session))
            browser.close()
        server.close()
        workspace.close()


if __name__ == "__main__":
    main()
