"""Every action is in one table: the palette finds it by its words, the help shows its keys, and the keys run it."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect

from cocalib.platform.resources import site_folder
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


_CUT_OFF = """[...document.querySelectorAll("article *, article")].filter((part) => {
  const box = part.getBoundingClientRect();
  const scrolled = part.closest(".table-wrapper, pre, .highlight");
  return box.width && !scrolled && !part.closest(".visually-hidden") && (box.right > innerWidth + 1 || box.left < -1);
}).map((part) => `${part.tagName} ${part.textContent.slice(0, 40)}`)"""


def found(page: Driver, query: str) -> list[str]:
    """Type into the palette and return the names of the rows, the first ones."""
    page.page.fill("#palette input", query)
    return page.value(
        "[...document.querySelectorAll('#palette .entry .words')].slice(0, 5).map((row) => row.firstChild.textContent)"
    )


def opened(page: Driver) -> None:
    """Open the palette; it lists what is known when one types."""
    page.until("__cocalib.state.placementsKnown")
    expect(page.page.locator("dialog[open]")).to_have_count(0)
    page.page.keyboard.press("Control+k")
    expect(page.page.locator("#palette input")).to_be_focused()


def test_the_palette_finds_actions_by_their_words_other_words_and_with_a_slip(page: Driver) -> None:
    opened(page)
    assert "Undo" not in found(page, "undo")
    assert "Redo" not in found(page, "redo")
    for query, first in (
        ("exprot", "Export the calibration, the report or the clicks"),
        ("tape", "Measured camera position"),
        ("paper", "Method"),
        ("report", "Show the accuracy report"),
        ("new session", "Choose another recording, other topics, intrinsics or session"),
        ("colours", "Light or dark theme"),
        ("uncert", "Click uncertainty"),
        ("nxt plc", "Next placement"),
        ("placement 7", "Placement 7"),
        ("frame 100", "Frame 100"),
        ("time 12.5", "Time 12.5 s"),
    ):
        assert found(page, query)[0] == first, query
    assert found(page, "placement 70") == []
    expect(page.page.locator("#palette [role=status]")).to_contain_text("There are 20 placements")
    assert found(page, "qqq") == []
    expect(page.page.locator("#palette [role=status]")).to_contain_text("Nothing found")
    page.page.keyboard.press("Control+k")
    expect(page.page.locator("#palette")).to_be_hidden()


def test_the_palette_goes_to_placements_pairs_frames_times_and_options(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 2)
    for query, arrived in (
        ("placement 7", "__cocalib.state.shown.index === __cocalib.state.placements[6].frame"),
        ("pair 2", "__cocalib.state.selected === 'c2'"),
        ("frame 100", "__cocalib.state.shown.index === 99"),
        ("12.5 s", "Math.abs(__cocalib.state.seconds[__cocalib.state.shown.index] - 12.5) < 0.5"),
        ("click uncertainty", "document.activeElement.id === 'option-noise-sigma_px'"),
        ("gating speed", "document.activeElement.id === 'option-gating-max_speed_mps'"),
    ):
        opened(page)
        found(page, query)
        page.page.keyboard.press("Enter")
        expect(page.page.locator("#palette")).to_be_hidden()
        page.until(arrived)
    opened(page)
    recent = found(page, "")
    assert recent[0] == "Maximum Doppler speed" or "speed" in recent[0].lower()
    assert recent[1:4] == ["Click uncertainty", "Pair 2", "Placement 7"]


@pytest.mark.slow
def test_the_help_and_the_keys_come_from_the_same_table(page: Driver) -> None:
    table = page.page.evaluate(
        """async () => {
            const { ACTIONS } = await import("/base/actions.js");
            return ACTIONS.map(({ id, group, words, keys }) => ({ id, group, words, keys }));
        }"""
    )
    ids, keys = [row["id"] for row in table], [key for row in table for key in row.get("keys") or []]
    assert len(set(ids)) == len(ids)
    assert len(set(keys)) == len(keys), "two actions have the same key"
    page.press("?")
    shown = page.text("#help-dialog")
    for group in {row["group"] for row in table if row.get("keys")}:
        assert group in shown
    for word in ("Ctrl", "Undo", "Next or previous placement", "Loupe: 4 to 16 times"):
        assert word in shown
    page.page.keyboard.press("Escape")
    opened(page)
    page.page.keyboard.press("Escape")
    expect(page.page.locator("dialog[open]")).to_have_count(0)
    page.page.click("#search")
    count = page.value("document.querySelectorAll('#palette .entry').length")
    assert count > 30
    assert len(table) >= 45
    for _ in range(2):
        page.page.keyboard.press("ArrowUp")
    chosen = page.page.locator('#palette .entry[aria-selected="true"]')
    expect(chosen).to_have_count(1)
    assert page.page.get_attribute("#palette input", "aria-activedescendant") == chosen.get_attribute("id")


@pytest.mark.skipif(site_folder() is None, reason="the documentation is not built: make docs")
def test_the_help_leads_to_the_documentation_and_its_search(page: Driver) -> None:
    page.press("?")
    with page.page.context.expect_page() as opening:
        page.page.get_by_role("link", name="documentation").click()
    docs, complaints = opening.value, []
    docs.on(
        "console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None
    )
    docs.on("pageerror", lambda error: complaints.append(str(error)))
    for name in ("", "tour.html", "commands.html", "method.html", "drift.html"):
        docs.goto(f"{page.page.url.split('?')[0]}docs/{name}")
        expect(docs.locator("h1").first).to_be_visible()
        assert docs.evaluate("[...document.images].every((image) => image.naturalWidth)")
        for width, height in ((1440, 900), (390, 844)):
            docs.set_viewport_size({"width": width, "height": height})
            assert docs.evaluate(_CUT_OFF) == [], (name, width)
    docs.locator("input[name=q]").first.fill("drift")
    docs.keyboard.press("Enter")
    expect(docs.locator("#search-results a", has_text="Drift").first).to_be_visible()
    assert complaints == []


@pytest.mark.slow
def test_what_needs_images_is_refused_with_the_reason(open_page: Callable[..., Driver], radar_only_server: Any) -> None:
    page = open_page(radar_only_server.url, ready="__cocalib.state.look")
    opened(page)
    assert found(page, "export") == []
    expect(page.page.locator("#palette [role=status]")).to_contain_text("There are no images in this recording")
    page.page.keyboard.press("Escape")
    expect(page.page.locator("dialog[open]")).to_have_count(0)
    page.press("Enter", "e", "Delete", "x", "Control+z")
    assert not page.page.is_visible("dialog[open]")
    assert page.view["clicks"] == []
