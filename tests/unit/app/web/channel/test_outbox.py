"""The newest item is always processed, also one that comes at the moment when the last one is done."""

import asyncio
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.measurements import Stamp, TimeNs
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickPlaced
from cocalib.session.state import RecordingFacts
from cocalib.view.build import view
from cocalib.view.model import ClickRow, Ellipse, Figure, View
from cocalib.web.channel.outbox import NewestWins, Shown, ViewFeed
from cocalib.web.messages.outgoing import encode
from tests.page_view import applied


def test_an_item_that_comes_between_the_end_of_the_last_one_and_its_callback_is_processed():
    async def run() -> list[int]:
        done: list[int] = []
        finished = asyncio.get_running_loop().create_future()

        async def work(item: int) -> None:
            done.append(item)
            if item == 1:
                asyncio.get_running_loop().call_soon(worker.give, 2)  # runs once the task is done, before its callback
            else:
                finished.set_result(None)

        worker = NewestWins(work)
        worker.give(1)
        await asyncio.wait_for(finished, 5)
        return done

    assert asyncio.run(run()) == [1, 2]


FACTS = RecordingFacts("drive", 1_700_000_000_000_000_000 + 100_000_000 * np.arange(10_000), 640, 480)
NOTHING = view(History(), FACTS)

numbers = st.none() | st.floats(allow_nan=False, width=32)
rows = st.builds(
    ClickRow,
    id=st.sampled_from([f"c{number}" for number in range(12)]),
    image_time=st.builds(Stamp, st.integers(0, 3), st.integers(0, 3)),
    frame=st.integers(-1, 5),
    u_px=st.floats(0, 640),
    v_px=st.floats(0, 480),
    state=st.sampled_from(["pending", "inlier", "outlier"]),
    projected_px=st.none() | st.tuples(st.floats(0, 9), st.floats(0, 9)),
    residual_px=numbers,
    ellipse=st.none() | st.builds(Ellipse, st.floats(0, 9), st.floats(0, 9), st.floats(0, 3)),
    note=st.sampled_from(["", "Excluded."]),
)
views = st.builds(
    replace,
    st.just(NOTHING),
    revision=st.integers(0, 3),
    status=st.text(max_size=3),
    solving=st.booleans(),
    metrics=st.lists(st.builds(Figure, *[st.text(max_size=2)] * 5), max_size=2).map(tuple),
    clicks=st.lists(rows, max_size=8, unique_by=lambda row: row.id).map(tuple),
)


def clicked(count: int) -> View:
    history = History()
    for frame in range(count):
        history = advance(history, ClickPlaced(TimeNs(int(FACTS.image_times[frame])), (1.0, 2.0), "clicked"), FACTS)
    return view(history, FACTS)


@pytest.mark.slow
@given(st.lists(st.tuples(views, st.booleans()), min_size=1, max_size=8))
def test_a_page_that_applies_changes_has_the_newest_view(steps):
    """The second of each pair says whether the page reads at this moment; a page that does not gets one change later."""
    feed = ViewFeed(NOTHING)
    shown: Shown | None = None
    page: dict[str, object] = {}
    for newest, reads in [*steps, (NOTHING, True), steps[-1]]:
        feed.take(newest)
        if not reads:
            continue
        text, shown = feed.message(shown)
        if text:
            message = json.loads(text)
            page = message if message["type"] == "view" else applied(page, message)
        assert page == json.loads(encode(newest))


@pytest.mark.slow
@given(views, views)
def test_rows_may_move_and_share_an_id(before, after):
    before = replace(before, clicks=(*before.clicks, *before.clicks[:1]))
    after = replace(after, clicks=(*before.clicks[1:4], *after.clicks, *before.clicks[:2]))
    feed = ViewFeed(before)
    whole, shown = feed.message(None)
    feed.take(after)
    change, _ = feed.message(shown)
    page = json.loads(whole)
    assert (applied(page, json.loads(change)) if change else page) == json.loads(encode(after))


@pytest.mark.slow
def test_a_click_costs_the_same_however_many_there_are():
    sizes = []
    for count in (10, 400):
        feed = ViewFeed(clicked(count))
        _, shown = feed.message(None)
        feed.take(clicked(count + 1))
        sizes.append(len(feed.message(shown)[0]))
    assert sizes[1] < sizes[0] + 20, "only numbers get longer"
    assert sizes[1] < 1000


def test_pages_at_different_views_each_get_their_own_change():
    feed = ViewFeed(clicked(1))
    first, early = feed.message(None)
    feed.take(clicked(2))
    second, late = feed.message(None)
    feed.take(clicked(3))
    newest = json.loads(encode(clicked(3)))
    for whole, shown in ((first, early), (second, late), (first, early)):
        change, after = feed.message(shown)
        assert applied(json.loads(whole), json.loads(change)) == newest
        assert after.view == clicked(3)
    kept = zip(clicked(3).clicks, clicked(4).clicks, strict=False)
    assert all(old is new for old, new in kept), "rows that do not change are the same objects"
