"""The page Deliver: what is shown is what is saved, and a keyboard is enough."""

import json
import re
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from calib_core.interchange.check.report import check
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import read_any, read_any_file
from calib_core.recordings import Recording
from tests.browser.driving import Driver
from tests.serving import OWN_PORT, serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]
DIALOG = "#page-deliver"
RECTIFIED = f"{DIALOG} .rectified:not(.returns):not(.despite) input"


@pytest.fixture(scope="module")
def solved_sample(sample: Recording, project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Serve the sample with its clicks, which no test of the panel changes; return the link."""
    folder = tmp_path_factory.mktemp("solved")
    with serving(sample, folder / "session", camera=sample.camera(), name="sample", port=OWN_PORT, token="test") as (
        running,
        workspace,
    ):
        workspace.import_clicks((project_root / "sample_data/rooftop/clicks.json").read_text(), "clicks.json")
        yield running.url


@pytest.fixture
def solved(open_page: Callable[..., Driver], solved_sample: str) -> Driver:
    page = open_page(solved_sample)
    page.until("__cocalib.state.view.clicks.length > 4 && __cocalib.state.view.has_calibration")
    page.settle()
    return page


def choose(page: Driver, name: str) -> None:
    """Choose a format and wait for its text; if it is for rectified images only, declare them rectified."""
    page.page.click(f'{DIALOG} [data-export="{name}"]')
    if name != "clicks" and format_named(name).is_for_rectified:
        page.page.check(RECTIFIED)
    suggested = next((form.file_name for form in FORMATS if form.name == name), "clicks.json")
    page.until(f"document.querySelector('{DIALOG} .name input').value.endsWith({suggested!r})")


def saved(page: Driver, folder: Path) -> Path:
    """Press Download and keep the file under the name that the browser was given."""
    with page.page.expect_download() as download:
        page.page.click(f"{DIALOG} .first")
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


def test_before_a_calibration_the_panel_says_what_is_missing_and_gives_the_clicks(page: Driver, tmp_path: Path) -> None:
    page.page.click("#tab-deliver")
    expect(page.page.locator(f"{DIALOG} .reason")).to_contain_text("four placements")
    expect(page.page.locator(f"{DIALOG} .first")).to_be_disabled()
    choose(page, "clicks")
    assert json.loads(saved(page, tmp_path).read_text())["schema"] == "cocalib/clicks-1"


def test_the_text_shown_is_the_file_that_is_saved_or_copied_and_it_is_the_calibration(
    solved: Driver, tmp_path: Path
) -> None:
    solved.page.click("#tab-deliver")
    choose(solved, "json")
    reference = read_any_file(saved(solved, tmp_path))
    for name in ("tf2", "kitti", "matlab", "colmap"):  # text, for rectified images, and binary files of each kind
        choose(solved, name)
        solved.until(f"document.querySelector('{DIALOG} .check.good')")
        path = saved(solved, tmp_path)
        assert path.name == f"sample_{format_named(name).file_name}"
        assert check(read_any_file(path), against=reference).ok, name
        shown = solved.value(f"document.querySelector('{DIALOG} .text').textContent")
        data = path.read_bytes()
        if data.startswith((b"PK", b"MATLAB")):
            assert "binary" in solved.text(f"{DIALOG} .what")
            assert "camera" in shown
        else:
            assert shown == data.decode()
    solved.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    choose(solved, "matrix")
    solved.page.click(f"{DIALOG} .second:has-text('Copy')")
    expect(solved.page.locator(f"{DIALOG} .second.done")).to_be_visible()
    assert read_any(solved.page.evaluate("() => navigator.clipboard.readText()")).format == "matrix"


@pytest.mark.slow
def test_the_direction_of_the_file_is_bold_and_the_table_holds_its_own_numbers(solved: Driver) -> None:
    page, shown = solved.page, {}
    page.click("#tab-deliver")
    for name, rightwards, equation in (
        ("tf2", False, "p_radar = R p_camera + t"),
        ("opencv", True, "p_camera = R p_radar + t"),
        ("urdf", False, "p_radar = R p_link + t"),
        ("driveworks", False, "p_radar = R p_link + t"),
    ):
        choose(solved, name)
        expect(page.locator(f"{DIALOG} .frames .equation").last).to_have_text(equation)
        expect(page.locator(f"{DIALOG} .direction")).to_contain_text(equation)
        bold, thin = (page.locator(f"{DIALOG} .frames g.{way} path").first for way in ("carry", "inverse"))
        widths = [arrow.evaluate("path => parseFloat(getComputedStyle(path).strokeWidth)") for arrow in (bold, thin)]
        assert widths[0] >= 3 * widths[1]
        assert bold.evaluate("path => getComputedStyle(path).strokeDasharray") == "none"
        start, end = map(float, re.findall(r"M(\S+) \S+H(\S+)", bold.get_attribute("d") or "")[0])
        assert (end > start) is rightwards
        rows = page.locator(f"{DIALOG} .pose-numbers").first.locator("tr")
        shown[name] = dict(row.split("\t", 1) for row in rows.all_inner_texts())
        if name in ("tf2", "urdf"):
            text = page.locator(f"{DIALOG} .text").inner_text()
            assert all(value.strip() in text for value in shown[name].values())
    assert list(shown["tf2"]) == ["x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw"]
    assert list(shown["urdf"])[3:] == ["roll [rad]", "pitch [rad]", "yaw [rad]"]
    assert list(shown["driveworks"])[3:] == ["roll [deg]", "pitch [deg]", "yaw [deg]"]
    assert list(shown["opencv"]) == ["R row 1", "R row 2", "R row 3", "t [m]"]
    expect(page.locator(f"{DIALOG} .ours td").first).to_be_hidden()
    page.click(f"{DIALOG} .ours summary")
    expect(page.locator(f"{DIALOG} .ours tr").last).to_contain_text("qz")


@pytest.mark.slow
def test_the_check_point_is_said_and_marked_on_the_image_and_the_evidence_is_there_before_saving(
    solved: Driver,
) -> None:
    page = solved.page
    page.click("#tab-deliver")
    page.click("#panel-large")
    choose(solved, "opencv")
    point = solved.value("fetch('api/preview/opencv').then((answer) => answer.json())")["check_point"]
    said = page.locator(f"{DIALOG} .check-point figcaption")
    expect(said).to_contain_text(f"must project to pixel ({point['u_px']:.2f}, {point['v_px']:.2f})")
    assert solved.value(
        "fetch(document.querySelector('#page-deliver .inset image').getAttribute('href'))"
        ".then((answer) => answer.blob()).then(createImageBitmap).then((made) => [made.width, made.height])"
    ) == [point["width_px"], point["height_px"]]
    ring = page.locator(f"{DIALOG} .inset .mark circle")
    assert float(ring.get_attribute("cx") or 0) == pytest.approx(point["u_px"] + 0.5)
    assert float(ring.get_attribute("cy") or 0) == pytest.approx(point["v_px"] + 0.5)
    inside, around = (page.locator(f"{DIALOG} {part}").bounding_box() for part in (".inset .mark circle", ".inset"))
    assert inside is not None
    assert around is not None
    assert around["x"] < inside["x"] < inside["x"] + inside["width"] < around["x"] + around["width"]
    expect(page.locator(f"{DIALOG} .evidence")).to_contain_text(re.compile(r"Rests on \d+ clicks"))
    expect(page.locator(f"{DIALOG} .evidence")).to_be_in_viewport()
    choose(solved, "tf2")
    expect(said).to_contain_text("This file holds no lens")


def test_a_format_is_found_by_typing_and_chosen_by_keyboard(solved: Driver) -> None:
    page = solved.page
    page.keyboard.press("e")
    expect(page.locator(f"{DIALOG} .find")).to_be_focused()
    names = f"[...document.querySelectorAll('{DIALOG} [data-export]')].map((item) => item.dataset.export)"
    everything = solved.value(names)
    for words, first, others in (
        ("nuscenes", "nuscenes", set()),
        ("pjl", "pjlab", set()),
        ("ros 2", "tf2", {"urdf", "autoware"}),
        ("ros2", "tf2", {"tf2-launch-py"}),
    ):
        page.locator(f"{DIALOG} .find").fill(words)
        found = solved.value(names)
        assert found[0] == first
        assert others <= set(found)
        assert len(found) < len(everything) / 2
    page.keyboard.press("Enter")
    expect(page.locator(f'{DIALOG} [data-export="tf2"]')).to_be_focused()
    expect(page.locator(f"{DIALOG} .text")).to_contain_text("static_transform_publisher")
    page.keyboard.press("e")
    page.keyboard.type("kalibr")
    page.keyboard.press("ArrowDown")
    expect(page.locator(f"{DIALOG} .find")).to_be_focused()
    expect(page.locator(f"{DIALOG} .text")).to_contain_text("T_cam_radar")
    page.keyboard.press("Control+a")
    page.keyboard.type("qqqq")
    expect(page.locator(f"{DIALOG} .formats [role=status]")).to_contain_text("No format fits")
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    assert solved.value(names) == everything


def test_frames_and_file_get_the_names_that_the_user_types_and_a_wrong_one_is_refused_at_its_field(
    solved: Driver, tmp_path: Path
) -> None:
    page = solved.page
    page.click("#tab-deliver")
    choose(solved, "tf2")
    radar, camera = (page.locator(f'{DIALOG} [data-field="{name}_frame"]') for name in ("radar", "camera"))
    text, error = page.locator(f"{DIALOG} .text"), page.locator(f"{DIALOG} .names .error")
    usual = radar.input_value()
    expect(text).to_contain_text(f"--frame-id {usual}")
    radar.fill("front_radar")
    camera.fill("front_camera_optical")
    expect(text).to_contain_text("--frame-id front_radar --child-frame-id front_camera_optical")
    expect(page.locator(f"{DIALOG} .direction")).to_contain_text("'front_camera_optical' (z forward) in 'front_radar'")
    assert b"--frame-id front_radar" in saved(solved, tmp_path).read_bytes()
    radar.fill("a$b")
    expect(error).to_contain_text("The radar frame is called")
    expect(page.locator(f"{DIALOG} .first")).to_be_disabled()
    expect(radar).to_be_focused()
    radar.fill("front_camera_optical")
    expect(error).to_contain_text("different names")
    radar.fill(usual)
    expect(error).to_be_hidden()
    expect(text).to_contain_text(f"--frame-id {usual} --child-frame-id front_camera_optical")
    page.fill(f"{DIALOG} .name input", "front.sh")
    assert saved(solved, tmp_path).name == "front.sh"


@pytest.mark.slow
def test_the_radar_can_be_posed_in_the_kit_and_a_wrong_pose_is_refused_with_a_reason(
    solved: Driver, tmp_path: Path
) -> None:
    solved.page.click("#tab-deliver")
    choose(solved, "autoware")
    before = read_any(saved(solved, tmp_path).read_bytes())
    solved.page.fill('[aria-label="x of the radar in the parent frame"]', "3.5")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("x: 3.5")
    tables = solved.page.locator(f"{DIALOG} .pose-numbers:visible")
    expect(tables.locator("caption")).to_have_text(
        [f"Pose of {name} in sensor_kit_base_link" for name in ("ti_mmwave_0", "camera_link")]
    )
    text = solved.text(f"{DIALOG} .text")
    for row in tables.locator("tr").all_inner_texts():
        assert row.split("\t", 1)[1].strip() in text
    after = read_any(saved(solved, tmp_path).read_bytes())
    np.testing.assert_allclose(
        after.camera_from_radar.as_matrix(), before.camera_from_radar.as_matrix(), rtol=0, atol=1e-12
    )
    solved.page.fill('[aria-label="qw of the radar in the parent frame"]', "0.5")
    expect(solved.page.locator(f"{DIALOG} .parent .error")).to_contain_text("length")
    expect(solved.page.locator(f"{DIALOG} .first")).to_be_disabled()
    solved.page.fill('[aria-label="qw of the radar in the parent frame"]', "1")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("x: 3.5")


@pytest.mark.slow
def test_a_format_that_cannot_store_distortion_comes_with_maps_until_images_are_declared_rectified_for_good(
    solved: Driver, tmp_path: Path
) -> None:
    page = solved.page
    page.click("#tab-deliver")
    choose(solved, "opencv")
    expect(page.locator(RECTIFIED)).to_be_hidden()
    for name in ("kitti", "nuscenes"):
        page.click(f'{DIALOG} [data-export="{name}"]')
        with_maps = f"{format_named(name).file_name.partition('.')[0]}_and_maps.zip"
        solved.until(f"document.querySelector('{DIALOG} .name input').value.endsWith('{with_maps}')")
        expect(page.locator(f"{DIALOG} .notes")).to_contain_text("the maps in rectification.npz")
        expect(page.locator(RECTIFIED)).not_to_be_checked()
        with zipfile.ZipFile(saved(solved, tmp_path)) as archive:
            assert archive.namelist() == [format_named(name).file_name, "rectification.npz"]

    page.locator(RECTIFIED).focus()
    page.keyboard.press("Space")
    expect(page.locator(f"{DIALOG} .notes")).to_contain_text("Written for rectified images")
    expect(page.locator(RECTIFIED)).to_be_focused()
    assert b"camera_intrinsic" in saved(solved, tmp_path).read_bytes()
    page.click(f'{DIALOG} [data-export="kitti"]')
    assert b"Tr_velo_to_cam" in saved(solved, tmp_path).read_bytes()
    choose(solved, "tf2")
    assert b"static_transform" in saved(solved, tmp_path).read_bytes()

    page.reload()
    solved.until("__cocalib.state.shown && __cocalib.state.view.has_calibration")
    page.click("#tab-deliver")
    expect(page.locator(f'{DIALOG} [data-export="tf2"]')).to_have_attribute("aria-selected", "true")
    expect(page.locator(f"{DIALOG} .text")).to_contain_text("static_transform")
    page.click(f'{DIALOG} [data-export="kitti"]')
    expect(page.locator(RECTIFIED)).to_be_checked()
    page.uncheck(RECTIFIED)
    expect(page.locator(f"{DIALOG} .notes")).to_contain_text("the maps in rectification.npz")


@pytest.mark.slow
def test_a_keyboard_is_enough(solved: Driver, tmp_path: Path) -> None:
    solved.page.keyboard.press("e")
    solved.page.keyboard.press("Tab")
    expect(solved.page.locator(f'{DIALOG} [data-export="json"]')).to_be_focused()
    frame = solved.value("__cocalib.state.cursor")
    solved.page.keyboard.press("ArrowDown")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("static_transform_publisher")
    assert solved.value("__cocalib.state.cursor") == frame
    for _ in range(20):
        solved.page.keyboard.press("Tab")
        if solved.page.locator(f"{DIALOG} .first").evaluate("button => button === document.activeElement"):
            break
    with solved.page.expect_download() as download:
        solved.page.keyboard.press("Enter")
    assert download.value.suggested_filename == "sample_static_transform.sh"


def test_which_returns_the_pose_is_for_is_chosen_and_the_file_follows(solved: Driver, tmp_path: Path) -> None:
    solved.page.click("#tab-deliver")
    for name, held, other in (("opencv", "raw", "corrected"), ("tf2", "corrected", "raw")):
        choose(solved, name)
        expect(solved.page.locator(f"{DIALOG} .returns [value={held}]")).to_be_checked()
        assert read_any_file(saved(solved, tmp_path)).for_raw is (held == "raw")
        before = solved.text(f"{DIALOG} .text")
        solved.page.check(f"{DIALOG} .returns [value={other}]")
        expect(solved.page.locator(f"{DIALOG} .text")).not_to_have_text(before)
        assert read_any_file(saved(solved, tmp_path)).for_raw is (other == "raw")
    choose(solved, "json")
    expect(solved.page.locator(f"{DIALOG} .returns")).to_be_hidden()


def test_rerun_gets_a_command_to_copy_and_a_file_that_it_opens(solved: Driver, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    solved.page.click("#tab-deliver")
    solved.page.click(f'{DIALOG} [data-export="rerun"]')
    solved.until(f"document.querySelector('{DIALOG} .name input').value === 'view.rrd'")
    assert "rerun" in solved.page.inner_text(f"{DIALOG} .text") or "cocalib show" in solved.page.inner_text(
        f"{DIALOG} .text"
    )
    assert solved.page.is_enabled(f"{DIALOG} .second:has-text('Copy')")
    assert saved(solved, tmp_path).read_bytes()[:3] == b"RRF"


@pytest.mark.slow
def test_enlarged_the_page_has_the_whole_work_area(solved: Driver) -> None:
    solved.page.click("#tab-deliver")
    choose(solved, "tf2")
    solved.page.click("#panel-large")
    box = solved.page.locator(DIALOG).bounding_box()
    assert box is not None
    assert box["width"] > 0.99 * solved.value("innerWidth")
    expect(solved.page.locator(f"{DIALOG} .frames")).to_be_in_viewport()


@pytest.mark.slow
def test_the_warnings_that_the_panel_counts_are_shown_next_to_the_text(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 12)
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.click('[data-method="paper"]')
    page.until("__cocalib.state.view.method === 'paper'")
    page.settle()
    page.page.click("#sheet-close")
    page.page.click("#tab-deliver")
    page.until(f"document.querySelector('{DIALOG} .frames')")
    expect(page.page.locator(f"{DIALOG} .with-warnings li")).to_have_count(len(page.view["warnings"]))
    assert f"has {page.text('#warning-count')}" in page.text(f"{DIALOG} .with-warnings summary")
    expect(page.page.locator(f"{DIALOG} .evidence")).to_contain_text(page.said(page.view["verdict"]["line"]))
    for row in page.view["warnings"]:
        expect(page.page.locator(f"{DIALOG} .with-warnings")).to_contain_text(page.said(row["message"]))


@pytest.mark.slow
def test_a_contradictory_calibration_is_saved_only_after_a_tick(page: Driver, truth: Any, tmp_path: Path) -> None:
    halved = [{**one, "pixel_px": [0.5 * value for value in one["pixel_px"]]} for one in truth["placements"]]
    page.load_sample({**truth, "placements": halved})
    assert page.view["verdict"]["level"] == "contradictory"
    page.page.click("#tab-deliver")
    choose(page, "tf2")
    expect(page.page.locator(f"{DIALOG} .first")).to_be_disabled()
    page.page.check(f"{DIALOG} .despite input")
    expect(page.page.locator(f"{DIALOG} .first")).to_be_enabled()
    assert "verdict: contradictory" in saved(page, tmp_path).read_text()


@pytest.mark.slow
def test_the_panel_fits_the_screen(solved: Driver) -> None:
    for width, height in ((1280, 720), (390, 844)):
        solved.page.set_viewport_size({"width": width, "height": height})
        solved.page.click("#tab-deliver")
        choose(solved, "tf2")
        radar = solved.page.locator(f'{DIALOG} [data-field="radar_frame"]')
        usual = radar.input_value()
        radar.fill("a$b")
        expect(solved.page.locator(f"{DIALOG} .reason")).to_contain_text("until the field above is corrected")
        assert solved.value(
            f"document.querySelector('{DIALOG} .text').scrollHeight <= document.querySelector('{DIALOG} .text').clientHeight"
        )
        radar.fill(usual)
        expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text(f"--frame-id {usual}")
        for name in ("autoware", "matlab", "nuscenes"):
            choose(solved, name)
            nothing_spills(solved)
        expect(solved.page.locator(f"{DIALOG} .first")).to_be_in_viewport()


def nothing_spills(page: Driver) -> None:
    """Check that no part of the panel leaves the screen, and that the table of numbers stays in its column."""
    page.until(f"document.querySelector('{DIALOG} .frames')")
    page.drawn()
    parts = ", ".join(f"{DIALOG} {part}" for part in ("", ".foot *", ".side :not(image)", ".names *", ".rectified *"))
    spilled = page.value(
        f"[...document.querySelectorAll('{parts}')].filter((part) => {{ const box = part.getBoundingClientRect(); "
        "return box.width && (box.right > innerWidth || box.left < 0); }).length"
    )
    assert spilled == 0
    panel = page.page.locator(f"{DIALOG} .side").bounding_box()
    table = page.page.locator(f"{DIALOG} .pose-numbers").first.bounding_box()
    assert panel is not None
    assert table is not None
    assert table["x"] + table["width"] <= panel["x"] + panel["width"]
