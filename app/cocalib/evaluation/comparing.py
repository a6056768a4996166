"""Compare two calibrations: by themselves, and on a recording by what both say of the same clicks and boxes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.evaluation.evaluation_json import evaluation_document
from calib_core.evaluation.figures import Evaluation
from calib_core.evaluation.paired_difference import PairedDifference, Winner, acc_difference, residual_difference
from calib_core.measurements import Boxes, ReflectorClick, ReturnLabels
from calib_core.results import Calibration, DataWarning
from calib_core.words.outcomes import said_of
from cocalib.evaluation.evaluating import EvidenceOptions, RadarRecording, evidence_in, judged

_FITTED_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class ComparedOnRecording:
    """Two calibrations judged by the same clicks and the same boxes.

    Attributes:
        names: of A and B, for messages.
        a: the figures of one.
        b: of the other.
        residuals: paired difference of the residuals, B's minus A's; None without clicks.
        acc: paired difference of Acc; None without boxes.
        fitted: for each, whether it was solved from these very clicks, so that its residuals there are too small.
    """

    names: tuple[str, str]
    a: Evaluation
    b: Evaluation
    residuals: PairedDifference | None
    acc: PairedDifference | None
    fitted: tuple[bool, bool]

    @property
    def fair(self) -> bool:
        """Whether the residuals can tell the two apart: both were solved from these clicks, or neither was."""
        return self.fitted[0] == self.fitted[1]

    @property
    def winner(self) -> Winner:
        """Which one is better; "unknown" if the difference may be noise, or residuals and Acc contradict each other."""
        residuals = self.residuals.winner if self.residuals is not None and self.fair else None
        acc = self.acc.winner if self.acc is not None else None
        known: list[Winner] = [one for one in (residuals, acc) if one in ("A", "B")]
        if known:
            return known[0] if len(set(known)) == 1 else "unknown"
        told = [one for one in (residuals, acc) if one is not None]
        return "equal" if told and all(one == "equal" for one in told) else "unknown"


def compare_on_recording(
    calibrations: tuple[Calibration, Calibration],
    recording: RadarRecording,
    *,
    names: tuple[str, str] = ("A", "B"),
    clicks: Sequence[ReflectorClick] = (),
    boxes: Boxes | None = None,
    labels: ReturnLabels | None = None,
    progress: Callable[[int, int], None] | None = None,
    options: EvidenceOptions | None = None,
) -> ComparedOnRecording:
    """Judge two calibrations by the same clicks, returns and boxes; which belong together depends on neither pose.

    Args:
        calibrations: A and B, of the same sensors.
        recording: with a radar.
        names: of the two.
        clicks: on the reflector.
        boxes: around moving objects.
        labels: the true origin of each return.
        progress: called with the amount done and the total.
        options: of the search.

    Raises:
        InputError: the two are of cameras with different images, or boxes and recording do not belong together.
    """
    sizes = [(calibration.camera.width_px, calibration.camera.height_px) for calibration in calibrations]
    if sizes[0] != sizes[1]:
        raise InputError(
            f"{names[0]} is for images of {sizes[0][0]} x {sizes[0][1]} px, {names[1]} for {sizes[1][0]} x {sizes[1][1]} px; "
            "compare calibrations of one camera"
        )
    lens = calibrations[0].camera
    evidence = evidence_in(
        recording, lens, clicks=clicks, boxes=boxes, labels=labels, progress=progress, options=options
    )
    a, b = (judged(calibration, evidence, held_out=False, progress=progress) for calibration in calibrations)
    residuals = acc = None
    if a.residuals is not None and b.residuals is not None:
        residuals = residual_difference(a.residuals, b.residuals, lost_px=float(np.hypot(*sizes[0])))
    if a.boxes is not None and b.boxes is not None:
        acc = acc_difference(a.boxes, b.boxes)
    fitted_a, fitted_b = (_solved_from_clicks(calibration, clicks) for calibration in calibrations)
    return ComparedOnRecording(names, a, b, residuals, acc, (fitted_a, fitted_b))


def comparison_document(compared: ComparedOnRecording) -> dict[str, Any]:
    """Return the comparison for JSON; docs/evaluation.md lists its keys."""
    return {
        "winner": compared.winner,
        "residuals_px": _difference(compared.residuals),
        "acc": _difference(compared.acc),
        "solved_from_these_clicks": list(compared.fitted),
        "evaluation_a": evaluation_document(compared.a),
        "evaluation_b": evaluation_document(compared.b),
    }


def _difference(difference: PairedDifference | None) -> dict[str, Any] | None:
    if difference is None:
        return None
    return {
        "b_minus_a": difference.mean,
        "standard_error": difference.standard_error,
        "low": difference.low,
        "high": difference.high,
        "p_value": difference.p_value,
        "groups": difference.groups,
        "winner": difference.winner,
    }


def comparison_lines(compared: ComparedOnRecording) -> tuple[str, ...]:
    """Say which of two calibrations is better on a recording, by how much, and whether that is more than noise."""
    a, b = compared.names
    rows = [_answer(compared)]
    if compared.residuals is not None and compared.a.residuals is not None and compared.b.residuals is not None:
        lengths = " and ".join(
            f"{name} {one.metrics.aed_px:.3g} px"
            for name, one in ((a, compared.a.residuals), (b, compared.b.residuals))
        )
        rows.append(
            f"residuals: mean reprojection error (AED) {lengths}; B - A {compared.residuals.mean:+.3g} px per placement"
            f"{_interval(compared.residuals, 1.0, 'px', 'placement')}"
        )
    if compared.acc is not None and compared.a.boxes is not None and compared.b.boxes is not None:
        shares = " and ".join(
            f"{name} {100.0 * (one.acc or 0.0):.1f} %" for name, one in ((a, compared.a.boxes), (b, compared.b.boxes))
        )
        rows.append(
            f"Acc: {shares}; B - A {100.0 * compared.acc.mean:+.1f} points"
            f"{_interval(compared.acc, 100.0, 'points', 'group')}; a higher Acc is not a better pose by itself"
        )
    for name, fitted in zip(compared.names, compared.fitted, strict=True):
        if fitted and not compared.fair:
            rows.append(
                f"{name} was solved from these clicks, so its residuals here are too small to compare with the other's; "
                "compare on another recording"
            )
    rows += [
        f"warning{_of_one(one, compared)}: {said_of(one)}"
        for one in dict.fromkeys((*compared.a.warnings, *compared.b.warnings))
    ]
    return tuple(rows)


def _of_one(warning: DataWarning, compared: ComparedOnRecording) -> str:
    """Return which of the two a warning is about; empty if about both."""
    about = [warning in one.warnings for one in (compared.a, compared.b)]
    return "" if all(about) else f" about {compared.names[about.index(True)]}"


def _answer(compared: ComparedOnRecording) -> str:
    winner, (a, b) = compared.winner, compared.names
    if winner == "equal":
        return "no difference on this recording"
    if winner == "unknown":
        return f"cannot tell which is better on this recording: {_why_unknown(compared)}"
    better, other = (b, a) if winner == "B" else (a, b)
    parts = []
    if compared.residuals is not None and compared.fair and compared.residuals.winner == winner:
        parts.append(f"its residuals are {abs(compared.residuals.mean):.3g} px shorter")
    if compared.acc is not None and compared.acc.winner == winner:
        parts.append(f"its Acc is {100.0 * abs(compared.acc.mean):.1f} points higher")
    return (
        f"{winner} ({better}) is better than {other} on this recording: {' and '.join(parts)}, which is more than noise"
    )


def _why_unknown(compared: ComparedOnRecording) -> str:
    if compared.residuals is None and compared.acc is None:
        return "there are no clicks or boxes to evaluate against"
    told = {one.winner for one in (compared.residuals, compared.acc) if one is not None}
    if {"A", "B"} <= told and compared.fair:
        return "residuals and Acc contradict each other"
    if not compared.fair and compared.acc is None:
        return "one of them was solved from these clicks"
    return "the difference may be noise"


def _interval(difference: PairedDifference, factor: float, unit: str, group: str) -> str:
    if not np.isfinite(difference.low):
        return f" ({difference.groups} {group}{'' if difference.groups == 1 else 's'}: too few to say how uncertain that is)"
    low, high = factor * difference.low, factor * difference.high
    return f" (95 %: {low:+.3g} to {high:+.3g} {unit}, {difference.groups} {group}s, p = {difference.p_value:.2g})"


def _solved_from_clicks(calibration: Calibration, clicks: Sequence[ReflectorClick]) -> bool:
    """Return whether a calibration was solved from these very clicks."""
    used = {
        (int(pair.image_time), *pair.pixel_px.tolist())
        for pair in calibration.pairs
        if pair.image_time is not None and not pair.excluded
    }
    counting = [click for click in clicks if click.counts]
    same = sum((int(click.image_time), click.u_px, click.v_px) in used for click in counting)
    return bool(counting) and same >= _FITTED_SHARE * len(counting)
