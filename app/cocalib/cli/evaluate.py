"""`cocalib evaluate`: judge a calibration on a recording."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.exit_codes import exit_code
from cocalib.cli.flags import Require, Switch, called
from cocalib.cli.judging_flags import Judging, JudgingFlags
from cocalib.cli.output import progress_bar, tell_choices
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.evaluation import Evaluation
    from calib_core.interchange import ImportedCalibration


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Judge a calibration on a recording: residuals at clicks (AED, CDSD), radar returns in boxes (Acc)."""

    calibration: Annotated[Path | None, tyro.conf.Positional, called("CALIBRATION")] = None
    """A calibration in any format that import reads."""
    no_held_out: Switch = False
    """Leave out the held-out figures, which take a solve per placement."""
    json: Switch = False
    """Print one JSON object instead of text."""
    require: Require = None
    """Exit code 3 for a calibration whose verdict is below this."""
    judging: Judging = field(default_factory=JudgingFlags)

    def run(self) -> int:
        """Print the figures; return the exit code."""
        from calib_core.evaluation import evaluation_json, evaluation_lines
        from cocalib.evaluation.evaluating import evaluation_exit_code

        if self.calibration is None or not self.judging.recording:
            raise InputError("evaluate needs a calibration and a recording; see cocalib evaluate --help")
        found, evaluation = self._evaluation(self.calibration)
        verdict = found.file.verdict if found.file is not None else None
        code = evaluation_exit_code(evaluation) or exit_code(verdict, found.evidence, self.require)
        if self.json:
            names = [path.name for path in self.judging.recording]
            print_exactly(
                evaluation_json(evaluation, calibration=self.calibration.name, recording=names, exit_code=code)
            )
        else:
            print("\n".join(evaluation_lines(evaluation)))
            if verdict is not None:
                print(f"verdict when it was solved: {verdict.line}")
        return code

    def _evaluation(self, path: Path) -> "tuple[ImportedCalibration, Evaluation]":
        from cocalib.evaluation.evaluating import evaluate_recording
        from cocalib.evaluation.recording_check import judged_calibration

        options = self.judging.evidence.options()
        camera = self.judging.read_camera()
        with self.judging.recorded.open(require=("radar",)) as recording:
            judged = judged_calibration(self.judging.frames.read([path])[0], path, recording, camera=camera)
            clicks, boxes, labels = self.judging.evidence.found_in(
                recording, self.judging.recording, [judged.found], path.name
            )
            with progress_bar("evaluating") as progress:
                evaluation = evaluate_recording(
                    judged.calibration,
                    recording,
                    clicks=clicks,
                    boxes=boxes,
                    labels=labels,
                    held_out=not self.no_held_out,
                    progress=progress,
                    options=options,
                )
            tell_choices(recording)
            return judged.found, replace(evaluation, warnings=(*judged.warnings, *evaluation.warnings))
