"""`cocalib compare`: which of two calibrations is better, by how much, and is it more than noise?"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import Switch, called
from cocalib.cli.judging_flags import EvidenceFlags, Judging, JudgingFlags
from cocalib.cli.output import progress_bar
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.evaluation import PairedDifference
    from cocalib.evaluation.comparing import ComparedOnRecording

COMPARISON_SCHEMA = "cocalib/comparison-1"


@dataclass(frozen=True, slots=True)
class Compare:
    """Compare two calibrations; with a recording, say which is better there, and whether that is more than noise."""

    a: Annotated[Path | None, tyro.conf.Positional, called("A")] = None
    """A calibration in any format that import reads."""
    b: Annotated[Path | None, tyro.conf.Positional, called("B")] = None
    """Another calibration of the same sensors."""
    same_sensors: Switch = False
    """Radar and camera are the same in both, although serials, topics or intrinsics are not."""
    same_person: Switch = False
    """The same person clicked the same reflector in both, so what those get wrong cancels, too."""
    json: Switch = False
    """Print one JSON object instead of text."""
    judging: Judging = field(default_factory=JudgingFlags)

    def run(self) -> int:
        """Print the comparison; return the exit code."""
        from calib_core.interchange import compare

        if self.a is None or self.b is None:
            raise InputError("compare needs two calibrations; see cocalib compare --help")
        if not self.judging.recording and self.judging.evidence != EvidenceFlags():
            raise InputError("clicks and boxes are those of a recording; give it too: cocalib compare A B RECORDING")
        camera = self.judging.read_camera()
        found_a, found_b = (self.judging.frames.read([path])[0] for path in (self.a, self.b))
        compared = None
        if self.judging.recording:
            compared, camera = self._on_recording(self.a, self.b, camera)
        both = compare(found_a, found_b, camera=camera, same_sensors=self.same_sensors, same_person=self.same_person)
        figures = [(row.label, row.text) for row in both.figures]
        if self.json:
            print_exactly(_json(self.a.name, self.b.name, figures, both.verdict, compared))
            return 0
        if compared is not None:
            from cocalib.evaluation.comparing import comparison_lines

            print("\n".join(comparison_lines(compared)))
        print("\n".join([*both.lines(), both.verdict]))
        return 0

    def _on_recording(self, a: Path, b: Path, camera: "Camera | None") -> "tuple[ComparedOnRecording, Camera]":
        """Judge both on the recording; also return the lens to compare their poses through."""
        from cocalib.evaluation.comparing import compare_on_recording
        from cocalib.evaluation.recording_check import judged_calibration

        options = self.judging.evidence.options()
        with self.judging.recorded.open(require=("radar",)) as recording:
            of_a, of_b = (
                judged_calibration(self.judging.frames.read([one])[0], one, recording, camera=camera) for one in (a, b)
            )
            clicks, boxes, labels = self.judging.evidence.found_in(
                recording, self.judging.recording, [of_a.found, of_b.found], "the two"
            )
            with progress_bar("comparing") as progress:
                compared = compare_on_recording(
                    (of_a.calibration, of_b.calibration),
                    recording,
                    names=(a.name, b.name),
                    clicks=clicks,
                    boxes=boxes,
                    labels=labels,
                    progress=progress,
                    options=options,
                )
            return compared, of_a.calibration.camera


def _json(a: str, b: str, figures: list[tuple[str, str]], verdict: str, compared: "ComparedOnRecording | None") -> str:
    from calib_core.evaluation import evaluation_document
    from calib_core.interchange.syntax.strict_json import json_text

    document: dict[str, Any] = {
        "schema": COMPARISON_SCHEMA,
        "a": a,
        "b": b,
        "figures": [{"label": label, "text": text} for label, text in figures],
        "verdict": verdict,
        "on_recording": None,
    }
    if compared is not None:
        document["on_recording"] = {
            "winner": compared.winner,
            "residuals_px": _difference(compared.residuals),
            "acc": _difference(compared.acc),
            "solved_from_these_clicks": list(compared.fitted),
            "evaluation_a": evaluation_document(compared.a),
            "evaluation_b": evaluation_document(compared.b),
        }
    return json_text(document)


def _difference(found: "PairedDifference | None") -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "b_minus_a": found.mean,
        "standard_error": found.standard_error,
        "low": found.low,
        "high": found.high,
        "p_value": found.p_value,
        "groups": found.groups,
        "winner": found.winner,
    }
