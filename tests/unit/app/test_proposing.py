"""Proposals of a recording: the search, what stops it, which dwell a click shows; and in the background, anew with each click."""

import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, ImageCandidate, Proposals, ViewProgress, chance
from cocalib import proposing
from cocalib.proposing import (
    ProposingJob,
    ProposingSnapshot,
    ProposingStage,
    ProposingWish,
    find_proposals,
    proposed_again,
)
from tests.drawn_views import Drawing, draw_views

OPTIONS = CalibrationOptions()
DRAWN = draw_views(3, Drawing(count=12))
VIEWS = DRAWN.views
STANDS = tuple(view.placement for view in VIEWS)
WISH = ProposingWish(DRAWN.camera, OPTIONS, STANDS)


class Finding:
    """What replaces looking at the images and carrying a look: it goes on as the test allows, and keeps what it was asked."""

    def __init__(self) -> None:
        self.allowed = threading.Event()
        self.found = 0
        self.carried: list[tuple[int, tuple[str, ...]]] = []
        self.end: Any = None
        self.error: Exception | None = None

    def find(
        self, _recording: object, _camera: object, _options: object, *, progress: Any, stopped: Any, **_: Any
    ) -> Any:
        self.found += 1
        if self.error is not None:
            raise self.error
        for done in range(1, 11):
            progress(ViewProgress(done, len(VIEWS), VIEWS[:done]))
        assert self.allowed.wait(20)
        if stopped():
            return Unsolvable.reported("stopped", "the search was stopped", "start it again")
        return self.end or (VIEWS, Proposals(()))

    def look(self, clicks: Sequence[ReflectorClick], *_: object) -> list[str]:
        return [click.id for click in clicks]

    def carry(self, views: Sequence[DwellView], looks: Sequence[str], *_: object) -> tuple[DwellView, ...]:
        self.carried += [(VIEWS.index(view), tuple(looks)) for view in views]
        return tuple(
            replace(view, candidates=tuple(replace(one, likeness=0.6) for one in view.candidates)) for view in views
        )


@pytest.fixture
def finding(monkeypatch: pytest.MonkeyPatch) -> Finding:
    fake = Finding()
    monkeypatch.setattr(chance, "_DEALS", 5)  # how far chance goes is not what is tested here
    monkeypatch.setattr("cocalib.proposing.find_proposals", fake.find)
    monkeypatch.setattr("cocalib.proposing.appearances_of", fake.look)
    monkeypatch.setattr("cocalib.proposing.with_appearance", fake.carry)
    return fake


class Watched:
    """A job with everything that it told."""

    def __init__(self) -> None:
        self.told = threading.Condition()
        self.job = ProposingJob(None, self.take)

    def take(self) -> None:
        with self.told:
            self.told.notify_all()

    def until(self, stage: ProposingStage, open_ones: int | None = None) -> ProposingSnapshot:
        def holds() -> bool:
            now = self.job.snapshot
            return now.progress.stage == stage and (open_ones is None or _count(now) == open_ones)

        with self.told:
            assert self.told.wait_for(holds, timeout=60), (self.job.snapshot.progress.stage, _count(self.job.snapshot))
        return self.job.snapshot


def _count(snapshot: ProposingSnapshot) -> int:
    return len(snapshot.proposals.ranked) + len(snapshot.proposals.unproposed)


@pytest.fixture
def watched(finding: Finding) -> Iterator[Watched]:
    made = Watched()
    yield made
    finding.allowed.set()
    made.job.close()


def test_first_proposals_come_while_the_images_are_looked_at(finding, watched):
    watched.job.ask(WISH)
    early = watched.until("looking", 8)
    assert early.proposals.ranked
    assert early.progress.count == len(VIEWS)
    finding.allowed.set()
    assert len(watched.until("ready", len(VIEWS)).views) == len(VIEWS)


@pytest.mark.slow
def test_a_click_is_carried_to_the_placements_that_are_left(finding, watched):
    finding.allowed.set()
    watched.job.ask(WISH)
    watched.until("ready", len(VIEWS))
    watched.job.ask(replace(WISH, clicks=(DRAWN.click(4),), dismissed=frozenset({2})))
    found = watched.until("ready", len(VIEWS) - 2)
    proposed = [one.placement for one in found.proposals.ranked]
    assert not {2, 4} & {number for number, view in enumerate(VIEWS) if view.placement in proposed}
    assert {number for number, _ in finding.carried} >= {*range(len(VIEWS))} - {2, 4}
    assert 4 not in {number for number, _ in finding.carried}
    assert finding.found == 1

    finding.carried.clear()
    watched.job.ask(WISH)  # the click was undone
    watched.until("ready", len(VIEWS))
    assert finding.carried == []
    clicks = tuple(replace(DRAWN.click(n), id=f"c{n + 1}") for n in range(11))
    watched.job.ask(replace(WISH, clicks=tuple(sorted(clicks))))
    watched.until("ready", len(VIEWS) - 11)
    assert {looks for _, looks in finding.carried} == {("c1", "c2", "c3")}, "the look of three is enough"


def test_proposing_is_stopped_and_goes_on_without_looking_again(finding, watched):
    finding.allowed.set()
    watched.job.ask(WISH)
    watched.until("ready", len(VIEWS))
    watched.job.stop()
    assert watched.until("off", 0).views == ()
    watched.job.ask(replace(WISH))
    watched.until("ready", len(VIEWS))
    assert finding.found == 1


def test_with_another_camera_the_images_are_looked_at_again(finding, watched):
    watched.job.ask(WISH)
    watched.until("looking", 8)
    watched.job.ask(replace(WISH, camera=draw_views(4).camera))
    finding.allowed.set()
    watched.until("ready", len(VIEWS))
    assert finding.found == 2


def test_why_there_are_none_is_said(finding, watched):
    finding.allowed.set()
    finding.end = Unsolvable.reported("no-camera", "no intrinsics", "calibrate the lens")
    watched.job.ask(replace(WISH, camera=None))
    failed = watched.until("failed", 0)
    assert (failed.progress.problem, failed.progress.hint) == ("no intrinsics", "calibrate the lens")
    finding.error = RecordingError("camera.bag: frame 7 cannot be read")
    watched.job.ask(replace(WISH))
    watched.job.stop()
    watched.job.ask(replace(WISH))
    with watched.told:
        assert watched.told.wait_for(lambda: "frame 7" in watched.job.snapshot.progress.problem, timeout=60)


def test_nothing_is_asked_of_a_job_that_is_closed(finding, watched):
    watched.job.ask(WISH)
    watched.until("looking", 8)
    finding.allowed.set()
    watched.job.close()
    watched.job.ask(replace(WISH))
    assert finding.found == 1


CAMERA = Camera("pinhole", 64, 48, np.array([[60.0, 0, 32], [0, 60, 24], [0, 0, 1]]), np.zeros(0))


class Frames:
    """Grey frames at ten a second, and no radar: it must not be read if the placements are known."""

    def __init__(self, length_s: int = 40) -> None:
        self.image_times = np.arange(0, length_s * NS_PER_S, NS_PER_S // 10)

    def image(self, index: int, /) -> np.ndarray:
        return np.full((48, 64, 3), 90, np.uint8)

    def radar_windows(self) -> Iterator[RadarScans]:
        raise AssertionError("the placements are known")


def placement(start_s: float, end_s: float, x_m: float = 5.0) -> Placement:
    return Placement(TimeNs(int(start_s * NS_PER_S)), TimeNs(int(end_s * NS_PER_S)), np.array([x_m, 0.0, 0.0]), 0.9)


PLACEMENTS = tuple(placement(start_s, start_s + 5.0) for start_s in (1.0, 9.0, 17.0, 25.0))


def test_known_placements_are_not_searched_for_again():
    assert find_proposals(Frames(), None, OPTIONS, placements=PLACEMENTS).code == "no-camera"
    told: list[ViewProgress | str] = []
    views, proposals = find_proposals(Frames(), CAMERA, OPTIONS, placements=PLACEMENTS, progress=told.append)
    assert [view.placement for view in views] == list(PLACEMENTS)
    assert len(proposals.ranked) + len(proposals.unproposed) == len(PLACEMENTS)
    assert [one.done for one in told if isinstance(one, ViewProgress)] == [1, 2, 3, 4]
    views, _ = find_proposals(Frames(length_s=20), CAMERA, OPTIONS, placements=PLACEMENTS)
    assert [len(view.frames) > 0 for view in views] == [True, True, True, False], "the last has no frames"


@pytest.mark.parametrize("after", [0, 2])
def test_a_search_that_is_stopped_proposes_nothing(after):
    seen: list[ViewProgress | str] = []
    told = {"progress": seen.append, "stopped": lambda: len(seen) >= after}
    assert find_proposals(Frames(), CAMERA, OPTIONS, placements=PLACEMENTS, **told).code == "stopped"
    assert len(seen) == after


def view_of(one: Placement, pixel_px: tuple[float, float]) -> DwellView:
    candidate = ImageCandidate(np.array(pixel_px), 1.0, 20.0)
    frames = np.arange(int(one.start) * 10 // NS_PER_S, int(one.end) * 10 // NS_PER_S)
    return DwellView(one, frames, one.start, np.full((48, 64, 3), 90, np.uint8), 1.0, (candidate,))


def test_a_click_shows_the_dwell_whose_candidate_is_nearer_when_two_reflectors_stood_at_once(monkeypatch):
    one, other = view_of(placement(1, 6), (10.0, 10.0)), view_of(placement(2, 7, x_m=9.0), (50.0, 30.0))
    later = view_of(placement(20, 25), (49.0, 29.0))
    looked_at: list[DwellView] = []

    def look(view: DwellView, frames: object, pixel_px: np.ndarray) -> None:
        looked_at.append(view)

    monkeypatch.setattr(proposing, "appearance_of", look)
    click = ReflectorClick(TimeNs(3 * NS_PER_S), "c", 48.0, 30.0)
    left_out = ReflectorClick(TimeNs(22 * NS_PER_S), "x", 49.0, 29.0, excluded=True)
    elsewhere = ReflectorClick(TimeNs(15 * NS_PER_S), "e", 49.0, 29.0)
    proposed_again([one, other, later], Frames(), CAMERA, OPTIONS, confirmed=[click, left_out, elsewhere])
    assert looked_at == [other]
