"""What boxes say about the calibration, as a value: Acc with what it can and cannot see."""

import numpy as np

from calib_core.evaluation import BoxFigures, Evaluation, Sensitivity
from calib_core.evaluation.sentences import NOT_ACCURACY, sensitivity_sentences
from cocalib.view.box_panel import AccPanel, ClassRow, SensitivityRow
from cocalib.view.figure import Figure
from cocalib.view.wording import sentence, warning_in_sentences

_SHOWN_DEG = (-1.0, 0.0, 1.0)


def acc_panel(evaluation: Evaluation) -> AccPanel:
    """Return what an evaluation says about boxes."""
    boxes = evaluation.boxes
    warnings = tuple(map(warning_in_sentences, evaluation.warnings))
    if boxes is None or boxes.acc is None:
        return AccPanel(problem="No return of anything that moves is in the frames with boxes.", warnings=warnings)
    words = sensitivity_sentences(boxes)
    return AccPanel(
        figures=_figures(boxes),
        classes=tuple(
            ClassRow(one.label or "without a box", _percent(one.acc), one.frames, one.returns, one.inside)
            for one in boxes.classes
        ),
        sensitivity=tuple(_sensitivity(curve, text) for curve, text in zip(boxes.sensitivity, words, strict=True)),
        caution=sentence(NOT_ACCURACY),
        rule=sentence(boxes.rule),
        warnings=warnings,
    )


def no_acc(problem: str) -> AccPanel:
    """Return that there are no figures, and why."""
    return AccPanel(problem=problem)


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
            "error with neighbouring frames taken together. It is not the accuracy of the pose.",
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
            "Acc of the same calibration turned by 10 deg to either side.",
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
