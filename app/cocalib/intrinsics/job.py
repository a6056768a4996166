"""Look for the board and calibrate the lens: at once, or in the background, watched and cancelled from other threads."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from calib_core.errors import CalibrationError, InputError
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardImages
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.measurements import Unsolvable
from calib_core.options import LensChoice
from calib_core.words.outcomes import outcome_remark
from cocalib.platform.error_boundary import error_boundary

LensStage: TypeAlias = Literal["idle", "searching", "calibrating", "cancelled", "failed", "done"]
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class LensSnapshot:
    """How far a calibration of a lens is.

    Attributes:
        stage: what is being done; "idle" before the first start.
        board: that is looked for; None before the first start.
        progress: of the search; None before its first image.
        doing: what is computed, once the search is over.
        problem: why there is no result, if the stage is "failed".
        hint: what to do about it.
        search: what the search found for `lens`.
        lens: the result of the last calibration that had one; it stays while another one runs.
    """

    stage: LensStage = "idle"
    board: Board | None = None
    progress: SearchProgress | None = None
    doing: str = ""
    problem: str = ""
    hint: str = ""
    search: BoardSearch | None = None
    lens: CalibratedLens | None = None

    @property
    def is_running(self) -> bool:
        """Whether a thread is at work."""
        return self.stage in ("searching", "calibrating")

    @property
    def can_resume(self) -> bool:
        """Whether there are views of a cancelled search to go on from."""
        return self.stage == "cancelled" and self.progress is not None and bool(self.progress.views)


class LensJob:
    """Calibrates a lens in a thread of its own. Every method may be called from any thread."""

    def __init__(self, changed: Callable[[], None]) -> None:
        """Set up the job.

        Args:
            changed: called after every change, from the thread that made it and without any lock held.
        """
        self._changed = changed
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._snapshot = LensSnapshot()
        self._closed = False

    @property
    def snapshot(self) -> LensSnapshot:
        """The present state."""
        return self._snapshot

    def start(self, images: BoardImages, board: Board, model: LensChoice) -> None:
        """Start, or go on from the views of a cancelled search for the same board; returns immediately.

        Raises:
            InputError: a calibration is running, or there are no images.
        """
        if not len(images):
            raise InputError("there are no images to look for the board in; give a recording with a camera")
        with self._lock:
            if self._closed:
                raise InputError("the recording is being closed; open it again to calibrate its lens")
            if self._snapshot.is_running:
                raise InputError("a calibration of the lens is running; cancel it first")
            before = self._snapshot
            known = before.progress if before.can_resume and before.board == board else None
            self._stop = threading.Event()
            self._snapshot = LensSnapshot("searching", board, known, search=before.search, lens=before.lens)
            self._thread = threading.Thread(
                target=self._run, args=(images, board, model, known, self._stop), name="lens", daemon=True
            )
            self._thread.start()
        self._changed()

    def cancel(self) -> None:
        """Stop as soon as possible; the views found so far are kept. Nothing happens if nothing runs."""
        self._stop.set()

    def close(self) -> None:
        """Stop, and wait until the thread has ended; nothing can be started any more."""
        with self._lock:
            self._closed = True
            thread = self._thread
        self._stop.set()
        if thread is not None:
            thread.join()

    def _run(
        self,
        images: BoardImages,
        board: Board,
        model: LensChoice,
        known: SearchProgress | None,
        stop: threading.Event,
    ) -> None:
        with error_boundary("calibrating the lens", self._failed):
            try:
                found = calibrate_from(
                    images,
                    board,
                    model,
                    known=known,
                    progress=self._take,
                    stopped=stop.is_set,
                )
            except CalibrationError as error:
                return self._failed(str(error))
            self._end(found, stop)

    def _end(self, found: tuple[BoardSearch, CalibratedLens] | Unsolvable, stop: threading.Event) -> None:
        if stop.is_set():
            self._set(stage="cancelled", doing="")
        elif isinstance(found, Unsolvable):
            said = outcome_remark(found)
            self._set(stage="failed", problem=str(said.message), hint=str(said.hint), doing="")
        else:
            self._set(stage="done", search=found[0], lens=found[1], doing="")

    def _take(self, progress: SearchProgress | str) -> None:
        if isinstance(progress, str):
            self._set(stage="calibrating", doing=progress)
        else:
            self._set(stage="searching", progress=progress)

    def _failed(self, line: str) -> None:
        _log.warning("the lens could not be calibrated: %s", line)
        self._set(stage="failed", problem=line, doing="")

    def _set(self, **changes: object) -> None:
        with self._lock:
            self._snapshot = replace(self._snapshot, **changes)  # type: ignore[arg-type]
        self._changed()


def calibrate_from(
    images: BoardImages,
    board: Board,
    model: LensChoice = "auto",
    *,
    known: SearchProgress | None = None,
    progress: Callable[[SearchProgress | str], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[BoardSearch, CalibratedLens] | Unsolvable:
    """Find the board in images, and calibrate the lens that took them.

    Args:
        images: where to look.
        board: what to look for.
        model: of the lens.
        known: how far an earlier search came.
        progress: called while the board is looked for, and then with what is done next, in words.
        stopped: asked often; once it is true there is no calibration.
    """
    search = search_boards(images, board, known=known, progress=progress, stopped=stopped)
    if isinstance(search, Unsolvable):
        return search
    if stopped():
        return Unsolvable("stopped")
    lens = calibrate_lens(search, model, progress=progress, stopped=stopped)
    return lens if isinstance(lens, Unsolvable) else (search, lens)
