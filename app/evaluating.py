"""Judge a calibration on a recording."""

from collections.abc import Callable, Sequence

from calib_core.detections import Boxes, ReturnLabels
from calib_core.evaluation.figures import Evaluation
from calib_core.measurements import ReflectorClick
from calib_core.recordings import Recording
from calib_core.results import Calibration

__all__ = ["evaluate_recording"]


def evaluate_recording(
    calibration: Calibration,
    recording: Recording,
    *,
    clicks: Sequence[ReflectorClick] = (),
    boxes: Boxes | None = None,
    labels: ReturnLabels | None = None,
    held_out: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Judge a calibration."""
    return Evaluation(None, None)
