"""The export panel: what is shown is what is saved, and a keyboard is enough."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from app.workspace import Workspace
from calib_core.interchange import FORMATS, check, format_named, read_any, read_any_file
from tests.browser.driving import Driver

pytestmark = pytest.mark.browser
DIALOG = "#export-dialog"
RECTIFIED = f"{DIALOG} .rectified input"


@pytest.fixture
def solved(page: Driver, workspace: Workspace, project_root: Path) -> Driver:
    workspace.import_clicks((project_root / "sample_data/rooftop/clicks.json").read_text(), "clicks.json")
    page.until("__cocalib.state.view.clicks.length > 4 && __cocalib.state.view.has_calibration")
    page.settle()
    return page


def choose(page: Driver, name: str) -> None:
    """Choose a format and wait for its text; if it is for rectified pictures only, declare them rectified."""
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
    page.page.click("#export")
    expect(page.page.locator(f"{DIALOG} .reason")).to_contain_text("four placements")
    expect(page.page.locator(f"{DIALOG} .first")).to_be_disabled()
    choose(page, "clicks")
    assert json.loads(saved(page, tmp_path).read_text())["schema"] == "cocalib/clicks-1"


def test_the_text_shown_is_the_file_that_is_saved_and_it_is_the_calibration(solved: Driver, tmp_path: Path) -> None:
    solved.page.click("#export")
    choose(solved, "json")
    reference = read_any_file(saved(solved, tmp_path))
    for form in FORMATS:
        choose(solved, form.name)
        solved.until(f"document.querySelector('{DIALOG} .check.good')")
        path = saved(solved, tmp_path)
        assert path.name == f"sample_{form.file_name}"
        assert check(read_any_file(path), against=reference).ok, form.name
        shown = solved.value(f"document.querySelector('{DIALOG} .text').textContent")
        data = path.read_bytes()
        if data.startswith((b"PK", b"MATLAB", b"\x89MCAP")):
            assert "binary" in solved.text(f"{DIALOG} .what")
            assert "camera" in shown
        else:
            assert shown == data.decode()


def test_the_drawing_says_which_way_the_numbers_of_the_file_go(solved: Driver) -> None:
    solved.page.click("#export")
    for name, stated in (("tf2", 1), ("kitti", 0), ("urdf", 1), ("opencv", 0)):
        choose(solved, name)
        expect(solved.page.locator(f"{DIALOG} .frames .equation").last).to_have_text("p_camera = R p_radar + t")
        expect(solved.page.locator(f"{DIALOG} .frames g.stated")).to_have_count(stated)
        said = solved.page.locator(f"{DIALOG} .frames text.stated")
        expect(said).to_contain_text({"urdf": "its body frame", "tf2": "the camera"}.get(name, "the same R and t"))
    assert "quaternion_wxyz" in solved.text(f"{DIALOG} .pose-numbers")


def test_a_name_given_by_hand_is_the_name_of_the_file(solved: Driver, tmp_path: Path) -> None:
    solved.page.click("#export")
    choose(solved, "urdf")
    solved.page.fill(f"{DIALOG} .name input", "front.urdf")
    assert saved(solved, tmp_path).name == "front.urdf"


def test_the_choice_is_remembered(solved: Driver) -> None:
    solved.page.click("#export")
    choose(solved, "kalibr")
    solved.page.reload()
    solved.until("__cocalib.state.shown && __cocalib.state.view.has_calibration")
    solved.page.click("#export")
    expect(solved.page.locator(f'{DIALOG} [data-export="kalibr"]')).to_have_attribute("aria-selected", "true")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("T_cam_radar")


def test_the_radar_can_be_posed_in_the_kit_and_a_wrong_pose_is_refused_with_a_reason(
    solved: Driver, tmp_path: Path
) -> None:
    solved.page.click("#export")
    choose(solved, "autoware")
    before = read_any(saved(solved, tmp_path).read_bytes())
    solved.page.fill('[aria-label="x of the radar in the parent frame"]', "3.5")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("x: 3.5")
    after = read_any(saved(solved, tmp_path).read_bytes())
    np.testing.assert_allclose(
        after.camera_from_radar.as_matrix(), before.camera_from_radar.as_matrix(), rtol=0, atol=1e-12
    )
    solved.page.fill('[aria-label="qw of the radar in the parent frame"]', "0.5")
    expect(solved.page.locator(f"{DIALOG} .reason")).to_contain_text("length")
    solved.page.fill('[aria-label="qw of the radar in the parent frame"]', "1")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("x: 3.5")


def test_a_format_that_cannot_store_distortion_comes_with_maps_until_the_pictures_are_declared_rectified(
    solved: Driver, tmp_path: Path
) -> None:
    page = solved.page
    page.click("#export")
    choose(solved, "opencv")
    expect(page.locator(RECTIFIED)).to_be_hidden()
    for name in ("kitti", "nuscenes"):
        page.click(f'{DIALOG} [data-export="{name}"]')
        expect(page.locator(f"{DIALOG} .notes")).to_contain_text("the maps in rectification.npz")
        solved.until(f"document.querySelector('{DIALOG} .name input').value.endsWith('_and_maps.zip')")
        expect(page.locator(RECTIFIED)).not_to_be_checked()
        with zipfile.ZipFile(saved(solved, tmp_path)) as archive:
            assert archive.namelist() == [format_named(name).file_name, "rectification.npz"]

    for _ in range(4):
        page.keyboard.press("Tab")
        if page.locator(RECTIFIED).evaluate("box => box === document.activeElement"):
            break
    page.keyboard.press("Space")
    expect(page.locator(f"{DIALOG} .notes")).to_contain_text("Written for rectified pictures")
    expect(page.locator(RECTIFIED)).to_be_focused()
    assert b"camera_intrinsic" in saved(solved, tmp_path).read_bytes()
    page.click(f'{DIALOG} [data-export="kitti"]')
    assert b"Tr_velo_to_cam" in saved(solved, tmp_path).read_bytes()
    choose(solved, "tf2")
    assert b"static_transform" in saved(solved, tmp_path).read_bytes()

    page.reload()
    solved.until("__cocalib.state.shown && __cocalib.state.view.has_calibration")
    page.click("#export")
    page.click(f'{DIALOG} [data-export="kitti"]')
    expect(page.locator(RECTIFIED)).to_be_checked()
    page.uncheck(RECTIFIED)
    expect(page.locator(f"{DIALOG} .notes")).to_contain_text("the maps in rectification.npz")


def test_a_keyboard_is_enough_and_stays_in_the_panel(solved: Driver) -> None:
    solved.page.keyboard.press("e")
    expect(solved.page.locator(f'{DIALOG} [data-export="json"]')).to_be_focused()
    solved.page.keyboard.press("ArrowDown")
    expect(solved.page.locator(f"{DIALOG} .text")).to_contain_text("static_transform_publisher")
    frame = solved.value("__cocalib.state.cursor")
    for _ in range(12):
        solved.page.keyboard.press("Tab")
        assert solved.value(f"document.querySelector('{DIALOG}').contains(document.activeElement)")
    solved.page.keyboard.press("Shift+Tab")
    assert solved.value(f"document.querySelector('{DIALOG}').contains(document.activeElement)")
    solved.page.keyboard.press("x")
    assert solved.value("__cocalib.state.cursor") == frame
    assert all(click["state"] != "excluded" for click in solved.view["clicks"])
    solved.page.keyboard.press("Escape")
    assert not solved.page.is_visible(DIALOG)


def test_copy_puts_the_text_on_the_clipboard(solved: Driver) -> None:
    solved.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    solved.page.click("#export")
    choose(solved, "matrix")
    solved.page.click(f"{DIALOG} .second:has-text('Copy')")
    expect(solved.page.locator(f"{DIALOG} .second.done")).to_be_visible()
    copied = solved.page.evaluate("() => navigator.clipboard.readText()")
    assert read_any(copied).format == "matrix"


def test_warnings_of_the_calibration_are_shown_next_to_the_text(page: Driver, truth: Any) -> None:
    page.click_sample(truth, 4)
    warnings = page.view["warnings"]
    page.page.click("#export")
    page.until(f"document.querySelector('{DIALOG} .frames')")
    assert warnings
    for row in warnings:
        expect(page.page.locator(f"{DIALOG} .with-warnings")).to_contain_text(row["message"])


@pytest.mark.parametrize("size", [(1280, 720), (1440, 900)])
def test_the_panel_fits_the_screen(solved: Driver, size: tuple[int, int]) -> None:
    solved.page.set_viewport_size({"width": size[0], "height": size[1]})
    solved.page.click("#export")
    solved.page.click(f'{DIALOG} [data-export="nuscenes"]')
    expect(solved.page.locator(f"{DIALOG} .reason")).to_be_visible()
    assert solved.value(
        f"document.querySelector('{DIALOG} .text').scrollHeight <= document.querySelector('{DIALOG} .text').clientHeight"
    )
    for name in ("autoware", "numpy", "nuscenes", "kitti"):
        choose(solved, name)
        solved.until(f"document.querySelector('{DIALOG} .frames')")
        solved.drawn()
        parts = ", ".join(f"{DIALOG} {part}" for part in ("", "footer *", "aside *", ".rectified *"))
        spilled = solved.value(
            f"[...document.querySelectorAll('{parts}')].filter((part) => {{ const box = part.getBoundingClientRect(); "
            "return box.width && (box.right > innerWidth || box.left < 0); }).length"
        )
        assert spilled == 0
        panel = solved.page.locator(f"{DIALOG} aside").bounding_box()
        table = solved.page.locator(f"{DIALOG} .pose-numbers").bounding_box()
        assert panel is not None
        assert table is not None
        assert table["x"] + table["width"] <= panel["x"] + panel["width"]
