"""Explanations, notices and the loupe: what they say, and that they cover nothing that matters."""

from typing import Any

import pytest
from playwright.sync_api import expect

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def overlap(page: Driver, one: str, other: str) -> bool:
    """Return whether two elements overlap on the screen."""
    a, b = (page.page.locator(selector).first.bounding_box() for selector in (one, other))
    assert a is not None
    assert b is not None
    apart = [
        a[side] + a[size] <= b[side] or b[side] + b[size] <= a[side] for side, size in (("x", "width"), ("y", "height"))
    ]
    return not any(apart)


def test_explanations_show_on_hover_and_focus_beside_what_they_explain(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 5)
    user = page.page
    tip = user.locator("#tip")
    for selector, words in (
        ("#verdict .aed", "Mean distance between click and reprojection"),
        ("#choose-recording", "sample"),
        ("#undo", "Undo (Ctrl+Z)"),
        ("#redo", "Redo (Ctrl+Shift+Z)"),  # disabled: it cannot be focused
        ("#next-placement", "Next placement (N)"),
        ("#page-mark tr.row", "reprojected at"),
    ):
        user.mouse.move(640, 300)
        expect(tip).to_be_hidden()
        user.hover(selector)
        expect(tip).to_contain_text(words)
        assert not overlap(page, "#tip", selector), selector
        if selector not in ("#undo", "#redo"):
            continue
        user.keyboard.press("Escape")
        expect(tip).to_be_hidden()
    user.mouse.move(640, 300)
    user.locator("#menu-button").focus()
    user.keyboard.press("Shift+Tab")
    expect(tip).to_contain_text("Ctrl+K")
    user.keyboard.press("e")
    expect(user.locator("#page-deliver .text")).to_contain_text("camera_from_radar")
    user.hover("#page-deliver .pose-numbers")
    expect(tip).to_contain_text("all digits")
    assert "R row 1" in page.text("#page-deliver .pose-numbers")
    user.keyboard.press("Escape")
    hintless = page.value(
        "[...document.querySelectorAll('#bar button, #time button, .chip, .figure, #page-options .field')]"
        ".filter((element) => !element.dataset.hint && !element.hidden).map((element) => element.outerHTML.slice(0, 90))"
    )
    assert hintless == []


@pytest.mark.slow
def test_a_notice_covers_neither_the_field_nor_the_mark(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 2)
    user = page.page
    user.click("#menu-button")
    user.click('#menu [data-action="options"]')
    user.click("#page-options summary")
    field = "#option-gating-max_speed_mps"
    user.locator(field).scroll_into_view_if_needed()
    for leave in ("Enter", "Tab"):
        user.fill(field, "-5")
        user.keyboard.press(leave)
        expect(user.locator(".toast")).to_contain_text("out of range")
        assert not overlap(page, "#toasts", field)
        x, y = page.place_of(*truth["placements"][1]["pixel_px"])
        box = user.locator("#toasts").bounding_box()
        assert box is not None
        assert not (box["x"] <= x <= box["x"] + box["width"] and box["y"] <= y <= box["y"] + box["height"])
        page.value(
            "document.querySelectorAll('.toast button').forEach((button) => button.click())"
        )  # it may have gone by itself
    user.click("#sheet-close")
    page.value("__cocalib.goTo(0)")


@pytest.mark.slow
def test_the_loupe_magnifies_4_to_16_times_and_stretches_the_contrast(page: Driver, truth: Any) -> None:
    user = page.page
    loupe = user.locator("#loupe")
    dark = """(() => {
        const box = document.getElementById("loupe");
        const data = box.getContext("2d").getImageData(4, 4, box.width - 8, box.height / 3).data;
        const levels = [...data].filter((_, at) => at % 4 === 1);
        return Math.max(...levels) - Math.min(...levels);
    })()"""
    user.mouse.move(*page.place_of(300, 420))
    expect(loupe).to_have_attribute("data-shows", "8 times")
    for key, shows in (
        ("]", "12"),
        ("]", "16"),
        ("]", "16"),
        ("[", "12"),
        ("[", "8"),
        ("[", "6"),
        ("[", "4"),
        ("[", "4"),
    ):
        user.keyboard.press(key)
        expect(loupe).to_have_attribute("data-shows", f"{shows} times")
    user.keyboard.down("Alt")
    zoom = page.value("__cocalib.zoom()")
    user.mouse.wheel(0, -120)
    user.keyboard.up("Alt")
    expect(loupe).to_have_attribute("data-shows", "6 times")
    assert page.value("__cocalib.zoom()") == zoom
    as_it_is = page.value(dark)
    user.keyboard.press("l")
    expect(loupe).to_have_attribute("data-shows", "6 times, contrast stretched")
    assert page.value(dark) > 1.5 * as_it_is
    page.page.reload()
    page.until("__cocalib.state.shown")
    user.mouse.move(*page.place_of(301, 421))
    expect(loupe).to_have_attribute("data-shows", "6 times, contrast stretched")
