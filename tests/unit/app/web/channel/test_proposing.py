"""The desk of the proposals: what pages are told, why there are none, and how they are switched off and on."""

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from calib_core.measurements import TimeNs
from calib_core.proposing import Proposals, ViewProgress, chance
from cocalib.session.events import ClickPlaced, PlacementDismissed
from cocalib.session.state import RecordingFacts
from cocalib.web.channel.proposing import ProposingService
from cocalib.web.messages.incoming import ProposingSwitch, SnapWanted
from cocalib.web.messages.outgoing import ProposalNews
from cocalib.workspace import Workspace
from tests.drawn_views import Drawing, draw_views
from tests.unit.app.web.channel.desk import session_without_solver, visited

DRAWN = draw_views(3, Drawing(count=6))
PLACEMENTS = tuple(view.placement for view in DRAWN.views)
TIMES = np.array([int(view.image_time) for view in DRAWN.views])
FACTS = RecordingFacts("a.bag", TIMES, DRAWN.camera.width_px, DRAWN.camera.height_px)


class Sensors:
    """A recording whose images nobody looks at."""

    image_times = TIMES

    def __init__(self, scans: int = 3) -> None:
        self.radar_times = np.arange(scans)


@pytest.fixture
def workspace(tmp_path: Path) -> Iterator[Workspace]:
    with session_without_solver(tmp_path, FACTS, DRAWN.camera) as opened:
        yield opened


@pytest.fixture(autouse=True)
def found(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(*_: object, progress: Any, **__: object) -> Any:
        progress(ViewProgress(len(PLACEMENTS), len(PLACEMENTS), DRAWN.views))
        return DRAWN.views, Proposals(())

    monkeypatch.setattr("cocalib.proposing.find_proposals", find)
    monkeypatch.setattr(chance, "_DEALS", 5)  # how far chance goes is not what is tested here


class Cameras(Sensors):
    """A recording whose frames all show one reflector: three sheets that meet at (30.0, 24.0)."""

    def image(self, index: int, /) -> np.ndarray:
        """Draw a frame."""
        y, x = (np.mgrid[: 48 * 8, : 64 * 8] + 0.5) / 8 - 0.5
        turned = np.rad2deg(np.arctan2(y - 24.0, x - 30.0)) % 360.0
        grey = np.select([turned < 120.0, turned < 240.0], [60, 230], 140).astype(np.uint8)
        grey[np.hypot(x - 30.0, y - 24.0) > 14.0] = 100
        return np.repeat(cv2.resize(grey, (64, 48), interpolation=cv2.INTER_AREA)[..., None], 3, axis=2)


def at_desk(
    workspace: Workspace,
    visit: Callable[[ProposingService, list[Any]], Any],
    recording: object = None,
    *,
    on: bool = True,
) -> list[Any]:
    """Run a visit at a desk; return what the pages were told."""
    return visited(lambda tell: ProposingService(workspace, recording or Sensors(), tell, on=on), visit)


async def until(told: list[Any], holds: Callable[[ProposalNews], bool]) -> ProposalNews:
    async with asyncio.timeout(120):
        while not (told and holds(told[-1])):
            await asyncio.sleep(0.005)
    news: ProposalNews = told[-1]
    return news


def test_pages_are_told_the_proposals_with_their_placements_and_frames(workspace):
    async def visit(desk: ProposingService, told: list[Any]) -> None:
        desk.surveyed(PLACEMENTS)
        news = await until(told, lambda one: one.progress.stage == "ready")
        assert (news.on, news.progress.problem) == (True, "")
        assert len(news.rows) + len(news.unproposed) == len(PLACEMENTS)
        assert news.rows[0].confidence == max(row.confidence for row in news.rows)
        for row in news.rows:
            view = DRAWN.views[row.placement]
            assert row.frame == row.placement
            assert row.image_time.time == view.image_time
            near = min(np.abs(one.pixel_px - row.places[0].pixel_px).max() for one in view.candidates)
            assert near <= 0.0005
        gone = news.rows[0].placement
        position_m = tuple(PLACEMENTS[gone].position_radar_m.tolist())
        workspace.dispatch(PlacementDismissed(DRAWN.views[gone].image_time, position_m))
        desk.follow()
        await until(told, lambda one: gone not in [row.placement for row in one.rows])

    at_desk(workspace, visit)


def test_a_place_that_carries_a_mark_is_not_offered(workspace):
    async def visit(desk: ProposingService, told: list[Any]) -> None:
        desk.surveyed(PLACEMENTS)
        news = await until(told, lambda one: one.progress.stage == "ready" and bool(one.rows))
        row, width_px = news.rows[0], news.rows[0].width_px
        workspace.dispatch(ClickPlaced(row.image_time.time, row.places[0].pixel_px, "clicked"))
        desk.switch(ProposingSwitch(on=True))  # tells the pages again
        count = len(told)
        await until(told, lambda _: len(told) > count)
        for other in told[-1].rows:
            apart_px = [np.hypot(*np.subtract(at.pixel_px, row.places[0].pixel_px)) for at in other.places]
            assert other.placement != row.placement or min(apart_px) > 0.5 * width_px

    at_desk(workspace, visit)


def test_a_click_goes_to_the_apex_next_to_it(workspace, monkeypatch):
    views = tuple(replace(view, width_px=28.0) for view in DRAWN.views)
    monkeypatch.setattr("cocalib.proposing.find_proposals", lambda *_, **__: (views, Proposals(())))
    time = views[1].image_time

    async def visit(desk: ProposingService, told: list[Any]) -> None:
        early = await desk.apex_near(SnapWanted(time, (31.0, 25.0), near=True))
        assert (early.pixel_px, "not looked at" in early.words) == (None, True)
        desk.surveyed(PLACEMENTS)
        await until(told, lambda one: one.progress.stage == "ready")
        found = await desk.apex_near(SnapWanted(time, (31.5, 25.0), near=True))
        assert found.pixel_px == pytest.approx((30.0, 24.0), abs=0.3)
        assert found.sigma_px is not None
        assert f"{found.sigma_px:.2f} px" in found.words
        missed = await desk.apex_near(SnapWanted(time, (8.0, 8.0), near=True))
        assert missed.pixel_px is None
        assert "no apex" in missed.words
        between = await desk.apex_near(SnapWanted(TimeNs(time + 1), (31.0, 25.0), near=True))
        assert between.pixel_px is None
        assert not workspace.session.clicks

    at_desk(workspace, visit, Cameras())


def test_nothing_is_proposed_until_it_is_switched_on_and_again_once_it_is_off(workspace):
    async def visit(desk: ProposingService, told: list[Any]) -> None:
        desk.surveyed(PLACEMENTS)
        desk.switch(ProposingSwitch(on=True))
        await until(told, lambda one: one.progress.stage == "ready" and bool(one.rows))
        desk.switch(ProposingSwitch(on=False))
        off = await until(told, lambda one: not one.on)
        assert (off.progress.stage, off.rows) == ("off", ())

    at_desk(workspace, visit, on=False)


def test_without_radar_scans_it_says_so(workspace):
    async def visit(desk: ProposingService, told: list[Any]) -> None:
        desk.surveyed(())
        desk.switch(ProposingSwitch(on=True))
        news = await until(told, lambda one: one.progress.stage == "failed")
        assert "no radar scans" in news.progress.problem

    at_desk(workspace, visit, Sensors(0))
