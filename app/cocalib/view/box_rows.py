"""Boxes in the View: one row per object, and the boxes of one frame."""

from collections.abc import Sequence

import msgspec
import numpy as np

from calib_core.evaluation import BoxFigures
from cocalib.session import BoxTrack, RecordingFacts
from cocalib.session.boxes_in_frames import BoxKind, CarriedTrack
from cocalib.view.box_panel import BoxTrackRow

_USUAL_LABELS = ("person", "car", "truck", "bicycle", "robot")


class BoxInFrame(msgspec.Struct, frozen=True, array_like=True):
    """One box in a frame; written as an array, since it is sent with every frame.

    Attributes:
        id: of the track.
        label: its class.
        left_px: left edge.
        top_px: upper edge.
        right_px: right edge.
        bottom_px: lower edge.
        kind: stated, followed or in between.
        confidence: 0 to 1.
    """

    id: str
    label: str
    left_px: float
    top_px: float
    right_px: float
    bottom_px: float
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
        BoxInFrame(track.id, track.label, *one.edges_px, one.kind, round(one.confidence, 2))
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
