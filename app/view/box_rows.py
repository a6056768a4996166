"""Boxes in the View: one row per object, and the boxes of one frame."""

from collections.abc import Sequence

import msgspec

from app.box_tracks.carried import BoxKind, CarriedTrack
from app.session import BoxTrack, RecordingFacts
from app.view.model import BoxTrackRow

__all__ = ["BoxInFrame", "box_rows", "boxes_in_frame", "known_labels"]

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


def known_labels(tracks: Sequence[BoxTrack]) -> tuple[str, ...]:
    """Return the classes to choose from: those in use, the last one first, then the usual ones."""
    used = (track.label for track in reversed(tracks) if track.label)
    return tuple(dict.fromkeys((*used, *_USUAL_LABELS)))
