"""A calibration in the background: one at a time, watched, cancelled and resumed, with errors in words."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError, RecordingError
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.measurements import Unsolvable
from cocalib.intrinsics import LensJob, LensSnapshot, LensStage

BOARD = Board("checkerboard", 9, 6, 0.025)
CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))


class Images:
    """Images that nobody looks at."""

    def __init__(self, count: int = 8) -> None:
        self.count = count

    def __len__(self) -> int:
        return self.count


def view(index: int) -> BoardCorners:
    return BoardCorners(index, f"frame {index + 1}", None, (640, 480), np.arange(4), np.zeros((4, 2)))


class Search:
    """What replaces the search: it goes on image by image, as the test allows."""

    def __init__(self) -> None:
        self.allowed = threading.Semaphore(0)
        self.known: list[SearchProgress | None] = []
        self.end: Any = None
        self.error: Exception | None = None

    def __call__(
        self,
        images: Images,
        board: Board,
        model: object,
        *,
        known: Any,
        progress: Any,
        stopped: Any,
    ) -> Any:
        self.known.append(known)
        views = list(known.views) if known else []
        for index in range(len(images)):
            assert self.allowed.acquire(timeout=20)
            if self.error is not None:
                raise self.error
            if stopped():
                return Unsolvable.reported("stopped", "the search was stopped", "start it again")
            views = [*views, view(index)] if index not in [one.index for one in views] else views
            progress(SearchProgress(index + 1, len(images), tuple(views), indices=tuple(range(index + 1))))
        progress("choosing a lens model")
        search = BoardSearch(board, (640, 480), tuple(views), (), len(images))
        lens = CalibratedLens(CAMERA, board, board.corners_m, (), (), 0.1, 0.11)
        return self.end or (search, lens)


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Search:
    fake = Search()
    monkeypatch.setattr("cocalib.intrinsics.job.calibrate_from", fake)
    return fake


class Watched:
    """A job with everything that it told."""

    def __init__(self) -> None:
        self.told = threading.Condition()
        self.seen: list[LensSnapshot] = []
        self.job = LensJob(self.take)

    def take(self) -> None:
        with self.told:
            self.seen.append(self.job.snapshot)
            self.told.notify_all()

    def until(self, stage: LensStage, searched: int = 0) -> LensSnapshot:
        def found() -> LensSnapshot | None:
            now = self.job.snapshot
            there = now.progress.searched if now.progress else 0
            return now if now.stage == stage and there >= searched else None

        with self.told:
            assert self.told.wait_for(lambda: found() is not None, timeout=20), self.job.snapshot
        snapshot = found()
        assert snapshot is not None
        return snapshot


@pytest.fixture
def watched(search: Search) -> Iterator[Watched]:
    made = Watched()
    yield made
    search.allowed.release(100)
    made.job.close()


def test_a_job_tells_how_far_it_is_and_ends_with_a_lens(search, watched):
    assert watched.job.snapshot.stage == "idle"
    watched.job.start(Images(), BOARD, "auto")
    assert watched.job.snapshot.is_running
    search.allowed.release(3)
    assert len(watched.until("searching", 3).progress.views) == 3
    search.allowed.release(5)
    done = watched.until("done")
    assert done.lens.camera is CAMERA
    assert "choosing a lens model" in [one.doing for one in watched.seen]
    assert not done.is_running


def test_only_one_calibration_runs_at_a_time(search, watched):
    watched.job.start(Images(), BOARD, "auto")
    with pytest.raises(InputError, match="cancel it first"):
        watched.job.start(Images(), BOARD, "auto")
    search.allowed.release(8)
    watched.until("done")
    assert len(search.known) == 1


@pytest.mark.parametrize(("board", "is_same"), [(BOARD, True), (Board("checkerboard", 8, 6, 0.025), False)])
def test_a_cancelled_search_goes_on_from_its_views_for_the_same_board_only(search, watched, board, is_same):
    watched.job.start(Images(), BOARD, "auto")
    search.allowed.release(4)
    watched.until("searching", 4)
    watched.job.cancel()
    search.allowed.release(1)
    cancelled = watched.until("cancelled")
    assert cancelled.can_resume
    assert cancelled.problem == "", "a person wanted it"
    watched.job.start(Images(), board, "auto")
    search.allowed.release(8)
    watched.until("done")
    known = search.known[1] or SearchProgress(0, 0)
    assert [one.index for one in known.views] == ([0, 1, 2, 3] if is_same else [])
    assert known.indices == ((0, 1, 2, 3) if is_same else ())


def test_what_is_wrong_is_said_in_words_and_the_former_result_stays(search, watched, tmp_path):

    def ended(stage: LensStage) -> LensSnapshot:
        watched.job.start(Images(), BOARD, "auto")
        search.allowed.release(8)
        return watched.until(stage)

    former = ended("done").lens
    search.end = Unsolvable.reported("no-board", "no board was seen", "film the board")
    failed = ended("failed")
    assert (failed.problem, failed.hint) == ("no board was seen", "film the board")
    assert failed.lens is former
    search.error = RecordingError("frame 1 is cut")
    assert ended("failed").problem == "frame 1 is cut"
    search.error = KeyError("a bug")
    assert "KeyError" in ended("failed").problem, "it ends the calibration and not the program"


def test_without_images_or_after_closing_nothing_is_started(search, watched):
    with pytest.raises(InputError, match="no images"):
        watched.job.start(Images(0), BOARD, "auto")
    watched.job.close()
    with pytest.raises(InputError, match="being closed"):
        watched.job.start(Images(), BOARD, "auto")
