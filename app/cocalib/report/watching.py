"""What a report takes from a recording: its files' hashes, topics, warnings, and one frame to draw over."""

from collections.abc import Sequence

import numpy as np

from calib_core.errors import CalibrationError
from calib_core.interchange import CheckResult
from calib_core.measurements import TimeNs, time_parts
from calib_core.recordings import Recording
from calib_core.results import Calibration, DataWarning, InputFile
from cocalib.report.subject import Picture, Watched

_WIDTH_PX = 640
_QUALITY = 70


def watched(
    recording: Recording,
    calibration: Calibration | None,
    inputs: tuple[InputFile, ...],
    doubts: Sequence[CheckResult] = (),
) -> Watched:
    """Return what the report takes from a recording.

    Args:
        recording: open.
        calibration: whose pairs choose the frame.
        inputs: the recording's files, by their content.
        doubts: whether it is a recording of the calibration's camera.
    """
    topics = (
        ("radar", recording.radar_topic, recording.radar_clock),
        ("pictures", recording.image_topic, recording.image_clock),
    )
    return Watched(
        name=recording.name,
        inputs=inputs,
        topics=tuple((what, f"{name}, by {clock} stamps" if clock else name) for what, name, clock in topics if name),
        warnings=(*(DataWarning(one.code, one.message, one.hint) for one in doubts), *recording.warnings),
        picture=_picture(recording, calibration),
    )


def _picture(recording: Recording, calibration: Calibration | None) -> Picture | None:
    """Return the frame of the first pair in the recording, else the middle one; None if it cannot be read or has another size."""
    if calibration is None or not len(recording.image_times):
        return None
    index = _frame(recording, calibration)
    try:
        pixels = recording.image(index)
    except CalibrationError:
        return None
    height, width = pixels.shape[:2]
    if (width, height) != (calibration.camera.width_px, calibration.camera.height_px):
        return None
    import cv2

    size = min(_WIDTH_PX, width), max(1, round(height * min(_WIDTH_PX, width) / width))
    grey = cv2.cvtColor(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY)
    _, jpeg = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    sec, nanosec = time_parts(TimeNs(int(recording.image_times[index])))
    return Picture(jpeg.tobytes(), f"the frame at {sec}.{nanosec:09d} s")


def _frame(recording: Recording, calibration: Calibration) -> int:
    times = sorted(pair.image_time for pair in calibration.pairs if pair.image_time is not None)
    for time in times:
        index = int(np.searchsorted(recording.image_times, time))
        if index < len(recording.image_times) and recording.image_times[index] == time:
            return index
    return len(recording.image_times) // 2
