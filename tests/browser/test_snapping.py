"""S puts a mark on the reflector's apex, or says why not."""

from typing import Any

import numpy as np
import pytest

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def test_a_mark_snaps_to_the_apex_beside_it_or_stays_where_no_corner_is(page: Driver, truth: Any) -> None:
    placement = truth["placements"][1]
    u, v = placement["pixel_px"]
    page.go_to(page.frame_at(placement["best_image_time"]))
    page.click(u + 5.0, v - 3.3)
    page.press("s")
    page.until("__cocalib.state.view.clicks[0].mark === 'snapped'")
    page.settle()
    [click] = page.view["clicks"]
    assert np.hypot(click["u_px"] - u, click["v_px"] - v) < 0.8
    assert 0.05 < click["sigma_px"] < 0.8
    assert click["state"] != "untouched"
    page.press("Control+z")
    page.until("__cocalib.state.view.clicks[0].mark === 'clicked'")

    page.click(u - 150.0, v + 60.0)
    before = page.view["clicks"]
    page.press("s")
    page.until("document.querySelector('#toasts .toast')")
    assert "No corner found" in page.text("#toasts")
    page.settle()
    assert page.view["clicks"] == before
