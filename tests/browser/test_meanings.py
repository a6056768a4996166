"""A calibration whose numbers do not say what they mean: each meaning is drawn over a frame, and a person picks one."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.geometry import RigidTransform
from calib_core.interchange.rotations import LINK_FROM_OPTICAL
from tests.browser.accessibility import violations
from tests.browser.driving import Driver
from tests.served_process import ServedProcess, served_process

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

DIALOG = "document.querySelector('#meanings-dialog[open]')"
RIGHT = "radar_from_camera,body,m"


@pytest.fixture
def extrinsic(truth: Any, tmp_path: Path) -> Path:
    """A 4x4 matrix without a word: the pose of the camera in the radar, both with body axes."""
    pose = truth["camera_from_radar"]
    camera_from_radar = RigidTransform(np.array(pose["rotation"]), np.array(pose["translation_m"]))
    body = (LINK_FROM_OPTICAL @ camera_from_radar).inverse()
    file = tmp_path / "extrinsic.json"
    file.write_text(json.dumps({"pose": body.as_matrix().tolist()}))
    return file


@pytest.fixture
def server(project_root: Path, extrinsic: Path, tmp_path: Path) -> Iterator[ServedProcess]:
    sample, flags = (
        project_root / "sample_data" / "rooftop",
        ("--token", "meanings-1", "--session", tmp_path / "session"),
    )
    bags = (sample / "radar.bag", sample / "camera.bag")
    with served_process(*bags, "--calibration", extrinsic, *flags, state=tmp_path) as running:
        yield running


@pytest.mark.slow
def test_the_meaning_that_is_picked_is_shown_as_the_calibration_named_as_such_and_can_be_changed(
    server: ServedProcess, open_page: Callable[..., Driver]
) -> None:
    page = open_page(server.url)
    page.until(DIALOG)
    assert page.text("#meanings-title") == "What does extrinsic.json mean?"
    page.until(
        "[...document.querySelectorAll('#meanings-dialog img')].every((one) => one.complete && one.naturalWidth === 480)"
    )
    meanings = page.value(
        "[...document.querySelectorAll('#meanings-dialog .meaning')].map((one) => one.dataset.meaning)"
    )
    assert {RIGHT, "camera_from_radar,body,m"} <= set(meanings[:2])
    assert not page.view["reference"]
    assert violations(page) == []
    page.page.keyboard.press("Escape")
    page.until(f"!{DIALOG}")
    for picked in ("camera_from_radar,body,m", RIGHT):
        if not page.page.is_visible("#warnings"):
            page.page.click("#warning-count")
        row = page.page.locator("#warnings [data-code^='calibration-']")
        if not row.evaluate("row => row.open"):
            row.locator("summary").click()
        row.locator(".pick").click()
        page.until(DIALOG)
        with page.page.expect_navigation():
            page.page.click(f"#meanings-dialog [data-meaning='{picked}']")
        page.until(
            "__cocalib.state.shown && __cocalib.state.view && __cocalib.state.view.reference === 'extrinsic.json'"
        )
        assert not page.value(f"Boolean({DIALOG})")
        warnings = page.value("__cocalib.state.recording.warnings")
        assert [row["code"] for row in warnings] == ["calibration-picked"]
        shown = page.value(
            "fetch('api/meanings.json').then((answer) => answer.json()).then((said) => "
            "said.rows.filter((row) => row.is_shown).map((row) => row.meaning))"
        )
        assert shown == [picked]
    page.forget_lost_connections()
