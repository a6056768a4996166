"""Build ROS 1 messages from the pictures and radar returns of plain files, so the same readers apply."""

import struct

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.containers.sources import Channel

_CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def picture_channel(topic: str) -> Channel:
    """Return the channel of a picture topic."""
    return Channel(0, topic, "sensor_msgs/CompressedImage", "ros1", "", "")


def cloud_channel(topic: str) -> Channel:
    """Return the channel of a point-cloud topic."""
    return Channel(0, topic, "sensor_msgs/PointCloud2", "ros1", "", "")


def header_bytes(time: TimeNs, frame: str) -> bytes:
    """Return a serialised header."""
    sec, nanosec = divmod(int(time), NS_PER_S)
    return struct.pack("<III", 0, sec, nanosec) + _string(frame)


def picture_message(time: TimeNs, frame: str, data: bytes) -> bytes:
    """Return a CompressedImage; its format is recognized from the first bytes of the data."""
    return header_bytes(time, frame) + _string("") + struct.pack("<I", len(data)) + data


def cloud_message(time: TimeNs, frame: str, points: np.ndarray) -> bytes:
    """Return a PointCloud2.

    Args:
        time: its stamp.
        frame: its frame_id.
        points: (n,) structured, little endian; fields of types that PointCloud2 does not support are not described.
    """
    described = [
        _string(name) + struct.pack("<IBI", place[1], _CODES[place[0].str[1:]], 1)
        for name, place in (points.dtype.fields or {}).items()
        if place[0].str[1:] in _CODES
    ]
    data, step = points.tobytes(), points.dtype.itemsize
    parts = [
        header_bytes(time, frame), struct.pack("<III", 1, len(points), len(described)), *described,
        struct.pack("<BIII", 0, step, step * len(points), len(data)), data, b"\1",
    ]  # fmt: skip
    return b"".join(parts)


def _string(text: str) -> bytes:
    raw = text.encode()
    return struct.pack("<I", len(raw)) + raw
