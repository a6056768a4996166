"""Report on the calibration of a session as `cocalib report` does."""

import hashlib
from dataclasses import replace
from pathlib import Path

from calib_core.recordings import Recording
from calib_core.results import InputFile
from cocalib.batch.running.judging import JudgedSession
from cocalib.batch.running.solving import CALIBRATION_FILE, SolvedSession
from cocalib.evaluation.recording_check import judged_calibration, other_camera
from cocalib.report import Judged, report_html, subject_of, watched

REPORT_FILE = "report.html"


def report_session(solved: SolvedSession, judged: JudgedSession | None, recording: Recording) -> str:
    """Return the report as HTML.

    Args:
        solved: the session.
        judged: what the recording says of it; None if that is not known.
        recording: open.

    Raises:
        CalibrationError: the recording's camera is another one, or the recording can no longer be read.
    """
    calibration = judged_calibration(solved.found, Path(CALIBRATION_FILE), recording).calibration
    doubts = other_camera(solved.found, recording.camera())
    data = solved.files[CALIBRATION_FILE]
    own = InputFile(CALIBRATION_FILE, len(data), hashlib.sha256(data).hexdigest())
    subject = replace(
        subject_of(solved.found, calibration, CALIBRATION_FILE),
        inputs=(own,),
        recording=watched(recording, calibration, recording.fingerprint(), doubts),
        judged=None if judged is None else Judged(judged.evaluation, solved.clicks),
    )
    return report_html(subject)
