"""The sheet Evaluate: boxes of a file or around what moves, and the calibration on the page judged by them in the background."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

from calib_core.boxes import boxes_from_bytes, changed_boxes
from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import Boxes
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.evaluation.evaluating import Evidence, evidence_in, judged
from cocalib.platform.error_boundary import error_boundary
from cocalib.view.acc_panel import AccPanel, acc_panel
from cocalib.view.reference import shown_calibration
from cocalib.view.wording import sentence
from cocalib.web.channel.outbox import Outbox
from cocalib.web.messages.incoming import BoxesWanted, MovingBoxesWanted
from cocalib.web.messages.outgoing import Outgoing, Progress, encode
from cocalib.workspace import Workspace

_WHAT_MOVES = "what moves"
_FINDING = "Looking for what moves"
_log = logging.getLogger(__name__)


class BoxService:
    """Takes boxes and tells all pages what they say. Runs on the event loop; finds, reads and computes in a thread."""

    def __init__(
        self, workspace: Workspace, recording: Recording, executor: Executor, tell: Callable[[Outgoing, str], None]
    ) -> None:
        """Set up the service.

        Args:
            workspace: has the calibration.
            recording: has images and radar.
            executor: where to compute.
            tell: sends a message of a kind to all pages.
        """
        self._workspace = workspace
        self._recording = recording
        self._executor = executor
        self._tell = tell
        self._panel = AccPanel()
        self._boxes: Boxes | None = None
        self._judged: tuple[Boxes, Calibration | None] | None = None
        self._evidence: tuple[Boxes, Camera, Evidence] | None = None
        self._finding: asyncio.Task[None] | None = None
        self._judging: asyncio.Task[None] | None = None

    def greet(self, outbox: Outbox) -> None:
        """Send the present figures to a page that has just opened."""
        outbox.put(encode(self._panel), kind="acc")

    async def take(self, wanted: BoxesWanted) -> None:
        """Take the boxes of a file.

        Raises:
            InputError: the file cannot be read, is of no known format, or belongs to another recording.
        """
        boxes = await asyncio.get_running_loop().run_in_executor(self._executor, self._read, wanted)
        if self._finding is not None:
            self._finding.cancel()
        self._take(boxes)

    def find(self, _wanted: MovingBoxesWanted) -> None:
        """Begin to look for what moves."""
        if self._finding is None or self._finding.done():
            self._finding = asyncio.get_running_loop().create_task(self._find())

    def follow(self) -> None:
        """Judge the calibration on the page, if it has not been judged by these boxes."""
        if self._wanted() is not None and (self._judging is None or self._judging.done()):
            self._judging = asyncio.get_running_loop().create_task(self._judge())

    async def close(self) -> None:
        """Find and judge no more."""
        for task in (self._finding, self._judging):
            if task is not None:
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)

    def _read(self, command: BoxesWanted) -> Boxes:
        facts = self._workspace.facts
        return boxes_from_bytes(
            command.content,
            command.name,
            image_times=facts.image_times,
            image_size_px=(facts.width_px, facts.height_px),
            image_names=self._recording.image_names,
        )

    async def _find(self) -> None:
        with error_boundary("looking for what moves", self._fail):
            facts, loop = self._workspace.facts, asyncio.get_running_loop()
            self._show(replace(self._panel, busy=True))

            def report(done: int, total: int) -> None:
                loop.call_soon_threadsafe(self._tell, Progress(_FINDING, done, total), "progress")

            find = partial(changed_boxes, self._recording.image, facts.image_times, source=_WHAT_MOVES, progress=report)
            try:
                self._take(await loop.run_in_executor(self._executor, find))
            except CalibrationError as error:
                self._show(AccPanel(problem=sentence(str(error))))
            finally:
                self._tell(Progress(_FINDING, 1, 1), "progress")

    def _take(self, boxes: Boxes) -> None:
        self._boxes = boxes
        self.follow()

    def _wanted(self) -> tuple[Boxes, Calibration | None] | None:
        """Return what is to be judged; None if it has been, and while there are no boxes or the calibration is being checked."""
        calibration = shown_calibration(self._workspace.session, self._workspace.reference)
        if self._boxes is None or (calibration is not None and calibration.checking):
            return None
        before = self._judged
        is_judged = before is not None and before[0] is self._boxes and before[1] is calibration
        return None if is_judged else (self._boxes, calibration)

    async def _judge(self) -> None:
        with error_boundary("judging the calibration by boxes", self._fail):
            while (wanted := self._wanted()) is not None:
                self._judged = wanted
                self._show(replace(self._panel, busy=True))
                panel = await asyncio.get_running_loop().run_in_executor(self._executor, self._figures, *wanted)
                boxes = wanted[0]
                count = sum(len(frame.boxes) for frame in boxes)
                self._show(replace(panel, source=boxes.source, boxes=count, frames=len(boxes)))

    def _figures(self, boxes: Boxes, calibration: Calibration | None) -> AccPanel:
        if calibration is None:
            return AccPanel(problem="There is no calibration to judge yet: click reflectors first.")
        if not len(self._recording.radar_times):
            return AccPanel(problem="There is no radar in this recording, so nothing can be in the boxes.")
        try:
            return acc_panel(judged(calibration, self._evidence_of(boxes, calibration.camera), held_out=False))
        except CalibrationError as error:
            return AccPanel(problem=sentence(str(error)))

    def _evidence_of(self, boxes: Boxes, camera: Camera) -> Evidence:
        """Return what the recording says with these boxes; the same boxes are looked up once."""
        kept = self._evidence
        if kept is None or kept[0] is not boxes or kept[1] is not camera:
            kept = self._evidence = (boxes, camera, evidence_in(self._recording, camera, boxes=boxes))
        return kept[2]

    def _fail(self, line: str) -> None:
        _log.error(line)
        self._show(AccPanel(problem=sentence(line)))

    def _show(self, panel: AccPanel) -> None:
        self._panel = panel
        self._tell(panel, "acc")
