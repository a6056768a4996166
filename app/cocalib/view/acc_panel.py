"""What boxes around moving objects say about the calibration on the page: Acc, by class, and under the camera turned."""

from dataclasses import dataclass

import numpy as np

from calib_core.evaluation.figures import Axis, BoxFigures, ClassFigure, Evaluation, Sensitivity
from calib_core.evaluation.sentences import NOT_ACCURACY, sensitivity_sentences
from cocalib.view.model import Figure, WarningRow, warning_row
from cocalib.view.wording import sentence


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """Acc of the calibration turned about one axis of the camera.

    Attributes:
        axis: turned about.
        angles_deg: ascending.
        acc_percent: at each angle.
        values: at -1, 0 and +1 deg, formatted with their unit.
        words: what Acc sees of this axis, as a sentence.
        is_flat: it sees nothing of it.
    """

    axis: Axis
    angles_deg: tuple[float, ...]
    acc_percent: tuple[float, ...]
    values: tuple[str, ...]
    words: str
    is_flat: bool


@dataclass(frozen=True, slots=True)
class AccPanel:
    """What boxes say about the calibration on the page.

    Attributes:
        source: where the boxes come from; "" as long as there are none.
        boxes: how many there are.
        frames: how many frames are annotated.
        figures: Acc with its standard error, the frames that count, and what chance would give.
        classes: by label.
        sensitivity: one row per axis; empty where there is too little to judge the calibration by.
        caution: that Acc is not accuracy, or that there is too little to judge by; "" without figures.
        rule: which returns count and how they were matched; "" without figures.
        problem: why there are no figures; "" if there are, or nothing was judged so far.
        warnings: what the reader of the figures must know.
        busy: boxes are being found, or figures computed; those here belong to an earlier calibration.
    """

    source: str = ""
    boxes: int = 0
    frames: int = 0
    figures: tuple[Figure, ...] = ()
    classes: tuple[ClassFigure, ...] = ()
    sensitivity: tuple[SensitivityRow, ...] = ()
    caution: str = ""
    rule: str = ""
    problem: str = ""
    warnings: tuple[WarningRow, ...] = ()
    busy: bool = False


_SHOWN_DEG = (-1.0, 0.0, 1.0)
_FEWEST_TARGETS, _FEWEST_RETURNS = 3, 30
"""With fewer, one loosely drawn box decides what the figures say about the calibration."""


def acc_panel(evaluation: Evaluation) -> AccPanel:
    """Return what an evaluation says about boxes."""
    boxes = evaluation.boxes
    warnings = tuple(map(warning_row, evaluation.warnings))
    if boxes is None or boxes.acc is None:
        return AccPanel(problem="No return of anything that moves is in the frames with boxes.", warnings=warnings)
    returns = sum(frame.returns for frame in boxes.frames)
    if boxes.matched_targets < _FEWEST_TARGETS or returns < _FEWEST_RETURNS:
        caution = (
            f"Too little to judge the calibration by: {boxes.matched_targets} of {_FEWEST_TARGETS} targets with a box, "
            f"{returns} of {_FEWEST_RETURNS} returns."
        )
        others = tuple(warning for warning in warnings if warning.code != "turned-from-boxes")
        return AccPanel(
            figures=_figures(boxes),
            classes=boxes.classes,
            caution=caution,
            rule=sentence(boxes.rule),
            warnings=others,
        )
    words = sensitivity_sentences(boxes)
    return AccPanel(
        figures=_figures(boxes),
        classes=boxes.classes,
        sensitivity=tuple(_sensitivity(curve, text) for curve, text in zip(boxes.sensitivity, words, strict=True)),
        caution=sentence(NOT_ACCURACY),
        rule=sentence(boxes.rule),
        warnings=warnings,
    )


def _figures(boxes: BoxFigures) -> tuple[Figure, ...]:
    counting = sum(1 for frame in boxes.frames if frame.returns)
    zero = sum(1 for frame in boxes.frames if frame.returns and not frame.inside)
    error = boxes.acc_standard_error
    value = f"{100 * (boxes.acc or 0.0):.1f}" + (f" ± {100 * error:.1f}" if np.isfinite(error) else "")
    chance = boxes.chance
    return (
        Figure(
            "acc",
            "in their boxes (Acc)",
            value,
            "%",
            "Mean over the frames of the share of the moving targets' returns that are in their target's box, ± its standard "
            "error with neighboring frames taken together. It is not the accuracy of the pose.",
        ),
        Figure(
            "acc_frames",
            "frames",
            f"{counting}",
            "",
            f"Frames with boxes and with returns of moving targets. {zero} of them have no return in a box, and are counted.",
        ),
        Figure(
            "acc_targets",
            "targets with a box",
            f"{boxes.matched_targets} of {boxes.targets}",
            "",
            "Moving targets that the radar followed. The returns of those without a box count as outside.",
            "warning" if boxes.matched_targets < boxes.targets else "plain",
        ),
        Figure(
            "acc_chance",
            "by chance",
            "–" if chance is None else f"{100 * chance:.0f}",
            "%",
            "Acc of the same calibration turned by 10° to either side.",
        ),
    )


def _sensitivity(curve: Sensitivity, words: str) -> SensitivityRow:
    at = np.interp(_SHOWN_DEG, curve.angles_deg, curve.acc)
    return SensitivityRow(
        axis=curve.axis,
        angles_deg=curve.angles_deg,
        acc_percent=tuple(round(100 * value, 2) for value in curve.acc),
        values=tuple(_percent(float(value)) for value in at),
        words=sentence(words),
        is_flat=curve.is_flat,
    )


def _percent(share: float | None) -> str:
    return "–" if share is None or not np.isfinite(share) else f"{100 * share:.1f} %"
