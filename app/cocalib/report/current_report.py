"""The report on the calibration that the page has now: the same as on its downloaded file, over a frame of the recording."""

import hashlib
from dataclasses import replace

from calib_core.interchange import imported, read_calibration
from calib_core.recordings import Recording
from calib_core.results import InputFile
from cocalib.report.making import known_calibration, subject_of
from cocalib.report.page import report_html
from cocalib.report.watching import watched

_NAME = "calibration.json"


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
