"""Match the frames of a file of boxes to recorded frames: by stamp where the file has stamps, else by number.

The rule, which docs/boxes.md states: a stamp, or a time in a picture's name, is the recorded frame within 1 ms of it; a
number counts the recorded frames from 0 or 1. A file whose stamps, count or pictures differ is of another recording.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.boxes.file_frames import FileBoxes, FileFrame
from calib_core.detections import Box, Boxes, FrameBoxes
from calib_core.errors import InputError
from calib_core.measurements import TimeNs
from calib_core.recordings.box_topics import frames_of_stamps
from calib_core.recordings.plain_files.name_times import times_in_names

_LEAST_INSIDE = 0.5
_DIGITS = re.compile(r"[0-9]+")
_OTHER = "is it of another recording?"


def matched_boxes(
    found: FileBoxes, source: str, *, image_times: TimesNs, image_size_px: tuple[int, int] | None
) -> Boxes:
    """Give the frames of a file the stamps of recorded frames.

    Args:
        found: the file's content.
        source: its name, for messages.
        image_times: (m,) stamps of the recorded frames, ascending.
        image_size_px: width and height of the recorded pictures; None if unknown.

    Raises:
        InputError: the file does not belong to the recording.
    """
    if not len(image_times):
        raise InputError(
            f"{source}: the recording has no camera frames that boxes could belong to; add the camera's file"
        )
    if not found.frames:
        raise InputError(f"{source}: has no annotated frame; export it again with its frames")
    _refuse_other_pictures(found, source, image_size_px)
    stamps = _stamps_of(found.frames)
    if stamps is not None:
        places, notes = frames_of_stamps(stamps, source, image_times)
    else:
        places, notes = _by_number(found, source, len(image_times))
    frames = _joined(found.frames, places, image_times)
    return Boxes(frames, source, image_size_px or found.image_size_px, (*found.notes, *notes))


def _refuse_other_pictures(found: FileBoxes, source: str, image_size_px: tuple[int, int] | None) -> None:
    """Refuse boxes that were made on pictures of another size, or that lie beside the picture.

    Raises:
        InputError: they were.
    """
    if image_size_px is None:
        return
    width, height = image_size_px
    if found.image_size_px is not None and found.image_size_px != image_size_px:
        made_width, made_height = found.image_size_px
        raise InputError(
            f"{source}: its boxes were made on pictures of {made_width} x {made_height} px, the recorded ones have "
            f"{width} x {height}; export the boxes for the recorded pictures, or give the other camera's topic"
        )
    boxes = [box for frame in found.frames for box in frame.boxes]
    inside = sum(_touches(box, width, height) for box in boxes)
    if boxes and inside < _LEAST_INSIDE * len(boxes):
        raise InputError(
            f"{source}: {len(boxes) - inside} of {len(boxes)} boxes lie outside the picture of {width} x {height} px; "
            f"{_OTHER}"
        )


def _touches(box: Box, width_px: int, height_px: int) -> bool:
    centre_u_px, centre_v_px = (box.left_px + box.right_px) / 2, (box.top_px + box.bottom_px) / 2
    return -0.5 <= centre_u_px <= width_px - 0.5 and -0.5 <= centre_v_px <= height_px - 0.5


def _stamps_of(frames: Sequence[FileFrame]) -> TimesNs | None:
    """Return the stamp of each frame: stated, or in its picture's name; None if any frame has none."""
    if all(frame.stamp is not None for frame in frames):
        return np.array([frame.stamp for frame in frames], dtype=np.int64)
    names = [frame.name for frame in frames]
    named = times_in_names(names) if all(names) else None
    return named.times_ns if named is not None and len(named.places) == len(names) else None


def _by_number(found: FileBoxes, source: str, count: int) -> tuple[Indices, tuple[str, ...]]:
    """Return the recorded frame of each frame by its number, and what was assumed.

    Raises:
        InputError: frames have no number, or the numbers do not fit the recorded frames.
    """
    numbers = _numbers_of(found.frames, source)
    if found.frame_count is not None and found.frame_count != count:
        raise InputError(
            f"{source}: is for a sequence of {found.frame_count} frames, the recording has {count}; {_OTHER}"
        )
    first, why = _first_number(found, numbers, count)
    places = numbers - first
    if places.min() < 0 or places.max() >= count:
        raise InputError(
            f"{source}: has frames numbered {numbers.min()} to {numbers.max()}, which do not fit the recording's {count} "
            f"frames counted from {first}; {_OTHER}"
        )
    listed = len(np.unique(numbers))
    note = f"the file has no stamps; its frame number {first} is taken for the first recorded frame ({why})"
    part = f"{listed} of the recording's {count} frames are annotated"
    return places, (note, part) if listed < count else (note,)


def _numbers_of(frames: Sequence[FileFrame], source: str) -> Indices:
    """Return the number of each frame: stated, else in its picture's name.

    Raises:
        InputError: a picture's name has no number.
    """
    groups = [_DIGITS.findall(frame.name) for frame in frames]
    for frame, found in zip(frames, groups, strict=True):
        if frame.number is None and not found:
            raise InputError(
                f"{source}: the picture {frame.name!r} has neither a time nor a number in its name, so its recorded frame "
                "is unknown; name the pictures by their stamps in nanoseconds"
            )
    which = _counting_group([found for frame, found in zip(frames, groups, strict=True) if frame.number is None])
    numbers = [
        int(found[which][-18:]) if frame.number is None else frame.number
        for frame, found in zip(frames, groups, strict=True)
    ]
    return np.array(numbers, dtype=np.int64)


def _counting_group(groups: Sequence[Sequence[str]]) -> int:
    """Return which number in a name counts the frames: the last that differs between all, as in 000012_camera0; else the last."""
    for which in range(-1, -1 - min(map(len, groups), default=0), -1):
        if len({found[which] for found in groups}) == len(groups):
            return which
    return -1


def _first_number(found: FileBoxes, numbers: Indices, count: int) -> tuple[int, str]:
    """Return the number of the sequence's first frame, and how it is known."""
    lowest, highest = int(numbers.min()), int(numbers.max())
    if found.first_number is not None:
        return found.first_number, "as the format defines"
    if len(np.unique(numbers)) == count and highest - lowest == count - 1:
        return lowest, "there are as many as recorded frames"
    if lowest == 0:
        return 0, "the file counts from 0"
    if highest == count:
        return 1, "its last number is the number of recorded frames"
    if lowest == 1:
        return 1, "the file begins with 1"
    return 0, "assumed; check a box in the overlay"


def _joined(frames: Sequence[FileFrame], places: Indices, image_times: TimesNs) -> tuple[FrameBoxes, ...]:
    """Return the boxes by recorded frame; a box that is given twice counts once."""
    boxes: dict[int, dict[Box, None]] = {}
    for frame, place in zip(frames, places.tolist(), strict=True):
        if place >= 0:
            boxes.setdefault(place, {}).update(dict.fromkeys(replace(box) for box in frame.boxes))
    return tuple(FrameBoxes(TimeNs(int(image_times[place])), tuple(boxes[place])) for place in sorted(boxes))
