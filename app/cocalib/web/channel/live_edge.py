"""A recording that is still being written: takes in what is new, and tells the pages."""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Protocol, TypeVar

import numpy as np

from calib_core.camera import Camera
from calib_core.diagnostics.next_placement import placement_coverage
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import FollowedRecording, Growth
from calib_core.results import Calibration
from cocalib.view.following import FollowState, Pace, advice_words, pace_words
from cocalib.view.wording import sentence
from cocalib.web.channel.radar_survey import GrowingSurvey, Survey
from cocalib.web.messages.outgoing import FollowNote, FramesAdded, Outgoing, StampColumns
from cocalib.workspace import Workspace

_LOOK_EVERY_S = 0.2
_SURVEY_EVERY_S = 1.0
_SURVEY_SHARE = 0.2  # of the time, at most, is spent searching for placements
_SCANS_AT_ONCE = 512
_QUIET_AFTER_S = 5.0
_SLOW_WRITES = 3.0  # and only after this many times the usual interval
_REMEMBERED_WRITES = 9
_MOST_AGE_S = 3600.0
_CLOCK_OFF_S = 1.0
_WIDEST_HALF_VIEW_RAD = np.deg2rad(40.0)
_log = logging.getLogger(__name__)

Answer = TypeVar("Answer")


class Pages(Protocol):
    """What the pages are told through."""

    def broadcast(self, message: Outgoing, kind: str) -> None:
        """Send a message to all pages."""

    def grown(self, count: int) -> None:
        """Take note of the number of frames."""

    def surveyed(self, survey: Survey) -> None:
        """Show what the radar alone says."""

    def concluded(self) -> None:
        """Show what is known of the recording now that it is complete."""


class LiveEdge:
    """Follows a recording. Runs on the event loop; files are read in threads of its own."""

    def __init__(self, pages: Pages, workspace: Workspace, recording: FollowedRecording, camera: Camera | None) -> None:
        self._pages = pages
        self._workspace = workspace
        self._recording = recording
        self._half_view_rad = _half_view_rad(camera)
        self._thread = ThreadPoolExecutor(max_workers=2, thread_name_prefix="following")
        self._survey = GrowingSurvey(workspace.session.options.gating)
        self._placements = np.zeros((0, 3))
        self._surveyed_at, self._survey_took_s, self._is_behind = 0.0, 0.0, True
        self._searching: asyncio.Task[None] | None = None
        self._written_at = time.monotonic()
        self._intervals_s: deque[float] = deque(maxlen=_REMEMBERED_WRITES)
        self._age_s: float | None = None
        self._state: FollowState = "complete" if recording.is_complete else "live"
        self._problem = ""
        self.note = self._note()

    async def run(self) -> None:
        """Follow the recording until it can no longer be followed."""
        try:
            while not self._problem:
                await self._look()
                await asyncio.sleep(_LOOK_EVERY_S)
        finally:
            if self._searching is not None:
                self._searching.cancel()
            self._thread.shutdown(wait=True, cancel_futures=True)

    async def _look(self) -> None:
        try:
            growth = await self._in_thread(self._grow)
        except (CalibrationError, OSError) as error:
            self._problem = f"{sentence(str(error))} All clicks are kept."
            self._state = "ended"
            self._tell()
            return
        if growth.messages or growth.completed:
            self._take(growth)
        self._is_behind = self._is_behind or growth.scans > 0
        wait_s = max(_SURVEY_EVERY_S, self._survey_took_s / _SURVEY_SHARE)
        if self._is_behind and self._searching is None and time.monotonic() - self._surveyed_at >= wait_s:
            self._is_behind = False
            self._searching = asyncio.get_running_loop().create_task(self._look_for_placements())
            self._searching.add_done_callback(self._searched)
        self._tell()

    def _grow(self) -> Growth:
        """Take in what is new; clicks whose windows have got new scans are solved again."""
        recording = self._recording
        scans = len(recording.radar_times)
        growth = recording.grow()
        if growth.frames or growth.scans:
            later = TimeNs(int(recording.radar_times[scans])) if growth.scans else None
            self._workspace.extend(recording.image_times, later)
        return growth

    def _take(self, growth: Growth) -> None:
        now = time.monotonic()
        if growth.messages:
            self._intervals_s.append(now - self._written_at)
            self._written_at = now
            self._state = "live"
        if self._recording.is_complete:
            self._state = "complete"
        if growth.frames:
            times_ns = self._recording.image_times
            self._age_s = _age_s(int(times_ns[-1]))
            self._pages.grown(len(times_ns))
            first = len(times_ns) - growth.frames
            self._pages.broadcast(FramesAdded(first, StampColumns.of(times_ns[first:])), f"frames from {first}")
        if growth.completed:
            self._pages.concluded()

    async def _look_for_placements(self) -> None:
        started = time.monotonic()
        survey = await self._in_thread(self._search)
        self._surveyed_at = time.monotonic()
        self._survey_took_s = self._surveyed_at - started
        self._placements = np.array([placement.position_radar_m for placement in survey.placements]).reshape(-1, 3)
        self._pages.surveyed(survey)

    def _searched(self, task: "asyncio.Task[None]") -> None:
        self._searching = None
        if not task.cancelled() and (error := task.exception()) is not None:
            _log.warning("the radar could not be searched for placements: %s", error)

    def _search(self) -> Survey:
        """Read the scans that are new, and search all of them for placements.

        The newest scan waits for the next time: of a driver that sends one message per return, only a part of it may be there.
        """
        recording, until = self._recording, self._survey.until
        times_ns = recording.radar_times if recording.is_complete else recording.radar_times[:-1]
        new = times_ns[times_ns > until] if until is not None else times_ns
        for first in range(0, len(new), _SCANS_AT_ONCE):
            last = min(first + _SCANS_AT_ONCE, len(new)) - 1
            self._survey.note(recording.radar_scans(TimeNs(int(new[first])), TimeNs(int(new[last]))))
        return self._survey.survey(recording.image_times)

    def _note(self) -> FollowNote:
        quiet_s = time.monotonic() - self._written_at
        every_s = float(np.median(self._intervals_s)) if len(self._intervals_s) > 1 else None
        state = self._state
        if state == "live" and quiet_s > max(_QUIET_AFTER_S, _SLOW_WRITES * (every_s or 0.0)):
            state = "quiet"
        words = pace_words(Pace(state, quiet_s, every_s, self._age_s, self._problem))
        outcome = self._workspace.session.outcome
        best = outcome.next_placement if isinstance(outcome, Calibration) else None
        coverage = placement_coverage(self._placements, half_view_rad=self._half_view_rad)
        return FollowNote(state, words, advice_words(coverage, best))

    def _tell(self) -> None:
        """Tell the pages how the recording goes on, if that has changed."""
        note = self._note()
        if note != self.note:
            self.note = note
            self._pages.broadcast(note, "following")

    async def _in_thread(self, work: Callable[[], Answer]) -> Answer:
        return await asyncio.get_running_loop().run_in_executor(self._thread, partial(work))


def _age_s(stamp_ns: int) -> float | None:
    """Return how long ago a stamp was by this machine's clock [s]; None if that clock and the stamp's do not fit."""
    age_s = (time.time_ns() - stamp_ns) / NS_PER_S
    return max(0.0, age_s) if -_CLOCK_OFF_S <= age_s <= _MOST_AGE_S else None


def _half_view_rad(camera: Camera | None) -> float:
    """Return the largest bearing at which a placement is in the image, and within the radar's good angles [rad]."""
    if camera is None:
        return float(_WIDEST_HALF_VIEW_RAD)
    edge = camera.rays(np.array([[0.0, (camera.height_px - 1) / 2]]))[0]
    return float(min(np.arctan2(abs(edge[0]), edge[2]), _WIDEST_HALF_VIEW_RAD))
