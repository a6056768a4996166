"""The page guides the user: after a click, after a wrong one, after a jump while zoomed in, and without a mouse."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def test_a_wrong_click_is_named_and_found_by_j(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(truth, 9)
    wrong = truth["placements"][9]
    page.go_to(page.frame_at(wrong["best_image_time"]))
    u, v = wrong["pixel_px"]
    page.click(u + (200 if u < 480 else -200), v)
    page.press("n")
    page.until("__cocalib.state.view.clicks.filter((click) => click.state === 'outlier').length === 1")
    page.go_to(0)
    assert rule(page) == "misfits"
    assert "#10 " in page.text("#guide")
    page.press("j")
    page.until(f"__cocalib.state.shown.index === {page.frame_at(wrong['best_image_time'])}")
    assert rule(page) == "misfit"
    page.press("x")
    page.go_to(0)
    assert rule(page) == "next", "what is excluded is named no more"


@pytest.mark.slow
def test_a_click_beside_what_the_images_show_is_named_and_shown(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(truth, 5)
    page.until("__cocalib.state.proposals")
    third = page.view["clicks"][2]
    page.value("void (__cocalib.state.proposals.slips = [__cocalib.state.view.clicks[2].id])")
    page.go_to(0)
    assert rule(page) in {"slips", "slip"}
    assert "#3 " in page.text("#guide")
    page.go_to(third["frame"])
    assert rule(page) == "slip"
    page.press("x")
    page.go_to(0)
    assert rule(page) not in {"slips", "slip"}


def rule(page: Driver) -> str:
    """Return the name of the rule by which the line on the frame says what it says."""
    return str(page.page.get_attribute("#guide", "data-rule"))


@pytest.mark.slow
def test_of_four_pairs_with_a_wrong_one_one_more_placement_is_asked_for(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    wrong = {**truth["placements"][2], "pixel_px": [40.0, 40.0]}
    page.load_sample({**truth, "placements": [*truth["placements"][:2], wrong, *truth["placements"][3:]]}, 4)
    assert (page.view["verdict"]["level"], page.view["verdict"]["key"]) == ("coarse", "N")
    assert rule(page) == "one-more"


@pytest.mark.slow
def test_a_maximum_range_that_leaves_all_returns_out_is_named_with_its_field(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 1)
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.fill("#option-gating-max_range_m", "1")
    page.page.keyboard.press("Enter")
    page.until("document.getElementById('guide').innerText.includes('maximum range')")
    page.page.click("#sheet-close")
    page.page.click("#guide .do")
    assert page.value("document.activeElement.id") == "option-gating-max_range_m"


@pytest.mark.slow
def test_a_recording_without_placements_says_what_it_is_good_for(page: Driver) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.value("void (__cocalib.state.placements = [], __cocalib.state.view.verdict.key = '')")
    page.go_to(3)
    assert rule(page) == "none"
    assert page.page.locator("#guide .do").count() == 2
    page.page.locator("#guide .do").first.click()
    page.until("document.getElementById('opening-dialog').open")


def test_zoomed_in_a_corner_shows_the_whole_image_and_leads_to_its_other_places(page: Driver) -> None:
    inset = page.page.locator("#inset")
    assert not inset.is_visible()
    page.zoom_to(200, 150, 4)
    inset.wait_for(state="visible")
    box = inset.bounding_box()
    assert box is not None
    width, height = page.value("[__cocalib.viewport.imageWidth, __cocalib.viewport.imageHeight]")
    assert box["width"] / box["height"] == pytest.approx(width / height, rel=0.05)
    clicks = len(page.view["clicks"])
    inset.click(position={"x": 0.75 * box["width"], "y": 0.5 * box["height"]})
    middle = page.value("__cocalib.toImage(__cocalib.viewport.width / 2, __cocalib.viewport.height / 2)")
    assert middle == pytest.approx([0.75 * width, 0.5 * height], abs=0.03 * width)
    assert len(page.view["clicks"]) == clicks
    page.press("f")
    inset.wait_for(state="hidden")


@pytest.mark.slow
def test_a_jump_shows_the_reflector_also_when_zoomed_in(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(truth, 2)
    page.zoom_to(*truth["placements"][1]["pixel_px"], 4)
    page.press("n")
    page.until("__cocalib.viewport.fitted")
    page.load_sample(truth, 8)
    page.zoom_to(*truth["placements"][7]["pixel_px"], 4)
    page.press("n")
    page.until("__cocalib.state.shown.index === __cocalib.state.placements[8].frame")
    page.until("__cocalib.state.overlay.index === __cocalib.state.shown.index")
    assert page.value("__cocalib.zoom()") == pytest.approx(4, rel=0.05)
    u, v = truth["placements"][8]["pixel_px"]
    x, y = page.value(f"__cocalib.toCss({u}, {v})")
    assert 0 < x < page.value("__cocalib.viewport.width")
    assert 0 < y < page.value("__cocalib.viewport.height")
    page.page.click("#zoom")
    assert page.value("__cocalib.viewport.fitted")


def test_a_placement_can_be_marked_without_a_mouse(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.shown.index === __cocalib.state.placements?.[0]?.frame")
    page.press("g", "Enter")
    assert page.view["clicks"] == [], "nothing is expected yet, and the cross was not moved"
    page.press("ArrowRight", "Enter")
    [first] = page.view["clicks"]
    assert (first["u_px"], first["v_px"]) == pytest.approx((479.5 + 960 / 60, 299.5), abs=0.6)
    assert first["mark"] == "clicked"
    page.press("Alt+Shift+ArrowRight")
    page.until("__cocalib.state.view.revision === 2")
    [moved] = page.view["clicks"]
    assert moved["u_px"] == pytest.approx(first["u_px"] + 1)
    page.press("Delete")
    page.load_sample(truth, 8)
    page.press("n")
    page.until("__cocalib.state.shown.index === __cocalib.state.placements[8].frame")
    page.until("__cocalib.state.overlay.index === __cocalib.state.shown.index")
    guess, _ = page.value("__cocalib.state.overlay.guesses[0]")
    page.press("Enter")
    assert len(page.view["clicks"]) == 9
    last = page.view["clicks"][-1]
    assert (last["u_px"], last["v_px"]) == pytest.approx(guess)
    assert last["state"] == "untouched"


def test_enter_opens_neither_the_cross_nor_the_menu_again(page: Driver) -> None:
    page.press("Enter")
    page.page.click("#menu-button")
    page.page.click("#theme")
    page.press("Enter")
    assert not page.value("__cocalib.state.cross")
    assert not page.page.is_visible("#menu")
    assert page.view["clicks"] == []


@pytest.mark.slow
def test_a_failure_of_the_papers_method_is_said_once(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 9)
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    assert page.page.locator('[data-path="paper.ransac_threshold_px"]').is_hidden()
    page.page.click('[data-method="paper"]')
    page.until("__cocalib.state.view.method === 'paper'")
    page.settle()
    assert page.page.locator('[data-path="noise.sigma_px"]').is_hidden()
    page.page.get_by_label("RANSAC threshold").fill("0.05")
    page.page.keyboard.press("Enter")
    page.until("__cocalib.state.view.options.paper.ransac_threshold_px === 0.05")
    page.settle()
    assert page.view["stage"] == "unsolvable"
    verdict = page.view["verdict"]
    assert page.said(verdict["line"]) in page.text("#verdict")
    assert page.said(verdict["action"]) in page.text("#guide")
    assert (verdict["kind"], verdict["option"]) == ("SetOption", "method")
    assert page.page.get_attribute("#connection", "data-stage") == "unsolvable"


@pytest.mark.slow
def test_the_pose_tab_lists_the_errors_that_all_pairs_share(page: Driver, truth: Any) -> None:
    page.page.click("#tab-check")
    assert page.page.locator(".systematic").is_hidden()
    page.load_sample(truth)
    errors = page.view["systematic_errors"]
    rows = page.page.locator(".systematic tbody tr")
    assert rows.count() == len(errors["rows"]) > 0
    for index, row in enumerate(errors["rows"]):
        text = rows.nth(index).inner_text()
        assert row["figure"]["label"] in text
        assert row["prior"] in text
        assert rows.nth(index).get_attribute("data-hint") == row["figure"]["hint"]
    for sentence in errors["sentences"]:
        assert page.said(sentence) in page.text(".systematic")
    assert (
        page.value(
            "(() => { const tab = document.getElementById('page-pose'); return tab.scrollWidth - tab.clientWidth; })()"
        )
        <= 0
    )
    assert page.page.locator(".pose table").nth(1).is_hidden(), "this radar measures elevation"
    page.page.click("#menu-button")
    page.page.click('#menu [data-action="options"]')
    page.page.locator("#page-options details summary").click()
    assert "systematic errors" in page.text("#page-options")
    assert page.page.get_by_label("Azimuth scale").input_value() == "0.02"


@pytest.mark.parametrize(
    "name",
    ["c({}".format, pytest.param("a.*{}+".format, marks=pytest.mark.slow), lambda number: str(21 - number)],
)
def test_a_pair_that_does_not_fit_is_called_alike_everywhere_whatever_its_id(
    page: Driver, truth: Any, name: Callable[[int], str]
) -> None:
    wrong = {**truth["placements"][4], "pixel_px": [40.0, 40.0]}
    moved = {**truth, "placements": [*truth["placements"][:4], wrong, *truth["placements"][5:]]}
    page.until("__cocalib.state.placementsKnown")
    page.load_sample(moved, 12, name=name)
    page.go_to(page.frame_at(wrong["best_image_time"]))
    page.until("document.getElementById('guide').innerText.includes('#5')")
    for other in ("#4", "#6", "#16"):
        assert other not in page.text("#guide") + page.text("#verdict")
    page.go_to(page.frame_at(truth["placements"][0]["best_image_time"]))
    assert rule(page) == "misfits", "as long as it is set aside, it is named"
