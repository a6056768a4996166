"""The page's own copy of the View: changes applied by the page give what the server would send whole."""

import json
import random
from dataclasses import replace

import numpy as np
import pytest

from calib_core.measurements import Stamp
from cocalib.session.applying import History
from cocalib.session.state import RecordingFacts
from cocalib.view.build import view
from cocalib.view.model import ClickRow, Ellipse, View
from cocalib.web.channel.outbox import ViewFeed
from cocalib.web.messages.outgoing import encode
from cocalib.workspace import Workspace
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

_STEPS = 300


def random_view(before: View, chance: random.Random) -> View:
    """Return a View that differs: rows gone, rows added, rows moved, some or all values new."""
    rows = [row for row in before.clicks if chance.random() > 0.1]
    for number in chance.sample(range(60), chance.randint(0, 4)):
        if all(row.id != f"c{number}" for row in rows):
            rows.insert(
                chance.randint(0, len(rows)), ClickRow(f"c{number}", Stamp(number, 0), number, 1.0, 2.0, "pending")
            )
    if chance.random() < 0.1:
        chance.shuffle(rows)
    share = chance.choice([0.0, 0.1, 1.0])
    rows = [
        replace(row, residual_px=chance.random(), ellipse=Ellipse(chance.random(), 1.0, 0.0))
        if chance.random() < share
        else row
        for row in rows
    ]
    return replace(before, revision=before.revision + 1, status=f"“{chance.random()}”", clicks=tuple(rows))


def test_the_page_applies_changes_as_the_server_means_them(page: Driver) -> None:
    chance = random.Random(11)
    newest = view(History(), RecordingFacts("drive", np.arange(3), 640, 480))
    feed, shown = ViewFeed(newest), None
    messages: list[str] = []
    for step in range(_STEPS):
        text, shown = feed.message(shown if step % 50 else None)
        messages.append(text)
        newest = random_view(newest, chance)
        feed.take(newest)
    text, shown = feed.message(shown)
    had = page.page.evaluate(
        """async (texts) => {
            const { Follower } = await import("/base/state.js");
            const follower = new Follower();
            for (const text of texts) {
                const message = JSON.parse(text);
                if (message.type === "view") follower.take(message);
                else if (!follower.follow(message)) throw new Error("a change is missing");
            }
            return follower.view;
        }""",
        [*messages, text],
    )
    assert had == json.loads(encode(newest))


def test_a_page_that_missed_a_change_asks_for_a_whole_view(
    page: Driver, workspace: Workspace, truth: dict[str, object]
) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.click_sample(truth, 2)
    page.value("(__cocalib.follower.changes = 1000, null)")
    page.go_to(0)
    page.click(200, 200)
    page.until("__cocalib.state.view.clicks.length === 3 && __cocalib.follower.changes < 1000")
    page.settle()
    assert page.view == json.loads(encode(workspace.view))


@pytest.mark.slow
def test_after_a_calibration_the_page_has_what_a_new_page_gets_and_shows_the_same_frame_when_reloaded(
    page: Driver, workspace: Workspace, truth: dict[str, object]
) -> None:
    page.until("__cocalib.state.placementsKnown")
    page.click_sample(truth, 6)
    page.press("x", "Control+z", "Delete", "Control+z")
    page.until("__cocalib.state.view.stage === 'solved'")
    assert page.value("__cocalib.follower.changes > 6"), "the page was sent changes"
    assert page.view == json.loads(encode(workspace.view))
    frame = page.value("__cocalib.state.cursor")
    page.page.reload()
    page.until("__cocalib.state.shown && __cocalib.state.view")
    assert page.view == json.loads(encode(workspace.view))
    assert page.value("__cocalib.state.shown.index") == frame > 0
