"""From what was read to what is reported: the calibration with a camera, and a recording's part."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.input_files import name_text
from calib_core.interchange.check.slips import CheckResult
from calib_core.interchange.format import ImportedCalibration, imported
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.measurements import TimeNs, time_parts
from calib_core.recordings import Recording
from calib_core.results import Calibration, DataWarning, InputFile
from cocalib.evaluation.recording_check import calibration_of
from cocalib.platform.resources import version
from cocalib.recorded_view import seen_in
from cocalib.report.page import report_html
from cocalib.report.subject import Image, ReportSubject, Watched

_WIDTH_PX = 640
_QUALITY = 70
_NEAR_S = 0.3
_NAME = "calibration.json"


def subject_of(found: ImportedCalibration, calibration: Calibration | None, name: str) -> ReportSubject:
    """Return what is reported when nothing but the calibration is known.

    Args:
        found: what was read.
        calibration: the same with a camera, as `known_calibration` returns it.
        name: of the file, without its folder.
    """
    return ReportSubject(name_text(name), found, calibration, version())


def known_calibration(found: ImportedCalibration, name: str, *, camera: Camera | None) -> Calibration | None:
    """Return a calibration with the camera that it states, else with the given one; None if there is neither.

    Args:
        found: what was read.
        name: of the file, without its folder.
        camera: the user's intrinsics, or those of the recording.

    Raises:
        InputError: the file contradicts itself, or fails its own check point.
    """
    if found.file is None and found.camera is None and camera is None:
        return None
    return calibration_of(found, name_text(name), camera)


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
        ("images", recording.image_topic, recording.image_clock),
    )
    return Watched(
        name=recording.name,
        inputs=inputs,
        topics=tuple((what, f"{name}, by {clock} stamps" if clock else name) for what, name, clock in topics if name),
        warnings=(
            *(DataWarning.reported(doubt.code, doubt.message, doubt.hint) for doubt in doubts),
            *recording.warnings,
        ),
        image=_image(recording, calibration),
    )


def _image(recording: Recording, calibration: Calibration | None) -> Image | None:
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
    return Image(jpeg.tobytes(), f"the frame at {sec}.{nanosec:09d} s", _returns_px(recording, calibration, index))


def _returns_px(recording: Recording, calibration: Calibration, index: int) -> tuple[tuple[float, float], ...]:
    """Return where the returns of the scan nearest to a frame are in it."""
    if not recording.radar_topic:
        return ()
    time = TimeNs(int(recording.image_times[index]))
    seen = seen_in(calibration, recording.radar_scans_around((time,), _NEAR_S))
    return tuple((float(u), float(v)) for u, v in seen.pixels_px[seen.near(time)])


def _frame(recording: Recording, calibration: Calibration) -> int:
    times = sorted(pair.image_time for pair in calibration.pairs if pair.image_time is not None)
    for time in times:
        index = int(np.searchsorted(recording.image_times, time))
        if index < len(recording.image_times) and recording.image_times[index] == time:
            return index
    return len(recording.image_times) // 2


def current_report(text: str, recording: Recording) -> str:
    """Return the report as HTML.

    Args:
        text: of the calibration-1 file, as the page downloads it.
        recording: that it was solved from.
    """
    found = imported(read_calibration(text, _NAME))
    calibration = known_calibration(found, _NAME, camera=None)
    data = text.encode()
    own = InputFile(_NAME, len(data), hashlib.sha256(data).hexdigest())
    seen = watched(recording, calibration, recording.fingerprint())
    return report_html(replace(subject_of(found, calibration, _NAME), inputs=(own,), recording=seen))
