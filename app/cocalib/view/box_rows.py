"""Boxes in the View: one row per object, the boxes of one frame, and what they say about the calibration: Acc."""

from collections.abc import Sequence

import msgspec
import numpy as np

from calib_core.evaluation import BoxFigures, Evaluation, Sensitivity
from calib_core.evaluation.sentences import NOT_ACCURACY, sensitivity_sentences
from cocalib.session import BoxTrack, RecordingFacts
from cocalib.session.boxes_in_frames import BoxKind, CarriedTrack
from cocalib.session.state import BoxEdges
from cocalib.view.model import AccPanel, BoxTrackRow, Figure, SensitivityRow
from cocalib.view.wording import sentence, warning_in_sentences

_USUAL_LABELS = ("person", "car", "truck", "bicycle", "robot")


class BoxInFrame(msgspec.Struct, frozen=True, array_like=True):
    """One box in a frame; written as an array, since it is sent with every frame.

    Attributes:
        id: of the track.
        label: its class.
        edges_px: left, top, right, bottom.
        kind: stated, followed or in between.
        confidence: 0 to 1.
    """

    id: str
    label: str
    edges_px: BoxEdges
    kind: BoxKind
    confidence: float


class BoxedReturn(msgspec.Struct, frozen=True, array_like=True):
    """A return of a moving target on the picture; written as an array.

    Attributes:
        u_px: column at which the calibration puts it.
        v_px: row.
        box: id of its target's box in this frame; "" if that has none.
        inside: it is in that box.
    """

    u_px: float
    v_px: float
    box: str
    inside: bool


def box_rows(
    tracks: Sequence[BoxTrack], carried: Sequence[CarriedTrack], facts: RecordingFacts
) -> tuple[BoxTrackRow, ...]:
    """Return one row per object.

    Args:
        tracks: of the session.
        carried: the same through the frames.
        facts: the recording's frames.
    """
    rows = []
    for track, through in zip(tracks, carried, strict=True):
        frames = [facts.frame_at(one.image_time) for one in track.keyframes]
        rows.append(
            BoxTrackRow(
                id=track.id,
                label=track.label,
                first=through.boxes[0].frame,
                last=through.boxes[-1].frame,
                boxes=len(through.boxes),
                keyframes=tuple(frame for frame in frames if frame is not None) if track.is_carried else (),
                hidden=tuple(
                    frame
                    for one, frame in zip(track.keyframes, frames, strict=True)
                    if one.edges_px is None and frame is not None
                ),
                note=through.note,
                following=not through.is_complete,
            )
        )
    return tuple(rows)


def boxes_in_frame(carried: Sequence[CarriedTrack], frame: int) -> tuple[BoxInFrame, ...]:
    """Return the boxes of one frame."""
    found = ((track, track.at(frame)) for track in carried)
    return tuple(
        BoxInFrame(track.id, track.label, one.edges_px, one.kind, round(one.confidence, 2))
        for track, one in found
        if one is not None
    )


def returns_in_frame(
    figures: BoxFigures, image_time: int, carried: Sequence[CarriedTrack], frame: int
) -> tuple[BoxedReturn, ...]:
    """Return the moving targets' returns of one frame, as far as they are before the camera.

    Args:
        figures: of the judged boxes.
        image_time: stamp of the frame.
        carried: the boxes.
        frame: index of the frame.
    """
    place = next((index for index, one in enumerate(figures.frames) if one.image_time == image_time), None)
    if figures.returns is None or place is None:
        return ()
    here = [(track.id, np.array(box.edges_px)) for track in carried if (box := track.at(frame)) is not None]
    returns = figures.returns
    rows = np.flatnonzero((returns.frames == place) & np.isfinite(returns.pixels_px).all(axis=1))
    return tuple(
        BoxedReturn(
            round(float(returns.pixels_px[row, 0]), 2),
            round(float(returns.pixels_px[row, 1]), 2),
            next((name for name, edges in here if np.allclose(edges, returns.boxes_px[row], atol=0.01)), ""),
            bool(returns.inside[row]),
        )
        for row in rows.tolist()
    )


def known_labels(tracks: Sequence[BoxTrack]) -> tuple[str, ...]:
    """Return the classes to choose from: those in use, the last one first, then the usual ones."""
    used = (track.label for track in reversed(tracks) if track.label)
    return tuple(dict.fromkeys((*used, *_USUAL_LABELS)))


_SHOWN_DEG = (-1.0, 0.0, 1.0)
_FEWEST_TARGETS, _FEWEST_RETURNS = 3, 30
"""With fewer, one loosely drawn box decides what the figures say about the calibration."""


def acc_panel(evaluation: Evaluation) -> AccPanel:
    """Return what an evaluation says about boxes."""
    boxes = evaluation.boxes
    warnings = tuple(map(warning_in_sentences, evaluation.warnings))
    if boxes is None or boxes.acc is None:
        return AccPanel(problem="No return of anything that moves is in the frames with boxes.", warnings=warnings)
    returns = sum(frame.returns for frame in boxes.frames)
    if boxes.matched_targets < _FEWEST_TARGETS or returns < _FEWEST_RETURNS:
        caution = (
            f"Too little to judge the calibration by: {boxes.matched_targets} of {_FEWEST_TARGETS} targets with a box, "
            f"{returns} of {_FEWEST_RETURNS} returns."
        )
        others = tuple(one for one in warnings if one.code != "turned-from-boxes")
        return AccPanel(_figures(boxes), boxes.classes, caution=caution, rule=sentence(boxes.rule), warnings=others)
    words = sensitivity_sentences(boxes)
    return AccPanel(
        figures=_figures(boxes),
        classes=boxes.classes,
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
