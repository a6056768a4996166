"""The verdict and the warnings: in sight, the gravest first, what was read folds away; and the page says nothing twice."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from calib_core.recordings import Recording
from cocalib.web.port.server import RunningServer
from tests.browser.driving import Driver
from tests.serving import serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def in_sight(page: Driver) -> bool:
    """Return whether the verdict lies wholly in the window and in its panel, and nothing covers its first line."""
    return bool(
        page.value(
            """(() => {
                const box = document.getElementById("verdict").getBoundingClientRect();
                const panel = document.getElementById("panel").getBoundingClientRect();
                const line = document.querySelector("#verdict .line").getBoundingClientRect();
                const top = document.elementFromPoint(line.left + 4, line.top + line.height / 2);
                return box.height > 20 && box.top >= panel.top && box.bottom <= panel.bottom && box.right <= innerWidth
                    && Boolean(top?.closest("#verdict"));
            })()"""
        )
    )


@pytest.mark.slow
def test_the_verdict_is_in_sight_from_nothing_to_done(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown && __cocalib.state.view.verdict.key === 'N'")
    assert page.text("#verdict") == "No clicks yet"
    assert in_sight(page)
    page.load_sample(truth, 5)
    verdict = page.view["verdict"]
    assert (verdict["early"], verdict["word"]) == (True, "")
    line = page.said(verdict["line"])
    assert line.startswith("5 of 8 pairs")
    assert page.text("#verdict .line") == line
    assert page.text("#status-text") == "Connected"
    assert verdict["key"] == "N"
    assert "15 left" in page.text("#guide")
    assert in_sight(page)
    assert page.page.get_attribute("#verdict", "data-level") == "early"

    assert page.view["warnings"] == []
    assert page.page.is_hidden("#warning-count"), "the verdict says the only one"

    page.load_sample(truth)
    done = page.view["verdict"]
    assert (done["done"], done["key"], done["word"]) == (True, "E", done["level"])
    assert page.text("#verdict .line") == done["word"] + page.said(done["line"])
    assert page.text("#guide").split()[:3] == ["Done.", "E", "export"]
    assert in_sight(page)

    page.page.click("#menu-button")

    page.page.click('#menu [data-action="options"]')
    page.page.click('[data-method="paper"]')
    page.until("__cocalib.state.view.method === 'paper'")
    page.settle()
    assert page.view["verdict"]["level"] in ("coarse", "contradictory"), "it states no error"
    assert {click["state"] for click in page.view["clicks"]} == {"inlier"}, "what agrees within the noise is not marked"

    page.page.click("#sheet-close")
    verdict = page.view["verdict"]
    codes = [warning["code"] for warning in page.view["warnings"]]
    page.page.click("#warning-count")
    shown = page.page.locator("#warnings > .warning")
    assert [shown.nth(place).get_attribute("data-code") for place in range(len(codes))] == codes
    assert page.text("#warning-count") == f"{len(codes)} warning{'s' if len(codes) > 1 else ''}"
    first = page.page.locator(f'#warnings [data-code="{codes[0]}"]')
    assert first.bounding_box()["height"] < 64, "its sentence only"  # type: ignore[index]
    first.locator("summary").focus()
    page.page.keyboard.press("Enter")
    expect(first.locator(".hint")).to_be_visible()
    first.get_by_role("button", name="Acknowledge").click()
    page.until(f"__cocalib.state.view.acknowledged.includes('{codes[0]}')")
    expect(page.page.locator("#warnings .acknowledged > summary")).to_have_text("1 acknowledged")
    expect(shown).to_have_count(len(codes) - 1)
    assert page.view["verdict"] == verdict, "what was read still counts"


CANVAS_WORDS = """(() => {
  const said = (window.__canvasWords = new Map());
  const { clearRect, fillText } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    said.set(this.canvas, []);
    return clearRect.apply(this, box);
  };
  CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
    said.set(this.canvas, [...(said.get(this.canvas) ?? []), text]);
    return fillText.call(this, text, ...rest);
  };
})()"""
"""Keeps what is written on each canvas since it was cleared."""

VISIBLE = """() => {
  const inSight = ({ width, height, left, top, right, bottom }) =>
    width > 1 && height > 1 && right > 0 && bottom > 0 && left < innerWidth && top < innerHeight;
  const found = [];
  const walker = document.createTreeWalker(document.querySelector("dialog[open]") ?? document.body, 4);
  while (walker.nextNode()) {
    const owner = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || owner.closest(".unseen, td, svg, #tip")) continue;
    if (!owner.checkVisibility({ visibilityProperty: true })) continue;
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    if (inSight(range.getBoundingClientRect())) found.push(walker.currentNode.textContent);
  }
  for (const [canvas, words] of window.__canvasWords)
    if (canvas.isConnected && canvas.checkVisibility() && inSight(canvas.getBoundingClientRect())) found.push(...words);
  return found;
}"""


def spoken(page: Driver) -> list[str]:
    """Return all text in sight, also what is drawn on canvases; table cells and copies for screen readers are left out."""
    page.drawn()
    found: list[str] = page.page.evaluate(VISIBLE)
    return found


def said_twice(texts: list[str]) -> list[str]:
    """Return the sentences of four words or more that are in sight more than once."""
    parts = (part.strip().lower() for text in texts for part in re.split(r"[.:;!?\n](?:\s|$)", text))
    counts = Counter(part for part in parts if len(part.split()) >= 4)
    return [part for part, count in counts.items() if count > 1]


class Ear:
    """Notes what is said twice in each state of the page."""

    def __init__(self, page: Driver) -> None:
        self.page, self.user, self.found = page, page.page, dict[str, list[str]]()

    def listen(self, state: str) -> None:
        self.found[state] = said_twice(spoken(self.page))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.press(key)
            self.listen(f"{len(self.found)}: after {key}")

    def sheet(self, name: str) -> None:
        self.user.click("#menu-button")
        self.user.click(f'#menu [data-action="{name}"]')
        self.listen(name)
        if self.user.is_visible("#sheet-close"):
            self.user.click("#sheet-close")
        self.close()

    def dialog(self, key: str, dialog: str) -> None:
        self.user.keyboard.press(key)
        self.user.locator(f"{dialog}[open]").wait_for()
        self.listen(dialog)
        self.close()

    def close(self) -> None:
        self.user.keyboard.press("Escape")
        expect(self.user.locator("dialog[open]")).to_have_count(0)
        self.page.drawn()


def mark(ear: Ear, truth: Any) -> None:
    """Mark from the first pair on, with a wrong one, its returns and the warnings."""
    page, user = ear.page, ear.user
    for count in (1, 3, 4, 5, 8):
        page.load_sample(truth, count)
        ear.listen(f"{count} pairs")
        if user.is_visible("#warning-count"):
            user.click("#warning-count")
            ear.listen("the warnings")
            user.click("#warning-count")
    ear.press("u", "u", "5", "5", "v", "v", "b", "b", "j")
    page.until("__cocalib.state.candidates")
    ear.listen("returns to choose from")
    u, v = truth["placements"][4]["pixel_px"]
    page.go_to(page.frame_at(truth["placements"][4]["best_image_time"]))
    page.drag((u, v), (u + 150, v - 90))
    ear.listen("a wrong pair")
    ear.press("x")


@pytest.mark.slow
def test_no_sentence_is_said_twice_and_the_first_screen_has_few_words(
    open_page: Callable[..., Driver], server: RunningServer, truth: Any
) -> None:
    page = open_page(server.url, script=CANVAS_WORDS)
    ear = Ear(page)
    page.until("__cocalib.state.placementsKnown")
    words = [word for text in spoken(page) for word in text.split() if any(letter.isalpha() for letter in word)]
    assert len(words) <= 110
    for shown in ("inner corner", "at least 8 placements", "No clicks yet"):
        assert shown in " ".join(spoken(page)), "what to do, how often, and how good it is"
    ear.listen("first screen")
    ear.press("n", "x", "x", "g", "Escape")
    mark(ear, truth)
    for tab in ("check", "deliver", "mark"):
        ear.user.click(f"#tab-{tab}")
        ear.listen(tab)
    for name in ("evaluate", "lens", "options", "recording"):
        ear.sheet(name)
    page.load_sample(truth)
    ear.listen("all pairs")
    for key, dialog in (("?", "#help-dialog"), ("Control+k", "#palette")):
        ear.dialog(key, dialog)
    assert len(ear.found) >= 25
    assert {state: twice for state, twice in ear.found.items() if twice} == {}


@pytest.mark.slow
def test_a_wrong_focal_length_is_said_once_and_wholly_and_the_lens_is_one_press_away(
    open_page: Callable[..., Driver], sample: Recording, tmp_path: Path, truth: Any
) -> None:
    camera = sample.camera()
    wrong = replace(camera, matrix_px=np.diag([1.12, 1.12, 1.0]) @ camera.matrix_px)
    with serving(sample, tmp_path / "s", camera=wrong, name="sample", token="test") as (running, _):
        page = open_page(running.url, script=CANVAS_WORDS)
        page.load_sample(truth)
        page.until("!__cocalib.state.view.checking")
        assert page.view["verdict"]["kind"] == "CalibrateLens"
        assert "intrinsics-suspected" not in [warning["code"] for warning in page.view["warnings"]], (
            "the verdict says it"
        )
        page.page.click("#warning-count")
        assert said_twice(spoken(page)) == []
        assert page.value(
            "((line) => line.scrollHeight <= line.clientHeight)(document.querySelector('#verdict .line'))"
        )
        page.page.click("#guide >> text=open Lens")
        expect(page.page.locator("#sheet-title")).to_have_text("Lens")
