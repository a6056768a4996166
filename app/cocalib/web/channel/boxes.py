"""Boxes of the page, in the background: followed through the pictures, a few at a time, and the calibration judged by them."""

import asyncio
import logging
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from calib_core.boxes.tracking import LostBox, TrackedBox, follow_box
from calib_core.camera import Camera
from calib_core.errors import CalibrationError, InputError
from calib_core.evaluation import BoxFigures
from calib_core.measurements import Boxes
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.evaluation.evaluating import Evidence, evidence_in, judged
from cocalib.platform.error_boundary import error_boundary
from cocalib.session.boxes_in_frames import Followed, PlacedBox, Start, Stretch, stretches_of
from cocalib.view import sentence
from cocalib.view.box_rows import BoxedReturn, acc_panel, no_acc, returns_in_frame
from cocalib.view.model import AccPanel
from cocalib.web.messages import Progress
from cocalib.workspace import Judged, Workspace

_AT_ONCE_S = 0.15
"""Work is handed out in pieces of this length: a newer box waits no longer [s]."""
_TELL_EVERY_S = 0.6
"""Pages are told no more often [s]."""
_FOLLOWING = "Following boxes"
_log = logging.getLogger(__name__)
_KEPT_PICTURES = 12
"""Decoded pictures in memory, for boxes that are followed through the same frames."""
_HALVED_ABOVE_PX = 1300
"""Wider pictures are halved while they are decoded, which takes half the time [px]."""
Picture: TypeAlias = tuple[np.ndarray, float]
"""A grey picture of 8 bits, and its size relative to the recorded one."""


class BoxJudging:
    """Computes Acc for the newest boxes and the calibration on the page. Runs on the event loop; computes in a thread."""

    def __init__(
        self, workspace: Workspace, recording: Recording, executor: Executor, is_waiting: Callable[[], bool]
    ) -> None:
        """Set up the work.

        Args:
            workspace: has boxes and calibration, and takes in what was found.
            recording: has the radar.
            executor: where it is computed.
            is_waiting: whether the boxes are still being followed; they are judged afterwards.
        """
        self._workspace = workspace
        self._recording = recording
        self._executor = executor
        self._is_waiting = is_waiting
        self._judged: Judged | None = None
        self._evidence: tuple[Boxes, Camera, Evidence] | None = None
        self._figures: BoxFigures | None = None
        self._task: asyncio.Task[None] | None = None

    def judge(self) -> None:
        """Judge the present calibration by the present boxes, if they have not been judged."""
        if not self._workspace.session.boxes and self._workspace.acc == AccPanel():
            return
        if (
            self._workspace.to_judge != self._judged
            and not self._is_waiting()
            and (self._task is None or self._task.done())
        ):
            self._task = asyncio.get_running_loop().create_task(self._run())

    async def close(self) -> None:
        """Judge no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    def returns(self, frame: int) -> tuple[BoxedReturn, ...]:
        """Return the moving targets' returns in a frame, with the boxes they belong to."""
        figures, workspace = self._figures, self._workspace
        if figures is None or not workspace.session.boxes:
            return ()
        return returns_in_frame(figures, int(workspace.facts.image_times[frame]), workspace.carried, frame)

    async def _run(self) -> None:
        with error_boundary("judging the calibration by boxes", _log.error):
            while (wanted := self._workspace.to_judge) != self._judged and not self._is_waiting():
                self._judged = wanted
                if self._workspace.session.boxes:
                    self._workspace.show_acc(replace(self._workspace.acc, judging=True), wanted)
                work = partial(self._panel, self._workspace.boxes, wanted[1])
                panel = await asyncio.get_running_loop().run_in_executor(self._executor, work)
                if self._workspace.to_judge == wanted:
                    self._workspace.show_acc(panel, wanted)

    def _panel(self, boxes: Boxes, calibration: Calibration | None) -> AccPanel:
        self._figures = None
        if not len(boxes):
            return AccPanel()
        if calibration is None:
            return no_acc(
                "There is no calibration to judge yet: click reflectors, or open the recording with --calibration."
            )
        if not len(self._recording.radar_times):
            return no_acc("There is no radar in this recording, so nothing can be in the boxes.")
        try:
            evaluation = judged(calibration, self._found(boxes, calibration.camera), held_out=False)
        except CalibrationError as error:
            return no_acc(sentence(str(error)))
        self._figures = evaluation.boxes
        return acc_panel(evaluation)

    def _found(self, boxes: Boxes, camera: Camera) -> Evidence:
        """Return what the recording says with these boxes; the same boxes are looked up once."""
        kept = self._evidence
        if kept is None or kept[0] != boxes or kept[1] is not camera:
            kept = self._evidence = (boxes, camera, evidence_in(self._recording, camera, boxes=boxes))
        return kept[2]


class BoxFollowing:
    """Follows the boxes of a session. Runs on the event loop; the pictures are searched in a thread."""

    def __init__(
        self, workspace: Workspace, recording: Recording, executor: Executor, tell: Callable[[Progress], None]
    ) -> None:
        """Set up the work.

        Args:
            workspace: has the boxes, and takes in what was followed.
            recording: has the pictures.
            executor: where they are searched.
            tell: takes the progress.
        """
        self._workspace = workspace
        self._executor = executor
        self._tell = tell
        self._follower = BoxFollower(GreyPictures(recording), lambda: len(workspace.facts.image_times))
        self._wanted: tuple[Stretch, ...] = ()
        self._taken: tuple[Stretch, ...] = ()
        self._stopping = False
        self._is_last = False
        self._task: asyncio.Task[None] | None = None

    def follow(self) -> None:
        """Follow the boxes as they are now."""
        facts, tracks = self._workspace.facts, self._workspace.session.boxes
        self._wanted = tuple(stretch for track in tracks if track.is_carried for stretch in stretches_of(track, facts))
        if self._wanted != self._taken and (self._task is None or self._task.done()):
            self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def is_busy(self) -> bool:
        """Whether there is something left to follow."""
        return self._task is not None and not self._task.done() and not self._is_last

    def stop(self) -> None:
        """End what is still being followed where it is now."""
        self._stopping = self._task is not None and not self._task.done()

    async def close(self) -> None:
        """Follow no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        with error_boundary("following boxes", _log.error):
            told, self._is_last = time.monotonic(), False
            while self._wanted != self._taken or not self._follower.is_done:
                if self._wanted != self._taken:
                    self._taken = self._wanted
                    self._follower.want(self._order(self._taken))
                if self._stopping:
                    self._follower.stop()
                await asyncio.get_running_loop().run_in_executor(self._executor, self._follower.go_on, _AT_ONCE_S)
                if time.monotonic() - told > _TELL_EVERY_S:
                    told = time.monotonic()
                    self._show()
            self._stopping, self._is_last = False, True
            self._show()

    def _order(self, stretches: tuple[Stretch, ...]) -> list[Stretch]:
        """Return the stretches so that those not begun so far come last: they are followed first."""
        begun = self._follower.followed
        return sorted(stretches, key=lambda stretch: stretch.start not in begun)

    def _show(self) -> None:
        self._tell(Progress(_FOLLOWING, *self._follower.progress))
        self._workspace.show_followed(self._follower.followed)


class GreyPictures:
    """Decodes the frames of a recording as grey pictures; the last ones are kept."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._kept: OrderedDict[int, Picture] = OrderedDict()

    def __call__(self, frame: int) -> Picture:
        """Return a picture.

        Raises:
            CalibrationError: it cannot be read or decoded.
        """
        import cv2

        if frame in self._kept:
            self._kept.move_to_end(frame)
            return self._kept[frame]
        encoded = self._recording.image_bytes(frame)
        halved = encoded.width_px > _HALVED_ABOVE_PX
        flag = cv2.IMREAD_REDUCED_GRAYSCALE_2 if halved else cv2.IMREAD_GRAYSCALE
        grey = cv2.imdecode(np.frombuffer(encoded.data, dtype=np.uint8), flag | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise InputError(f"frame {frame + 1} cannot be decoded")
        self._kept[frame] = (np.asarray(grey), 0.5 if halved else 1.0)
        while len(self._kept) > _KEPT_PICTURES:
            self._kept.popitem(last=False)
        return self._kept[frame]


@dataclass(slots=True)
class _Run:
    """One box that is being followed; `steps` is where the work goes on."""

    start: Start
    steps: Iterator[TrackedBox | LostBox]
    boxes: list[PlacedBox] = field(default_factory=list)
    ended: str = ""


class BoxFollower:
    """Follows boxes as far as they are wanted, and keeps what was followed. One caller at a time."""

    def __init__(self, picture: Callable[[int], Picture], count: Callable[[], int]) -> None:
        """Set up the work.

        Args:
            picture: decodes a frame.
            count: number of frames that there are now.
        """
        self._picture = picture
        self._count = count
        self._runs: dict[Start, _Run] = {}
        self._wanted: tuple[Stretch, ...] = ()

    def want(self, stretches: Sequence[Stretch]) -> None:
        """Follow these from now on, the last ones first; what belongs to none of them is dropped."""
        self._wanted = tuple(stretches)
        starts = {stretch.start for stretch in stretches}
        self._runs = {start: run for start, run in self._runs.items() if start in starts}

    def stop(self) -> None:
        """End what is still being followed where it is now."""
        for stretch in self._wanted:
            if not self._is_done(stretch):
                self._run(stretch.start).ended = "following it was stopped"

    @property
    def followed(self) -> dict[Start, Followed]:
        """What is known from each start."""
        return {start: Followed(tuple(run.boxes), run.ended) for start, run in list(self._runs.items())}

    @property
    def progress(self) -> tuple[int, int]:
        """How many frames of those wanted are done, and how many there are."""
        done = sum(stretch.length if self._is_done(stretch) else len(self._boxes(stretch)) for stretch in self._wanted)
        return done, sum(stretch.length for stretch in self._wanted)

    @property
    def is_done(self) -> bool:
        """Whether everything wanted has been followed."""
        return all(map(self._is_done, self._wanted))

    def go_on(self, for_s: float) -> None:
        """Follow some more.

        Args:
            for_s: return after so long [s], or when all is done.
        """
        end = time.monotonic() + for_s
        for stretch in reversed(self._wanted):
            while not self._is_done(stretch):
                self._advance(self._run(stretch.start))
                if time.monotonic() > end:
                    return

    def _is_done(self, stretch: Stretch) -> bool:
        run = self._runs.get(stretch.start)
        if run is None:
            return stretch.length == 0
        return run.ended != "" or len(run.boxes) >= stretch.length

    def _boxes(self, stretch: Stretch) -> Sequence[PlacedBox]:
        run = self._runs.get(stretch.start)
        return run.boxes if run else ()

    def _run(self, start: Start) -> _Run:
        if start not in self._runs:
            self._runs[start] = _Run(start, self._steps(start))
        return self._runs[start]

    def _steps(self, start: Start) -> Iterator[TrackedBox | LostBox]:
        """Follow a box from its start on; edges are those of the recorded pictures."""
        _, scale = self._picture(start.frame)
        for step in follow_box(self._pictures(start.frame), _scaled(start.edges_px, scale)):
            yield step if isinstance(step, LostBox) else TrackedBox(_scaled(step.edges_px, 1 / scale), step.confidence)

    def _pictures(self, first: int) -> Iterator[np.ndarray]:
        frame = first
        while frame < self._count():
            yield self._picture(frame)[0]
            frame += 1

    def _advance(self, run: _Run) -> None:
        try:
            step = next(run.steps, None)
        except CalibrationError as error:
            run.ended = str(error)
            return
        if step is None:
            run.ended = "the recording ends"
        elif isinstance(step, LostBox):
            run.ended = step.reason
        else:
            left, top, right, bottom = (round(value, 2) for value in step.edges_px)
            frame = run.start.frame + len(run.boxes) + 1
            run.boxes.append(PlacedBox(frame, (left, top, right, bottom), "followed", round(step.confidence, 3)))


def _scaled(edges_px: tuple[float, float, float, float], scale: float) -> tuple[float, float, float, float]:
    """Return the edges in a picture of another size; the picture's own edge is half a pixel outside the outermost centres."""
    left, top, right, bottom = (scale * (value + 0.5) - 0.5 for value in edges_px)
    return left, top, right, bottom
