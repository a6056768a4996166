"""A user calibrates the sample in a real browser."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

NUDGES = """["ArrowRight", "ArrowRight", "ArrowUp"].forEach((key) =>
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key, altKey: true, bubbles: true })))"""
"""Three keys at once: on a busy machine a moment of rest between real ones would make them two movements."""


def test_clicking_every_placement_gives_a_calibration_near_the_truth(page: Driver, truth: Any, tmp_path: Path) -> None:
    page.until("__cocalib.state.placements.length >= 15")
    page.click_sample(truth, 3)
    assert page.said(page.view["verdict"]["line"]) == "3 of 8 pairs"
    assert not page.view["has_calibration"]
    page.click_sample(truth)
    view = page.view
    assert len(view["clicks"]) == len(truth["placements"])
    aed = next(row["value"] for row in view["metrics"] if row["key"] == "aed")
    assert page.text("#verdict .aed") == f"AED {aed} px"
    page.until("__cocalib.state.overlay.returns !== null && __cocalib.state.overlay.guesses.length > 0")
    page.page.click("#tab-deliver")
    with page.page.expect_download() as download:
        page.page.click("#page-deliver .first")
    saved = tmp_path / "calibration.json"
    download.value.save_as(saved)
    calibration, true = json.loads(saved.read_text()), truth["camera_from_radar"]
    rotation = np.array(calibration["camera_from_radar"]["rotation"]) @ np.array(true["rotation"]).T
    angle_deg = np.rad2deg(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
    offset_m = np.subtract(calibration["camera_from_radar"]["translation_m"], true["translation_m"])
    sigma_m = np.array([calibration["sigma"][f"{axis}_m"] for axis in "xyz"])
    assert angle_deg < 1.0
    assert np.all(np.abs(offset_m) < 4 * sigma_m)
    assert np.all(sigma_m < 0.5)


def test_undo_and_redo_go_through_everything(page: Driver, truth: Any) -> None:
    page.click_sample(truth, 5)
    solved = page.view
    assert solved["has_calibration"]
    page.press("x")
    assert page.view["clicks"][4]["state"] == "excluded"
    page.press("Control+z")
    assert page.view["clicks"][4]["state"] == solved["clicks"][4]["state"]
    page.press("Control+z")
    assert len(page.view["clicks"]) == 4
    page.press("Control+Shift+z")
    assert page.view["clicks"] == solved["clicks"]
    page.page.click("#undo")
    page.settle()
    assert len(page.view["clicks"]) == 4
    page.page.click("#redo")
    page.settle()
    assert page.view["clicks"] == solved["clicks"]


def test_excluding_a_pair_solves_again_and_greys_its_row(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 7)
    before = page.view
    page.press("j")
    worst = max(before["clicks"], key=lambda row: row["residual_px"] or 0)
    assert page.value("__cocalib.state.selected") == worst["id"]
    page.press("x")
    after = page.view
    assert after["metrics"] != before["metrics"]
    assert page.page.get_attribute(f'.pairs [data-id="{worst["id"]}"]', "class") == "row excluded"
    page.page.click(f'.pairs [data-id="{worst["id"]}"] [data-act]')
    page.settle()
    assert page.view["metrics"] == before["metrics"]


def test_a_mark_can_be_dragged_nudged_and_removed(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 1)
    [placed] = page.view["clicks"]
    u, v = placed["u_px"], placed["v_px"]
    page.zoom_to(u, v, 4)
    page.drag((u, v), (u - 6, v - 3))
    [dragged] = page.view["clicks"]
    assert (dragged["u_px"], dragged["v_px"]) == pytest.approx((u - 6, v - 3), abs=0.1)
    page.value(NUDGES)
    page.settle()
    assert page.view["revision"] == 3
    [nudged] = page.view["clicks"]
    assert (nudged["u_px"], nudged["v_px"]) == pytest.approx((dragged["u_px"] + 0.2, dragged["v_px"] - 0.1), abs=1e-6)
    page.press("Alt+ArrowLeft")
    assert page.view["clicks"][0]["u_px"] == pytest.approx(nudged["u_px"] - 0.1, abs=1e-6)
    page.press("Control+z")
    assert page.view["clicks"] == [nudged]
    page.press("Control+z")
    assert page.view["clicks"][0]["u_px"] == pytest.approx(dragged["u_px"], abs=1e-9), "one step back for one movement"
    page.drag((dragged["u_px"], dragged["v_px"]), (dragged["u_px"] + 0.7, dragged["v_px"]))
    assert page.view["clicks"][0]["u_px"] == pytest.approx(dragged["u_px"], abs=1e-9), "a drag under 4 px does nothing"
    page.press("Delete")
    assert page.view["clicks"] == []


@pytest.mark.slow
def test_dragging_away_from_a_mark_pans_and_places_nothing(page: Driver) -> None:
    page.zoom_to(400, 300, 3)
    before = page.place_of(400, 300)
    page.drag((400, 300), (430, 310))
    after = page.place_of(400, 300)
    assert (after[0] - before[0], after[1] - before[1]) == pytest.approx((90, 30), abs=1.5)
    assert page.view["clicks"] == []
    page.press("f")
    assert page.value("__cocalib.viewport.fitted")


def test_keys_walk_frames_placements_and_overlays(page: Driver) -> None:
    page.until("__cocalib.state.placements.length > 2")
    frames = page.value("__cocalib.state.placements.map((placement) => placement.frame)")
    page.go_to(0)
    for key, expected in (("ArrowRight", 1), ("Shift+ArrowRight", 11), ("ArrowLeft", 10), ("Home", 0), ("n", frames[0]),
                          ("n", frames[1]), ("p", frames[0]), ("p", frames[-1])):  # fmt: skip
        page.press(key)
        page.until(f"__cocalib.state.shown.index === {expected}")
    assert page.page.get_attribute('[data-layer="returns"]', "aria-pressed") == "true"
    page.press("1")
    assert page.page.get_attribute('[data-layer="returns"]', "aria-pressed") == "false"
    page.press("?")
    assert page.page.is_visible("#help-dialog")
    page.press("?")
    assert not page.page.is_visible("#help-dialog")


def test_the_method_and_its_options_can_be_changed_and_reset(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 8)
    robust = page.view["metrics"]
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.click('[data-method="paper"]')
    page.settle()
    assert page.view["method"] == "paper"
    assert page.view["metrics"] != robust
    page.page.click('[data-method="default"]')
    page.settle()
    assert page.view["metrics"] == robust
    page.page.fill('[data-path="noise.sigma_px"] input', "5000")
    page.page.press('[data-path="noise.sigma_px"] input', "Enter")
    page.until("document.querySelector('.toast')")
    toast = page.text(".toast")
    assert [part for part in ("noise.sigma_px", "5000 is out", "Click uncertainty") if part not in toast] == []
    page.until("document.querySelector('[data-path=\"noise.sigma_px\"] input').value === '2'")
    page.page.get_by_label("Click uncertainty").fill("3")
    page.page.keyboard.press("Enter")
    page.until("document.querySelector('.toast') === null")


def test_a_camera_position_is_used_only_once_it_is_entered(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 6)
    without = page.view
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.click("#option-solving-camera_position")
    dialog = page.page.locator("dialog.position")
    rotation, translation = (np.array(truth["camera_from_radar"][key]) for key in ("rotation", "translation_m"))
    fields = dialog.locator("input")
    expect(fields.first).to_be_focused()
    for index, value in enumerate(-rotation.T @ translation):
        fields.nth(index).fill(f"{value:.3f}")
    page.page.keyboard.press("Enter")
    page.until("__cocalib.state.view.options.solving.camera_position !== null")
    page.settle()
    assert page.view["options"]["solving"]["camera_position"]["sigma_m"] == 0.03
    page.page.click("#option-solving-camera_position")
    dialog.locator("select").select_option("from the antennas to the lens")
    page.page.click("dialog.position .first")
    page.until("__cocalib.state.view.options.solving.camera_position.sigma_m === 0.02")
    page.settle()
    assert page.view["pose"] != without["pose"]
    page.page.click('[data-path="solving.camera_position"] button:has-text("Remove")')
    page.until("__cocalib.state.view.options.solving.camera_position === null")
    page.settle()
    assert page.view["pose"] == without["pose"]
