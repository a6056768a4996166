"""Someone else's calibration on the page: shown, checked by clicks, compared with the new one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.recordings import Recording
from cocalib.opening.opened import GivenCalibration
from tests.browser.driving import Driver
from tests.serving import serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def test_a_calibration_is_shown_checked_and_compared(
    open_page: Callable[..., Driver], sample: Recording, truth: Any, tmp_path: Path
) -> None:
    true, file = truth["camera_from_radar"], tmp_path / "factory.txt"
    rows = np.hstack([true["rotation"], np.reshape(true["translation_m"], (3, 1))])
    file.write_text("\n".join(" ".join(repr(float(value)) for value in row) for row in rows))
    camera = sample.camera()
    reference = GivenCalibration.read(file).shown(camera).reference
    with serving(sample, tmp_path / "session", camera=camera, name="sample", reference=reference, token="test") as (
        running,
        _,
    ):
        page = open_page(running.url)
        assert "from factory.txt; " in page.text("#status-text")
        page.until("__cocalib.state.overlay.returns.length > 0")
        page.page.click("#tab-check")
        assert "From factory.txt" in page.text("#page-pose")
        page.load_sample(truth, 1)
        (first,) = page.view["clicks"]
        assert first["residual_px"] < 30
        assert "residual of 1 click" in page.view["status"]
        page.load_sample(truth)
        figures = {figure["key"]: figure for figure in page.view["comparison"]}
        assert float(figures["rotation_apart"]["value"].split()[0]) < 1.0
        assert "Difference from factory.txt" in page.text("#page-pose")
        assert "at 20 m" in page.text("#page-pose .apart")
