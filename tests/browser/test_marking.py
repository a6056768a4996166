"""Marks: several in a frame, guesses that do not count, the keyboard's cross, and the choice between returns."""

from typing import Any

import numpy as np
import pytest

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

_BY_KEYS = 9
"""So many placements are marked without a mouse: five of them where the page expects the reflector."""


def place(page: Driver, placement: Any) -> None:
    page.go_to(page.frame_at(placement["best_image_time"]))
    page.click(*placement["pixel_px"])


def answer(page: Driver) -> Any:
    """Everything that the page says about the answer."""
    view = page.view
    keys = ("metrics", "pose", "warnings", "status", "systematic_errors", "advice")
    return {key: view[key] for key in keys} | ({"verdict": view["verdict"]} if "verdict" in view else {})


@pytest.mark.slow
def test_guesses_leave_the_answer_as_the_clicks_gave_it(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(truth, 4)
    before = answer(page)
    assert page.view["has_calibration"]
    guesses = 0
    for _ in range(8):
        page.press("n")
        page.until(
            "__cocalib.state.shown.index === __cocalib.state.cursor && __cocalib.state.overlay.index === __cocalib.state.cursor"
        )
        if page.value("__cocalib.clicksIn(__cocalib.state.cursor).length"):
            break
        if not page.value("__cocalib.state.cross"):
            page.press("g")
        page.press("Enter")
        guesses += page.value("__cocalib.clicksIn(__cocalib.state.cursor).length")
    rows = page.view["clicks"]
    assert [row["state"] for row in rows].count("untouched") == guesses >= 5
    assert answer(page) == before
    assert "guess" in page.text(".pairs tr.untouched")
    first = next(row for row in rows if row["state"] == "untouched")
    page.go_to(first["frame"])
    page.press("Alt+ArrowRight")
    moved = next(row for row in page.view["clicks"] if row["id"] == first["id"])
    assert moved["mark"] == "moved"
    assert moved["state"] != "untouched"


@pytest.mark.slow
def test_a_frame_takes_several_marks_and_each_is_dragged_on_its_own(page: Driver, truth: Any) -> None:
    placement = truth["placements"][0]
    u, v = placement["pixel_px"]
    place(page, placement)
    page.click(u - 150, v + 60)
    assert len(page.view["clicks"]) == 2
    assert page.value("__cocalib.state.selected") == "c2"
    page.drag((u, v), (u + 12, v))
    first, second = page.view["clicks"]
    assert (first["u_px"], second["u_px"]) == pytest.approx((u + 12, u - 150), abs=1.0)
    page.press("Control+z", "Control+z")
    assert [row["id"] for row in page.view["clicks"]] == ["c1"]


def test_the_return_of_a_click_can_be_chosen_and_taken_back(page: Driver, truth: Any) -> None:
    place(page, truth["placements"][0])
    page.until("__cocalib.state.candidates && __cocalib.state.candidates.rows.length > 1")
    assert page.view["clicks"][0]["range_m"] == pytest.approx(
        np.linalg.norm(truth["placements"][0]["position_radar_m"]), abs=0.3
    )
    second = page.value("__cocalib.state.candidates.rows[1]")
    page.page.click('[data-choice="1"]')
    page.settle()
    page.until("__cocalib.state.candidates.rows.some((row) => row.chosen)")
    [row] = page.view["clicks"]
    assert row["chosen"]
    assert row["range_m"] == pytest.approx(second["range_m"], abs=0.01)
    page.press("Control+z")
    assert not page.view["clicks"][0]["chosen"]
    for placement in truth["placements"][1:6]:
        place(page, placement)
    page.until("__cocalib.state.candidates && __cocalib.state.candidates.rows.some((row) => row.used)")
    revision = page.view["revision"]
    rows = page.value("__cocalib.state.candidates.rows.length")
    page.press("c")
    assert page.page.get_attribute("#guide", "data-rule") == "return"
    assert page.view["revision"] == revision, "C shows another return, and decides nothing"
    page.press(*["c"] * (rows - 1))
    page.press("Enter")
    page.until("__cocalib.state.candidates.rows.some((row) => row.chosen)")
    assert page.value("__cocalib.state.candidates.rows.find((row) => row.chosen).used"), (
        "after all of them, the one in use"
    )
    assert page.page.get_attribute("#guide", "data-rule") != "return"
    assert page.view["clicks"][-1]["state"] == "inlier"


def test_a_dismissed_placement_is_not_offered_until_it_is_undone(page: Driver) -> None:
    page.until("__cocalib.state.placements.length >= 15")
    page.press("n")
    first = page.value("__cocalib.state.cursor")
    page.press("x")
    page.until("__cocalib.state.view.dismissed.length === 1")
    assert "Dismissed" in page.text("#guide")
    for _ in range(page.value("__cocalib.state.placements.length")):
        page.press("n")
        assert page.value("__cocalib.state.cursor") != first
    page.press("Control+z")
    page.until("__cocalib.state.view.dismissed.length === 0")


@pytest.mark.slow
def test_a_placement_takes_at_most_eight_keys(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placements.length >= 15")
    near = {page.frame_at(placement["best_image_time"]): placement for placement in truth["placements"]}
    keys = 1
    page.page.keyboard.press("g")
    errors = []
    for number in range(_BY_KEYS):
        page.press("n")
        page.until("__cocalib.state.shown.index === __cocalib.state.cursor && __cocalib.state.cross")
        if number >= 4:
            page.until("__cocalib.state.cross.expected")
        keys += 2
        index = page.value("__cocalib.state.cursor")
        wanted = near[min(near, key=lambda frame: abs(frame - index))]["pixel_px"]
        while True:
            field = page.value("__cocalib.state.cross.fields.at(-1)")
            if field["wide"] <= 1.0:
                break
            column, row = (
                int(np.clip(np.floor((wanted[axis] - field["uv"[axis]]) / field[size] * 3 + 1.5), 0, 2))
                for axis, size in ((0, "wide"), (1, "high"))
            )
            page.page.keyboard.press(str(1 + 3 * row + column))
            keys += 1
        page.press("Enter")
        mark = page.value("__cocalib.clicksIn(__cocalib.state.cursor)[0]")
        errors.append(np.hypot(mark["u_px"] - wanted[0], mark["v_px"] - wanted[1]))
    assert keys <= 8 * _BY_KEYS, keys
    assert np.median(errors) < 0.6
    assert page.view["has_calibration"]
