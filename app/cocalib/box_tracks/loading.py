"""Boxes of a file as tracks of the session."""

import re
import tempfile
from collections import defaultdict
from pathlib import Path

from calib_core.boxes import read_boxes
from calib_core.detections import Box, Boxes
from calib_core.measurements import TimeNs
from cocalib.session import BoxesLoaded, BoxKeyframe, BoxTrack, RecordingFacts

_LEAST_PX = 3.0
"""Boxes narrower or lower than this, after what is beyond the picture is cut off, are left out [px]."""


def read_sent_boxes(data: bytes, name: str, facts: RecordingFacts) -> Boxes:
    """Read a file of boxes that a page has sent.

    Args:
        data: its content.
        name: its name, for messages and for what its ending says.
        facts: the recording's frames.

    Raises:
        InputError: it cannot be read, is of no known format, or belongs to another recording.
    """
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", Path(name).name).lstrip(".")[-80:] or "boxes"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / plain
        path.write_bytes(data)
        return read_boxes(path, image_times=facts.image_times, image_size_px=(facts.width_px, facts.height_px))


def boxes_loaded(boxes: Boxes, facts: RecordingFacts) -> BoxesLoaded:
    """Return the boxes of a file as a step of the session.

    Boxes of one track and class belong to one object; each box without a track is an object of its own.

    Args:
        boxes: with the stamps of recorded frames.
        facts: the recording's frames.
    """
    keyframes: dict[tuple[str, str, int], dict[TimeNs, BoxKeyframe]] = defaultdict(dict)
    empty: list[TimeNs] = []
    alone = 0
    for frame in boxes:
        seen = [(box, edges) for box in frame.boxes if (edges := _edges(box, facts)) is not None]
        if not seen:
            empty.append(frame.image_time)
        for box, edges in seen:
            key = (box.track, box.label, 0)
            if not box.track or frame.image_time in keyframes[key]:
                alone += 1
                key = ("", box.label, alone)
            keyframes[key][frame.image_time] = BoxKeyframe(frame.image_time, edges)
    tracks = [
        BoxTrack(name or f"b{number}", label, tuple(stated[time] for time in sorted(stated)), is_carried=False)
        for (name, label, number), stated in keyframes.items()
    ]
    return BoxesLoaded(tuple(_renamed(tracks)), tuple(empty))


def _renamed(tracks: list[BoxTrack]) -> list[BoxTrack]:
    """Give each track a name of its own."""
    taken: set[str] = set()
    named = []
    for track in tracks:
        name, number = track.id[:60], 2
        while name in taken:
            name, number = f"{track.id[:60]} ({number})", number + 1
        taken.add(name)
        named.append(BoxTrack(name, track.label[:60].strip(), track.keyframes, is_carried=False))
    return named


def _edges(box: Box, facts: RecordingFacts) -> tuple[float, float, float, float] | None:
    """Return the edges as far as they are in the picture; None if too little of the box is."""
    left, right = (min(max(value, -0.5), facts.width_px - 0.5) for value in (box.left_px, box.right_px))
    top, bottom = (min(max(value, -0.5), facts.height_px - 0.5) for value in (box.top_px, box.bottom_px))
    return (left, top, right, bottom) if right - left >= _LEAST_PX and bottom - top >= _LEAST_PX else None
