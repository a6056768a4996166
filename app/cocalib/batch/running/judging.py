"""Judge the calibration of a session on its own recording as `cocalib evaluate --json` does."""

from dataclasses import dataclass, replace
from pathlib import Path

from calib_core.evaluation import Evaluation, evaluation_json
from calib_core.recordings import Recording
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.running.solving import CALIBRATION_FILE, SolvedSession
from cocalib.evaluation.boxes import find_boxes
from cocalib.evaluation.evaluating import EvidenceOptions, evaluate_recording, evaluation_exit_code
from cocalib.evaluation.recording_check import judged_calibration

EVALUATION_FILE = "evaluation.json"


@dataclass(frozen=True, slots=True, eq=False)
class JudgedSession:
    """What the recording says of the calibration.

    Attributes:
        evaluation: of what was found in the recording.
        text: of evaluation.json, with what the recording says of the lens.
    """

    evaluation: Evaluation
    text: str


def judge_session(row: ManifestRow, solved: SolvedSession, recording: Recording) -> JudgedSession:
    """Judge a calibration by the clicks that it was solved from, and by boxes if the row names some.

    Raises:
        CalibrationError: the boxes cannot be read, or are of another recording.
    """
    judged = judged_calibration(solved.found, Path(CALIBRATION_FILE), recording)
    boxes = None if row.boxes is None else find_boxes(str(row.boxes), recording)
    evaluation = evaluate_recording(
        judged.calibration, recording, clicks=solved.clicks, boxes=boxes, options=EvidenceOptions()
    )
    told = replace(evaluation, warnings=(*judged.warnings, *evaluation.warnings))
    names = [path.name for path in row.recording]
    code = evaluation_exit_code(told)
    text = evaluation_json(told, calibration=CALIBRATION_FILE, recording=names, exit_code=code)
    return JudgedSession(evaluation, text)
