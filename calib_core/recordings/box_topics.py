"""Recognize and read topics of boxes (vision_msgs, darknet_ros_msgs, Foxglove), each message with the frame it was made from."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import InputError, MessageError, RecordingError
from calib_core.measurements import NS_PER_S, Box, Boxes, FrameBoxes, TimeNs, time_from_parts
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition, Field
from calib_core.recordings.topics import Topic

_CENTRES = (("bbox.center.position.x", "bbox.center.position.y"), ("bbox.center.x", "bbox.center.y"))
_SIZES = (("bbox.size_x", "bbox.size_y"), ("bbox.size.x", "bbox.size.y"))
_EDGES = (("xmin", "ymin", "xmax", "ymax"), ("x_min", "y_min", "x_max", "y_max"))
_LABELS = ("class_name", "Class", "class_id", "class", "label")
_SCORES = ("score", "probability", "confidence")
_HYPOTHESES = (("hypothesis.class_id", "hypothesis.score"), ("id", "score"))
_TRACKS = ("tracking_id", "track_id")
_STAMPS = ("image_header.stamp", "header.stamp")
_HALF_PX = 0.5
"""Detectors count from the corner of the top-left pixel, whose center is our (0, 0)."""
_LINE_LOOP, _LINE_STRIP = 2, 3
_SQUARE_PX = 0.5
STAMP_TOLERANCE_NS = 1_000_000
"""Times in names of files are often rounded to milliseconds; frames are further apart."""
_LEAST_MATCHING = 0.5


@dataclass(frozen=True, slots=True)
class BoxLayout:
    """Where a message has its boxes. Paths are dotted names within an element of the list.

    Attributes:
        name: what kind of message it is, for people.
        boxes: the list of boxes.
        stamp: path of the image's stamp in the message; "" if every element has its own (Foxglove).
        edges: paths of left, top, right and bottom; empty if the center is given.
        center: paths of the center's u and v, the width and the height; empty if the edges are given.
        angle: path of the rectangle's turn [rad]; "" without one.
        label: path of the class; "" if it is among the hypotheses, or there is none.
        score: path of the confidence; "" likewise.
        hypotheses: the list of possible classes, and in it the paths of class and confidence; empty without one.
        track: path of the object's number or name; "" if objects are not followed.
    """

    name: str
    boxes: str
    stamp: str
    edges: tuple[str, ...] = ()
    centre: tuple[str, ...] = ()
    angle: str = ""
    label: str = ""
    score: str = ""
    hypotheses: tuple[str, ...] = ()
    track: str = ""

    @property
    def is_drawing(self) -> bool:
        """Whether boxes are drawn as lines and texts rather than stated."""
        return not self.edges and not self.centre


def box_layout(definition: Definition) -> BoxLayout | None:
    """Return where messages of a definition have boxes; None if they have none."""
    if _is_drawing(definition):
        return BoxLayout("image annotations", "points", "")
    stamp = next((path for path in _STAMPS if _field_at(definition, definition.type, path)), "")
    for field in definition.fields:
        if field.count is None or field.type not in definition.types or not stamp:
            continue
        layout = _struct_layout(definition, field, stamp)
        if layout is not None:
            return layout
    return None


def _is_drawing(definition: Definition) -> bool:
    points = _field_at(definition, definition.type, "points")
    return points is not None and all(
        _field_at(definition, points.type, path) for path in ("timestamp", "type", "points", "outline_color")
    )


def _struct_layout(definition: Definition, field: Field, stamp: str) -> BoxLayout | None:
    def first(paths: Sequence[str]) -> str:
        return next((path for path in paths if _is_single(_field_at(definition, field.type, path))), "")

    def whole(choices: Sequence[tuple[str, ...]], kind: str = field.type) -> tuple[str, ...]:
        return next(
            (choice for choice in choices if all(_is_single(_field_at(definition, kind, path)) for path in choice)), ()
        )

    edges, centre, size = whole(_EDGES), whole(_CENTRES), whole(_SIZES)
    if not edges and not (centre and size):
        return None
    results = _field_at(definition, field.type, "results")
    inner = whole(_HYPOTHESES, results.type) if results is not None and results.count is not None else ()
    return BoxLayout(
        name="2D detections" if centre else "bounding boxes",
        boxes=field.name,
        stamp=stamp,
        edges=edges,
        centre=() if edges else (*centre, *size),
        angle=first(("bbox.center.theta",)),
        label="" if inner else first(_LABELS),
        score="" if inner else first(_SCORES),
        hypotheses=("results", *inner) if inner else (),
        track=first((*_TRACKS, "id")) if centre else first(_TRACKS),
    )


def _is_single(field: Field | None) -> bool:
    """Return whether a field is one number or text."""
    return field is not None and field.count is None and (field.type in PRIMITIVES or field.type == "string")


def _field_at(definition: Definition, kind: str, path: str) -> Field | None:
    """Return the field at a dotted path within a type."""
    found = None
    for name in path.split("."):
        fields = definition.types.get(kind, ())
        found = next((field for field in fields if field.name == name), None)
        if found is None:
            return None
        kind = found.type
    return found


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
    notes = (*notes, *_loss_notes(lost, dropped))
    return Boxes(joined_frames([boxes for _, boxes in found], places, times_ns), topic.name, notes=notes)


def _loss_notes(lost: Sequence[str], dropped: int) -> Iterator[str]:
    if lost:
        yield f"{len(lost)} messages of boxes could not be read and are left out; the first: {lost[0]}"
    if dropped:
        yield f"{dropped} boxes without a finite, positive size are left out"


def joined_frames(found: Sequence[tuple[Box, ...]], places: Indices, times_ns: TimesNs) -> tuple[FrameBoxes, ...]:
    """Return the boxes by recorded frame; a box that is given twice counts once.

    Args:
        found: of each message or annotated frame.
        places: (n,) the recorded frame of each; -1 for none.
        times_ns: (m,) stamps of the recorded frames.
    """
    boxes: dict[int, dict[Box, None]] = {}
    for mine, place in zip(found, places.tolist(), strict=True):
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
        values = upright(values, _number(element, layout.angle) if layout.angle else 0.0)
    left_px, top_px, right_px, bottom_px = (value - _HALF_PX for value in values)
    if not (right_px >= left_px and bottom_px >= top_px):
        return None
    label, score = _class_of(layout, element)
    track = _name(_at(element, layout.track)) if layout.track else ""
    return Box(left_px, top_px, right_px, bottom_px, label, score, "" if track.startswith("-") else track)


def upright(values: Sequence[float], angle_rad: float) -> list[float]:
    """Return the edges of the upright box around a rectangle that may be turned.

    Args:
        values: u and v of its center, its width and height.
        angle_rad: of the turn about its center.
    """
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


def drawn_boxes(message: Message) -> Iterator[tuple[TimeNs, Box]]:
    """Yield each upright rectangle of a message with the stamp of its image.

    Raises:
        MessageError: the message has another layout.
    """
    texts = [_text(text) for text in message.messages("texts")] if "texts" in message else []
    for drawn in message.messages("points"):
        corners = _corners(drawn)
        if corners is None:
            continue
        (left, top), (right, bottom) = corners.min(axis=0) - 0.5, corners.max(axis=0) - 0.5
        near_px = max(20.0, (bottom - top) / 2)
        found = [(abs(u - left) + abs(v - top), text) for u, v, text in texts]
        distance, label = min(found, default=(np.inf, ""))
        stamp = drawn.message("timestamp")
        time = time_from_parts(stamp.whole("sec"), stamp.whole("nanosec"))
        yield time, Box(float(left), float(top), float(right), float(bottom), label if distance <= near_px else "")


def _corners(drawn: Message) -> np.ndarray | None:
    """Return the corners of an upright rectangle: (4, 2) [px]; None for any other drawing."""
    if drawn.whole("type") not in (_LINE_LOOP, _LINE_STRIP) or drawn.count("points") not in (4, 5):
        return None
    points = np.stack([drawn.column("points", axis) for axis in "xy"], axis=1)
    if not np.isfinite(points).all():
        return None
    if len(points) == 5:
        if np.abs(points[0] - points[4]).max() > _SQUARE_PX:
            return None
        points = points[:4]
    low, high = points.min(axis=0), points.max(axis=0)
    on_edges = np.minimum(np.abs(points - low), np.abs(points - high)).max() <= _SQUARE_PX
    diagonal = np.abs(points[0] - points[2]), np.abs(points[1] - points[3])
    spans = all(np.abs(one - (high - low)).max() <= 2 * _SQUARE_PX for one in diagonal)
    return points if on_edges and spans else None


def _text(text: Message) -> tuple[float, float, str]:
    try:
        return text.number("position.x") - 0.5, text.number("position.y") - 0.5, text.text("text")
    except MessageError:
        return np.inf, np.inf, ""


def frames_of_stamps(stamps: TimesNs, source: str, image_times: TimesNs) -> tuple[Indices, tuple[str, ...]]:
    """Return the recorded frame of each stamp, -1 for stamps at which there is none, and what to know about them.

    Args:
        stamps: (n,) of annotated frames, in any order; at least one.
        source: where they are from, for messages.
        image_times: (m,) stamps of the recorded frames, ascending; at least one.

    Raises:
        InputError: most stamps within the recorded time are of no frame, or none is within it.
    """
    after = np.clip(np.searchsorted(image_times, stamps), 0, len(image_times) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(image_times[before] - stamps) <= np.abs(image_times[after] - stamps)
    nearest = np.where(nearer, before, after).astype(np.int64)
    matches = np.abs(image_times[nearest] - stamps) <= STAMP_TOLERANCE_NS
    within = (stamps >= image_times[0] - STAMP_TOLERANCE_NS) & (stamps <= image_times[-1] + STAMP_TOLERANCE_NS)
    if not within.any():
        raise InputError(
            f"{source}: its frames are from {_value_text(stamps.min())} to {_value_text(stamps.max())}, the recorded ones from "
            f"{_value_text(image_times[0])} to {_value_text(image_times[-1])}; is it of another recording?"
        )
    if np.count_nonzero(matches) < _LEAST_MATCHING * np.count_nonzero(within):
        raise InputError(
            f"{source}: {np.count_nonzero(within & ~matches)} of {np.count_nonzero(within)} annotated frames have the "
            f"stamp of no recorded frame (within {STAMP_TOLERANCE_NS // 1_000_000} ms); is it of another recording? If "
            "the recording is read by receive times and the boxes have header stamps, add --clock header"
        )
    missing = int(np.count_nonzero(~matches))
    note = f"{missing} of {len(stamps)} annotated frames are not in the recording and are left out"
    return np.where(matches, nearest, -1), (note,) if missing else ()


def _value_text(time: int) -> str:
    return f"{int(time) / NS_PER_S:.3f} s"
