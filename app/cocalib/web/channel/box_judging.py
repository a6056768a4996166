"""Judging the calibration by the boxes of the page, in the background: only the newest boxes and calibration count."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.evaluation import BoxFigures
from calib_core.measurements import Boxes
from calib_core.recordings import Recording
from calib_core.results import Calibration
from cocalib.evaluation.evaluating import Evidence, evidence_in, judged
from cocalib.platform.error_boundary import error_boundary
from cocalib.view import sentence
from cocalib.view.box_rows import BoxedReturn, acc_panel, no_acc, returns_in_frame
from cocalib.view.model import AccPanel
from cocalib.workspace import Judged, Workspace

_log = logging.getLogger(__name__)


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
