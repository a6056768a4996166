"""Boxes in Foxglove's image annotations: closed lines of four corners, and the text next to each."""

from collections.abc import Iterator

import numpy as np

from calib_core.detections import Box
from calib_core.errors import MessageError
from calib_core.measurements import TimeNs, time_from_parts
from calib_core.recordings.messages.decoding import Message

_LINE_LOOP, _LINE_STRIP = 2, 3
_SQUARE_PX = 0.5


def drawn_boxes(message: Message) -> Iterator[tuple[TimeNs, Box]]:
    """Yield each upright rectangle of a message with the stamp of its picture.

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
