"""The verdict and the warnings: always in sight, one action, the gravest first, and what was read folds away."""

from typing import Any

import pytest
from playwright.sync_api import expect

from tests.browser.driving import Driver

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


def test_the_verdict_is_in_sight_from_nothing_to_done(page: Driver, truth: Any) -> None:
    page.until("__cocalib.state.placementsKnown && __cocalib.state.view.verdict.key === 'N'")
    assert page.text("#verdict").startswith("nothing yet")
    assert in_sight(page)
    page.load_sample(truth, 5)
    verdict = page.view["verdict"]
    assert (verdict["level"], verdict["action"]) == ("weak", "Click the 15 placements that are left.")
    assert page.text("#verdict .line") == verdict["line"]
    assert page.text("#status-text").startswith("Weak: all 5 clicks agree")
    assert "Click the 15 placements that are left. Press N" in page.text("#guide")
    assert in_sight(page)
    assert page.page.get_attribute("#verdict", "data-level") == "weak"

    codes = [warning["code"] for warning in page.view["warnings"]]
    assert len(codes) > 1
    shown = page.page.locator("#warnings .rows > .warning")
    assert [shown.nth(place).get_attribute("data-code") for place in range(len(codes))] == codes
    assert f"{len(codes)} warnings" in page.text("#warnings .count")
    first = page.page.locator(f'#warnings [data-code="{codes[0]}"]')
    assert first.bounding_box()["height"] < 32, "one line each"  # type: ignore[index]
    first.locator("summary").focus()
    page.page.keyboard.press("Enter")
    expect(first.locator(".hint")).to_be_visible()
    first.get_by_role("button", name="Acknowledge").click()
    page.until(f"__cocalib.state.view.acknowledged.includes('{codes[0]}')")
    expect(page.page.locator("#warnings .acknowledged > summary")).to_have_text("1 acknowledged")
    assert shown.first.get_attribute("data-code") == codes[1]
    assert page.view["verdict"] == verdict, "what was read still counts"

    page.load_sample(truth)
    done = page.view["verdict"]
    assert (done["done"], done["key"]) == (True, "E")
    assert done["action"].startswith("Done")
    assert page.view["hint"] == done["action"]
    assert page.view["advice"]["words"].startswith(done["action"])
    assert "Done. Press E" in page.text("#guide")
    assert in_sight(page)

    page.page.click("#tab-options")
    page.page.click('[data-method="paper"]')
    page.until("__cocalib.state.view.method === 'paper'")
    page.settle()
    assert page.view["verdict"]["level"] in ("weak", "contradictory"), "it states no error"
    notes = [click["note"] for click in page.view["clicks"] if click["state"] == "outlier"]
    assert notes
    assert all("Algorithm 1" in note and "Check the click" not in note for note in notes)
