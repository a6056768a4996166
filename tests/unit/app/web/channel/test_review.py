"""What a page's review desk answers: two solutions, why one is missing, and only the newest request."""

import asyncio
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.measurements import RadarScans, ReflectorClick, TimeNs
from calib_core.results import Calibration
from cocalib.session.applying import History
from cocalib.session.state import Session
from cocalib.web.channel.outbox import Outbox
from cocalib.web.channel.review import ReviewService
from cocalib.web.messages.incoming import CompareWanted, ReviewRequest, ReviewWanted, UncertaintyWanted


class Desk:
    """A session with its answer, and a radar that saw nothing."""

    def __init__(self, session: Session) -> None:
        self.session, self.history, self.reference = session, History(session), None

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float, /) -> RadarScans:
        return RadarScans()


@pytest.fixture(scope="module")
def solved() -> Calibration:
    drawn = simulate_pairs(8, rng=np.random.default_rng(1))
    return calibrate_pairs(drawn.pairs, drawn.camera).unwrap()


def answers(session: Session, *requests: ReviewRequest, camera: Any = None) -> list[Any]:
    """Return what the desk sends, in order."""

    async def ask() -> list[Any]:
        outbox, sent, reports = Outbox(), [], []
        desk = ReviewService(Desk(session), Desk(session), lambda: camera, outbox, reports.append)

        async def take(message: str | bytes) -> None:
            sent.append(json.loads(message))

        delivering = asyncio.create_task(outbox.deliver(take))
        for request in requests:
            desk.give(request)
        kinds = {type(request) for request in requests}
        async with asyncio.timeout(30):
            while len(sent) < len(kinds):
                await asyncio.sleep(0)
        desk.close()
        delivering.cancel()
        assert reports == []
        return sent

    return asyncio.run(ask())


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (CompareWanted("now", "before"), "no earlier answer"),
        (CompareWanted("now", "reference"), "--calibration FILE"),
        (CompareWanted("now", "file"), "drop one here"),
        (CompareWanted("now", "toggled"), "no pair is selected"),
        (CompareWanted("now", "toggled", pair="c1"), "c1 is an untouched guess"),
        (CompareWanted("now", "file", file_name="a.json", file_base64="!"), "a.json"),
        (CompareWanted("now", "file", file_name="empty.json"), "empty.json"),
        (CompareWanted("now", "paper"), "intrinsics are missing"),
    ],
)
def test_a_solution_that_does_not_exist_is_explained(solved, request_, words):
    guess = ReflectorClick(TimeNs(1), "c1", 1.0, 1.0, mark="untouched")
    (both,) = answers(Session(clicks=(guess,), revision=3, outcome=solved, outcome_revision=3), request_)

    assert words.lower() in both["problem"].lower()
    assert both["rows"] == []


def test_without_an_answer_nothing_is_compared_and_nothing_drawn(solved):
    for outcome in (None, replace(solved, checking=True)):
        (both,) = answers(Session(outcome=outcome), CompareWanted("now", "now"))
        assert "no checked calibration yet" in both["problem"]
    review, uncertainty = answers(Session(), ReviewWanted(), UncertaintyWanted())

    assert (review["rows"], uncertainty["maps"]) == ([], [])


def test_now_and_the_method_in_use_are_the_same_answer_and_only_the_newest_request_is_answered(solved):
    session = Session(revision=3, outcome=solved, outcome_revision=3)
    (both,) = answers(session, CompareWanted("now", "before"), CompareWanted("now", "default"))
    assert (both["type"], both["b"], both["problem"]) == ("compared", "default method", "")
    assert [row["text"].split()[0] for row in both["rows"][:5]] == ["0"] * 5
