"""Read the boxes of a topic and give each message the recorded frame that it was made from."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.detections import Box, Boxes, FrameBoxes
from calib_core.errors import InputError, MessageError, RecordingError
from calib_core.measurements import TimeNs, time_from_parts
from calib_core.recordings.boxes.drawn_boxes import drawn_boxes
from calib_core.recordings.boxes.layouts import BoxLayout, box_layout
from calib_core.recordings.boxes.stamp_matching import frames_of_stamps
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.topics import Topic

_HALF_PX = 0.5
"""Detectors count from the corner of the top-left pixel, whose centre is our (0, 0)."""


def boxes_in_topic(topic: Topic, *, stamps_ns: TimesNs, times_ns: TimesNs) -> Boxes:
    """Read all boxes of a topic; each message is decoded once.

    Args:
        topic: with boxes.
        stamps_ns: (m,) header stamps of the recorded frames, ascending, by which messages find them.
        times_ns: (m,) stamps that the same frames have in the recording.

    Raises:
        InputError: the topic has no messages of boxes, or they are not of these frames.
        MessageError: no message can be read.
    """
    layouts = [box_layout(topic.definition(number)) for number in range(len(topic.parts))]
    if any(layout is None for layout in layouts):
        raise InputError(f"topic {topic.name} ({topic.type}) has no boxes around objects; name one that has, or a file")
    found: list[tuple[TimeNs, tuple[Box, ...]]] = []
    lost: list[str] = []
    dropped = 0
    for row in range(len(topic)):
        part = int(topic.part[row])
        layout = layouts[part]
        assert layout is not None
        try:
            frames, invalid = frames_in_message(layout, decode(topic.definition(part), topic.payload(row)))
        except RecordingError as error:
            lost.append(str(error))
            continue
        found.extend(frames)
        dropped += invalid
    if not found:
        raise MessageError(f"topic {topic.name}: no message of boxes can be read: {lost[0] if lost else 'it has none'}")
    places, notes = frames_of_stamps(
        np.array([stamp for stamp, _ in found], dtype=np.int64), f"topic {topic.name}", stamps_ns
    )
    notes = (*notes, *_about_losses(lost, dropped))
    return Boxes(_joined([boxes for _, boxes in found], places.tolist(), times_ns), topic.name, notes=notes)


def _about_losses(lost: Sequence[str], dropped: int) -> Iterator[str]:
    if lost:
        yield f"{len(lost)} messages of boxes could not be read and are left out; the first: {lost[0]}"
    if dropped:
        yield f"{dropped} boxes without a finite, positive size are left out"


def _joined(found: Sequence[tuple[Box, ...]], places: Sequence[int], times_ns: TimesNs) -> tuple[FrameBoxes, ...]:
    """Return the boxes by recorded frame; a message that was recorded twice counts once."""
    boxes: dict[int, dict[Box, None]] = {}
    for mine, place in zip(found, places, strict=True):
        if place >= 0:
            boxes.setdefault(place, {}).update(dict.fromkeys(mine))
    return tuple(FrameBoxes(TimeNs(int(times_ns[place])), tuple(boxes[place])) for place in sorted(boxes))


def frames_in_message(layout: BoxLayout, message: Message) -> tuple[list[tuple[TimeNs, tuple[Box, ...]]], int]:
    """Return the stamp and boxes of each frame in a message, and how many boxes are none.

    Raises:
        MessageError: the message has another layout.
    """
    if layout.is_drawing:
        drawn: dict[TimeNs, list[Box]] = {}
        for time, box in drawn_boxes(message):
            drawn.setdefault(time, []).append(box)
        return [(time, tuple(boxes)) for time, boxes in drawn.items()], 0
    sec, nanosec = (int(message.number(f"{layout.stamp}.{part}")) for part in ("sec", "nanosec"))
    elements = message[layout.boxes] if message.count(layout.boxes) else []
    assert isinstance(elements, list | np.ndarray)
    boxes = [_box(layout, element) for element in elements]
    kept = tuple(box for box in boxes if box is not None)
    return [(time_from_parts(sec, nanosec), kept)], len(boxes) - len(kept)


def _box(layout: BoxLayout, element: Any) -> Box | None:
    """Return the box of one element; None if it has no finite, positive size."""
    values = [_number(element, path) for path in (layout.edges or layout.centre)]
    if not all(map(math.isfinite, values)):
        return None
    if layout.centre:
        values = _upright(values, _number(element, layout.angle) if layout.angle else 0.0)
    left_px, top_px, right_px, bottom_px = (value - _HALF_PX for value in values)
    if not (right_px >= left_px and bottom_px >= top_px):
        return None
    label, score = _class_of(layout, element)
    track = _name(_at(element, layout.track)) if layout.track else ""
    return Box(left_px, top_px, right_px, bottom_px, label, score, "" if track.startswith("-") else track)


def _upright(values: Sequence[float], angle_rad: float) -> list[float]:
    """Return the edges of the upright box around a rectangle that is given by centre and size, and may be turned."""
    u_px, v_px, width_px, height_px = values
    cosine, sine = (abs(math.cos(angle_rad)), abs(math.sin(angle_rad))) if math.isfinite(angle_rad) else (1.0, 0.0)
    half_u_px, half_v_px = (width_px * cosine + height_px * sine) / 2, (width_px * sine + height_px * cosine) / 2
    return [u_px - half_u_px, v_px - half_v_px, u_px + half_u_px, v_px + half_v_px]


def _class_of(layout: BoxLayout, element: Any) -> tuple[str, float]:
    """Return the class and its confidence, of several hypotheses the likeliest."""
    if not layout.hypotheses:
        label = _name(_at(element, layout.label)) if layout.label else ""
        return label, _score(_number(element, layout.score)) if layout.score else 1.0
    name, class_path, score_path = layout.hypotheses
    found = [(_score(_number(one, score_path)), _name(_at(one, class_path))) for one in _at(element, name)]
    if not found:
        return "", 1.0
    score, label = max(found, key=lambda one: one[0])
    return label, score


def _score(number: float) -> float:
    return number if 0.0 <= number <= 1.0 else 1.0


def _name(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(int(value))


def _number(element: Any, path: str) -> float:
    """Return a number at a dotted path.

    Raises:
        MessageError: there is text.
    """
    try:
        return float(_at(element, path))
    except ValueError:
        raise MessageError(f"{path} of a box is no number; it cannot be used") from None


def _at(element: Any, path: str) -> Any:
    for name in path.split("."):
        element = element[name]
    return element
