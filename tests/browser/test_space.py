"""The 3D view in a browser: what is in it can be picked and read, and the Camera view equals the image."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.measurements import TimeNs
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.web.port.server import RunningServer
from cocalib.web.radar_sight import RadarSight
from cocalib.workspace import Workspace
from tests.browser.accessibility import violations
from tests.browser.driving import Driver

pytestmark = pytest.mark.browser
CHANGED = (
    "this version of viser has changed its private browser API; adapt static/space/viser_hook.js, or lower the upper bound "
    "of viser in pyproject.toml. Missing: "
)
SMALL = {"width": 1024, "height": 576}
SETTLED = "__cocalibSpace.frameShown() === __cocalib.state.cursor && __cocalibSpace.spaceFrame().index === __cocalib.state.cursor"


@pytest.fixture
def page(open_page: Callable[..., Driver], server: RunningServer) -> Driver:
    """Open a small page: without a graphics card, each pixel of the 3D view costs time."""
    return open_page(server.url, viewport=SMALL)


@pytest.fixture
def solved(page: Driver, workspace: Workspace, project_root: Path) -> Driver:
    workspace.import_clicks((project_root / "sample_data/rooftop/clicks.json").read_text(), "clicks.json")
    page.until(
        "__cocalib.state.view.clicks.length === 20 && !__cocalib.state.view.solving && __cocalib.state.placementsKnown"
    )
    page.until("__cocalibSpace.spaceFrame()?.reflectors.length === 20 && __cocalibSpace.pickable().length > 0")
    return page


def items(page: Driver, kind: str) -> list[dict[str, Any]]:
    """Return what of one kind can be picked, with its place on the screen."""
    found: list[dict[str, Any]] = page.value(
        "(() => { const box = document.getElementById('space-layer').getBoundingClientRect();"
        f"return __cocalibSpace.pickable().filter((item) => item.kind === '{kind}').map((item) => "
        "({ index: item.index, x: item.x + box.left, y: item.y + box.top, words: item.words })); })()"
    )
    return found


def test_steady_input_does_not_keep_the_view_from_being_drawn(page: Driver) -> None:
    page.value("void (cocalibPace.holdUntil = Infinity)")
    page.until("__cocalibSpace.pickable().length > 0")
    page.value("__cocalib.goTo(40)")
    page.until(SETTLED)


def test_without_webgl_the_pane_says_so_and_shows_the_returns_from_above(
    open_page: Callable[..., Driver], server: RunningServer
) -> None:
    none = "const made = HTMLCanvasElement.prototype.getContext; HTMLCanvasElement.prototype.getContext = "
    none += "function (kind, ...more) { return kind === 'webgl2' ? null : made.call(this, kind, ...more); };"
    page = open_page(server.url, viewport=SMALL, script=none)
    page.until("document.querySelector('.space-why').textContent.includes('WebGL2')")
    page.page.locator("#space #birdseye").wait_for(state="visible")
    assert page.page.get_attribute("#space-view", "src") is None
    page.until("__cocalib.state.placementsKnown")
    assert page.value("document.getElementById('birdseye').width") > 0
    assert violations(page) == []


def open_views(page: Driver) -> None:
    """Show what the 3D view can be looked at from, and its colours."""
    page.value("document.querySelector('.over-space details').open = true")


def look_from(page: Driver, viewpoint: str) -> None:
    """Choose a viewpoint, and wait until the view has moved and stands still."""
    page.until("__cocalibSpace.pickable().some((item) => item.kind === 'placement')")
    open_views(page)
    page.value("window.__where = () => JSON.stringify(__cocalibSpace.pickable().map(({ x, y }) => [x, y]))")
    page.value("window.__from = window.__last = window.__where()")
    page.page.click(f"[data-viewpoint={viewpoint}]")
    page.until(
        "(() => { const now = window.__where(); window.__same = now === window.__last && now !== window.__from"
        " ? (window.__same ?? 0) + 1 : 0; window.__last = now; return window.__same > 20; })()"
    )


@pytest.mark.slow
def test_viser_still_has_the_private_parts_that_labels_and_picking_use(solved: Driver) -> None:
    missing = solved.page.evaluate(
        """async () => {
            const { missingParts } = await import("/space/viser_hook.js");
            return missingParts(document.getElementById("space-view").contentWindow);
        }"""
    )
    assert missing == [], CHANGED + ", ".join(missing)
    picking(solved)
    choosing(solved)
    hidden_and_enlarged(solved)


def picking(page: Driver) -> None:
    """A placement and a reflector lead to their frames, a return is read out, and the frame that is drawn is named."""
    look_from(page, "above")
    found = items(page, "placement")
    assert len(found) >= 18, "all are in sight"
    alone = [
        one
        for one in found
        if all(np.hypot(one["x"] - r["x"], one["y"] - r["y"]) > 14 for r in found if r["index"] != one["index"])
    ]
    placement = alone[-1]
    page.page.mouse.move(placement["x"], placement["y"])
    page.until("/^(Placement|Reflector)/.test(document.querySelector('.space-readout').textContent)")
    page.page.mouse.click(placement["x"], placement["y"])
    row = f"__cocalib.state.placements[{placement['index']}]"
    page.until(f"__cocalib.state.seconds[__cocalib.state.cursor] >= {row}.start_s")
    page.until(f"__cocalib.state.seconds[__cocalib.state.cursor] <= {row}.end_s")
    page.until(SETTLED)
    page.until(
        f"document.querySelector('.space-frame').textContent === 'frame {page.value('__cocalib.state.cursor') + 1}'"
    )
    words = items(page, "return")[0]["words"]
    assert all(unit in words for unit in (" m, ", "°", "SNR", " dB", " m/s")), words


def choosing(page: Driver) -> None:
    """A candidate of the selected click can be chosen; undo takes the choice back."""
    page.press("j")
    page.until(
        "__cocalib.state.candidates?.click === __cocalib.state.selected && __cocalib.state.candidates.rows.length > 0"
    )
    page.until(SETTLED)
    page.until("__cocalibSpace.pickable().some((item) => item.kind === 'candidate')")
    candidate = items(page, "candidate")[0]
    page.page.mouse.click(candidate["x"], candidate["y"])
    page.until("__cocalib.state.candidates.rows.filter((row) => row.chosen).length === 1")
    page.press("Control+z")
    page.until("__cocalib.state.candidates.rows.every((row) => !row.chosen)")


def hidden_and_enlarged(page: Driver) -> None:
    """Hidden it takes no room and gets nothing; enlarged it changes places with the image; both are remembered."""
    box = "JSON.stringify(document.getElementById('%s').getBoundingClientRect())"
    page.press("b")
    page.until(f"{box % 'space'} === {box % 'image-pane'}")
    page.page.locator("#guide .do").first.click(trial=True)  # the line stays in front
    page.page.click("#inset")
    page.until(f"{box % 'space'} !== {box % 'image-pane'} && document.getElementById('inset').hidden")
    page.press("b")
    page.until(f"{box % 'space'} === {box % 'image-pane'}")
    page.press("v")
    page.until("document.getElementById('space').clientHeight < 40")
    before = page.value("__cocalibSpace.spaceFrame().number")
    page.press("ArrowRight")
    page.until("__cocalib.state.overlay?.index === __cocalib.state.cursor")
    page.page.reload()
    page.until("__cocalib.state.shown && document.getElementById('space').clientHeight < 40")
    assert page.value("__cocalibSpace.spaceFrame()") is None, f"nothing after number {before}, since it is hidden"
    page.press("v")
    page.until(SETTLED)
    assert page.value("document.getElementById('space').clientHeight") > 150


@pytest.mark.slow
def test_the_camera_view_equals_the_image(solved: Driver, workspace: Workspace, sample: Recording) -> None:
    outcome = workspace.session.outcome
    assert isinstance(outcome, Calibration)
    solved.go_to(solved.view["clicks"][3]["frame"])
    open_views(solved)
    solved.page.click("#space-camera")
    solved.until(SETTLED)
    stamp = TimeNs(int(sample.image_times[solved.value("__cocalib.state.cursor")]))
    scan = RadarSight(sample).scan_at(stamp)
    assert scan is not None
    points_camera = outcome.camera_from_radar @ outcome.radar_errors.corrected(scan.points_radar_m)
    pixels = outcome.camera.project(points_camera[outcome.camera.sees(points_camera)])
    wide, high = solved.value(
        "[document.getElementById('space').clientWidth, document.getElementById('space').clientHeight]"
    )
    scale = min(wide / outcome.camera.width_px, high / outcome.camera.height_px)
    corner = (np.array([wide, high]) - scale * np.array([outcome.camera.width_px, outcome.camera.height_px])) / 2
    expected = corner + (pixels + 0.5) * scale
    drawn = np.array(
        solved.value(
            "__cocalibSpace.pickable().filter((item) => item.kind === 'return').map((item) => [item.x, item.y])"
        )
    )
    assert len(drawn) == len(expected) > 3
    assert np.abs(drawn - expected).max() < 1.0
    solved.drawn()
    difference = solved.page.evaluate(IMAGE_DIFFERENCE, [*corner.tolist(), scale])
    assert difference < 12, "the page's own image is behind the returns"


IMAGE_DIFFERENCE = """([left, top, scale]) => {
    const layer = document.getElementById("space-layer");
    const { bitmap, width, height } = __cocalib.state.shown;
    const own = new OffscreenCanvas(layer.width, layer.height).getContext("2d");
    own.imageSmoothingQuality = "high";
    own.drawImage(bitmap, left, top, width * scale, height * scale);
    const box = [Math.ceil(left), Math.ceil(top), Math.floor(width * scale) - 1, Math.floor(height * scale) - 1];
    const [seen, expected] = [layer.getContext("2d").getImageData(...box).data, own.getImageData(...box).data];
    return expected.reduce((sum, value, index) => sum + Math.abs(value - seen[index]), 0) / expected.length;
}"""


@pytest.mark.slow
def test_without_images_returns_and_placements_can_be_picked_too(
    open_page: Callable[..., Driver], radar_only_server: RunningServer
) -> None:
    page = open_page(radar_only_server.url, ready="__cocalib.state.look", viewport=SMALL)
    page.until("__cocalib.state.placementsKnown && __cocalibSpace.spaceFrame()?.placements.length >= 10")
    assert not page.page.is_visible("#space-camera")
    open_views(page)
    page.page.select_option("#space-colour", "height")
    page.until("document.querySelector('.space-legend').textContent.endsWith(' m')")
    look_from(page, "above")
    placement = items(page, "placement")[-1]
    page.page.mouse.click(placement["x"], placement["y"])
    page.until("__cocalib.state.cursor > 0 && __cocalibSpace.frameShown() === __cocalib.state.cursor")


@pytest.mark.slow
def test_the_3d_view_shows_the_scene_and_says_before_a_pose_why_there_are_no_returns(page: Driver) -> None:
    scene_without_visers_own_panels(page)
    keys_while_it_has_the_focus(page)
    open_views(page)
    tops = "[...document.querySelectorAll('#viewpoints > *')].map((chip) => chip.getBoundingClientRect().top)"
    assert page.value(f"new Set({tops}).size") == 1, "the menu is one line"
    page.page.click("#space-camera")
    page.until("document.querySelector('.space-readout').textContent.startsWith('No pose yet')")
    page.page.click("#space-camera")
    page.until("document.querySelector('.space-readout').textContent === ''")


def scene_without_visers_own_panels(page: Driver) -> None:
    space = page.page.frame_locator("#space-view")
    space.locator("canvas").last.wait_for(state="attached")
    page.press("n")
    for _ in range(100):
        blue, green, red = (page.pixels("#space-view")[..., channel].astype(int) for channel in range(3))
        sky = (blue > 150) & (blue > red + 15)
        if sky.sum() > 200 and (green > red + 60).sum() > 20:
            break  # the image on the frustum, and the radar's y axis
    else:
        pytest.fail("the 3D view stayed empty")
    for panel in (".mantine-Paper-root", ".mantine-Notifications-root"):
        assert all(not part.is_visible() for part in space.locator(panel).all())


def keys_while_it_has_the_focus(page: Driver) -> None:
    page.go_to(0)
    page.page.frame_locator("#space-view").locator("canvas").last.click(position={"x": 60, "y": 120})
    assert page.value("document.activeElement.id") == "space-view"
    page.press("ArrowRight", "ArrowRight")
    page.until("__cocalib.state.shown.index === 2")


@pytest.mark.no_3d_view
def test_the_mathematics_of_picking_and_of_range_numbers(page: Driver) -> None:
    found = page.page.evaluate(PICKING)
    assert found["nearest"] == "placement"
    assert found["none"] is None
    assert found["words"].split(", ") == ["20.0 m", "2.5° right", "0.4° down", "SNR 23 dB", "0.0 m/s", "still"]
    assert found["bare"].split(", ") == ["3.0 m", "0.0° right", "1.0° up", "1.5 s ago"]
    places = {one["range"]: (one["x"], one["y"]) for one in found["rings"]}
    assert sorted(places) == [5, 10, 15], "all fit side by side"
    assert all(12 <= x <= 388 and 8 <= y <= 292 for x, y in places.values())
    assert found["crowded"] == 1, "of numbers in one place only one is written"


PICKING = """async () => {
    const { nearest, describeReturn, ringPlaces, Board } = await import("/space/layer.js");
    const item = (kind, x, y) => ({ kind, x, y, index: 0, key: kind, words: "" });
    const above = ([x, y]) => [200 - 10 * y, 290 - 10 * x];
    const size = () => [24, 16];
    return {
        nearest: nearest([item("return", 100, 100), item("placement", 102, 100), item("return", 140, 100)], 100.5, 100)?.kind,
        none: nearest([item("return", 100, 100)], 130, 100),
        words: describeReturn([null, null, 20.0, -0.01, 23.2, true, 0, 0, 0, 0, -2.5, -0.4]),
        bare: describeReturn([null, null, 3.0, null, null, true, 0, 0, 0, 1.5, 0, 1.0]),
        rings: ringPlaces([5, 10, 15], 0, above, new Board(400, 300), size),
        crowded: ringPlaces([5, 10, 15], 0, () => [50, 50], new Board(400, 300), size).length,
    };
}"""


@pytest.mark.no_3d_view
def test_a_slow_3d_view_draws_three_times_after_what_arrives_and_then_rests(page: Driver) -> None:
    assert page.page.evaluate(SLOW_DRAWINGS) == [3, 6]


SLOW_DRAWINGS = """async () => {
    const frame = document.body.appendChild(document.createElement("iframe"));
    const view = frame.contentWindow;
    let [now, drawings] = [0, 0];
    const due = [];
    view.performance.now = () => now;
    view.requestAnimationFrame = (callback) => due.push(callback);
    view.setTimeout = (callback, wait) => due.push(() => { now += wait; callback(); });
    const script = frame.contentDocument.createElement("script");
    script.src = "/space/pace.js";
    await new Promise((done) => { script.onload = done; frame.contentDocument.head.append(script); });
    const draw = () => { drawings += 1; now += 10000; view.requestAnimationFrame(draw); };
    const rest = () => { while (due.length) due.shift()(now); return drawings; };
    view.requestAnimationFrame(draw);
    const first = rest();
    view.cocalibWake();
    return [first, rest()];
}"""
