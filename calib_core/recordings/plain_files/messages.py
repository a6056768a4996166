"""Pictures and radar returns from plain files, as the messages everything else reads: ROS 1 serialisation."""

import struct

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.containers.sources import Channel

__all__ = ["cloud_channel", "cloud_message", "header_bytes", "picture_channel", "picture_message"]

_CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def picture_channel(topic: str) -> Channel:
    """Return a channel of pictures."""
    return Channel(0, topic, "sensor_msgs/CompressedImage", "ros1", "", "")


def cloud_channel(topic: str) -> Channel:
    """Return a channel of radar returns."""
    return Channel(0, topic, "sensor_msgs/PointCloud2", "ros1", "", "")


def header_bytes(time: TimeNs, frame: str) -> bytes:
    """Return a header."""
    sec, nanosec = divmod(int(time), NS_PER_S)
    return struct.pack("<III", 0, sec, nanosec) + _string(frame)


def picture_message(time: TimeNs, frame: str, data: bytes) -> bytes:
    """Return a CompressedImage; what its bytes are, they say themselves."""
    return header_bytes(time, frame) + _string("") + struct.pack("<I", len(data)) + data


def cloud_message(time: TimeNs, frame: str, points: np.ndarray) -> bytes:
    """Return a PointCloud2.

    Args:
        time: its stamp.
        frame: its frame_id.
        points: (n,) structured, little endian; fields of types that a cloud has not are left out of the description.
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
