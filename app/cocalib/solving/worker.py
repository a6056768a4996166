"""The solver's own thread: it answers the newest revision of a session and skips the older ones."""

import logging
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

from calib_core.association.pairing import RadarSource
from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, PairResult
from cocalib.evaluation.evaluating import check_clicks
from cocalib.platform.error_boundary import report_of
from cocalib.session.events import Solved
from cocalib.solving.solving import solve_in_steps

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Request:
    revision: int
    clicks: tuple[ReflectorClick, ...]
    options: CalibrationOptions
    when_done: Callable[[Solved], None]
    camera: Camera | None


class SolverWorker:
    """Solves in its own thread; of several waiting requests, only the newest is solved."""

    def __init__(
        self,
        recording: RadarSource,
        camera: Camera | None,
        reference: Calibration | None = None,
    ) -> None:
        self._recording = recording
        self._camera = camera
        self._reference = reference
        self._lock = threading.Lock()
        self._newest_revision = -1
        self._closed = False
        self._latest: Calibration | None = None
        self._latest_camera: Camera | None = None
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="solver")

    def request(
        self,
        revision: int,
        clicks: Sequence[ReflectorClick],
        options: CalibrationOptions,
        when_done: Callable[[Solved], None],
        camera: Camera | None = None,
    ) -> None:
        """Solve this revision and drop older requests; returns immediately, and does nothing after `close`.

        A preview of the answer comes first, where there is one.

        Args:
            revision: echoed in the answer; larger means newer.
            clicks: of this revision.
            options: of this revision.
            when_done: called with each answer, without any lock held; not called when a newer request came in time.
            camera: other intrinsics than the recording was opened with; None for those.
        """
        request = _Request(revision, tuple(clicks), options, when_done, camera or self._camera)
        with self._lock:
            if self._closed or revision <= self._newest_revision:
                return
            self._newest_revision = revision
            future = self._executor.submit(self._answer, request)
        future.add_done_callback(partial(_deliver, request))

    def close(self) -> None:
        """Stop: the current solve is finished, and no answer comes after this returns."""
        with self._lock:
            self._closed = True
            self._newest_revision += 1
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _answer(self, request: _Request) -> Solved | None:
        if request.revision != self._newest_revision:
            return None
        latest = self._latest if self._latest_camera is request.camera else None
        steps = solve_in_steps(self._recording, request.clicks, request.camera, request.options, previous=latest)
        for outcome in steps:
            if not (isinstance(outcome, Calibration) and outcome.checking):
                break
            if request.revision != self._newest_revision:
                return None
            request.when_done(Solved(request.revision, outcome))
        if isinstance(outcome, Calibration):
            self._latest, self._latest_camera = outcome, request.camera
        checked: tuple[PairResult, ...] = ()
        if isinstance(outcome, Unsolvable) and self._reference is not None:
            checked = check_clicks(self._recording, request.clicks, self._reference, request.options)
        return Solved(request.revision, outcome, checked)


def _deliver(request: _Request, future: "Future[Solved | None]") -> None:
    """Deliver the answer. A failure is an answer too: it is shown to the user, and logged if it is a bug."""
    if future.cancelled():
        return
    error = future.exception()
    solved = future.result() if error is None else Solved(request.revision, _failure(error))
    if solved is not None:
        request.when_done(solved)


def _failure(error: BaseException) -> Unsolvable:
    if isinstance(error, CalibrationError):
        return Unsolvable("unreadable", {"why": str(error)})
    line = report_of(error, "solving")
    _log.error("%s", line)
    return Unsolvable("internal-error", {"fault": line})
