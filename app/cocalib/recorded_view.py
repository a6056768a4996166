"""What overlay videos and Rerun show of a recording with its calibration: pairs, boxes, figures, and what the colours mean."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.detections import Box, Boxes
from calib_core.errors import InputError
from calib_core.evaluation.figures import Evaluation
from calib_core.measurements import ReflectorClick, TimeNs
from calib_core.recordings import Recording
from calib_core.results import Calibration, PairResult
from cocalib.evaluating import evaluate_recording
from cocalib.seen_returns import ReturnColours, ReturnQuantity, return_colours
from cocalib.solving.solving import check_clicks


@dataclass(frozen=True, slots=True, eq=False)
class RecordedView:
    """A recording with a calibration and what is known of it.

    Attributes:
        recording: with a radar and a camera.
        calibration: to project with.
        pairs: clicks in frames of this recording, with their radar positions and residuals under the calibration.
        colours: of the returns.
        boxes: around objects; None without any.
        evaluation: the figures; None if neither clicks nor boxes were given.
        against: another calibration to compare with.
    """

    recording: Recording
    calibration: Calibration
    pairs: tuple[PairResult, ...]
    colours: ReturnColours
    boxes: Boxes | None = None
    evaluation: Evaluation | None = None
    against: Calibration | None = None

    def pairs_by_frame(self) -> dict[TimeNs, tuple[PairResult, ...]]:
        """Return the pairs of each frame that has any."""
        frames: dict[TimeNs, tuple[PairResult, ...]] = {}
        for pair in self.pairs:
            if pair.image_time is not None:
                frames[pair.image_time] = (*frames.get(pair.image_time, ()), pair)
        return frames

    def boxes_by_frame(self) -> dict[TimeNs, tuple[Box, ...]]:
        """Return the boxes of each annotated frame."""
        return {frame.image_time: frame.boxes for frame in self.boxes} if self.boxes else {}

    def acc_by_frame(self) -> dict[TimeNs, float]:
        """Return Acc, 0 to 1, of each frame that counts."""
        figures = self.evaluation.boxes if self.evaluation else None
        counted = [frame for frame in figures.frames if frame.returns] if figures else []
        return {frame.image_time: frame.share for frame in counted}


def recorded_view(
    recording: Recording,
    calibration: Calibration,
    quantity: ReturnQuantity,
    *,
    clicks: Sequence[ReflectorClick] = (),
    boxes: Boxes | None = None,
    against: Calibration | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RecordedView:
    """Collect what is to be shown.

    Args:
        recording: with a radar and a camera.
        calibration: to project with.
        quantity: what the colours of returns show.
        clicks: in frames of this recording; without any, those that the calibration was made from, if they are of its frames.
        boxes: around objects.
        against: another calibration.
        progress: of the evaluation.

    Raises:
        InputError: there are no scans, or the pictures are not those of the calibration's camera.
    """
    if not len(recording.radar_times):
        raise InputError(f"{recording.name}: {recording.radar_topic} has no scans; choose another with --radar-topic")
    for one in (calibration, against) if against else (calibration,):
        _require_same_size(recording, one)
    pairs = check_clicks(recording, clicks, calibration, calibration.options) if clicks else ()
    evaluation = None
    if clicks or boxes:
        evaluation = evaluate_recording(
            calibration, recording, clicks=clicks, boxes=boxes, held_out=False, progress=progress
        )
    return RecordedView(
        recording,
        calibration,
        pairs or _own_pairs(recording, calibration),
        return_colours(recording, quantity),
        boxes=boxes,
        evaluation=evaluation,
        against=against,
    )


def box_words(box: Box) -> str:
    """Return what is written at a box: its class and its track, the class only once."""
    return (
        box.track if box.label and box.track.startswith(box.label) else " ".join(filter(None, (box.label, box.track)))
    )


def _own_pairs(recording: Recording, calibration: Calibration) -> tuple[PairResult, ...]:
    """Return the calibration's pairs if they are of this recording's frames, else none."""
    pairs = [pair for pair in calibration.pairs if pair.image_time is not None]
    times = np.array([pair.image_time for pair in pairs], dtype=np.int64)
    return tuple(pairs) if len(pairs) and bool(np.isin(times, recording.image_times).all()) else ()


def _require_same_size(recording: Recording, calibration: Calibration) -> None:
    picture, camera = recording.image_bytes(0), calibration.camera
    if (picture.width_px, picture.height_px) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{recording.name}: its pictures have {picture.width_px} x {picture.height_px} px, but the calibration's camera has "
            f"{camera.width_px} x {camera.height_px} px; give a calibration of this camera, or other topics"
        )
