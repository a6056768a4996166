"""The packets that TI's mmWave demos send over the data port: header, type-length-value items, points.

Layouts are those of TI's mmWave SDK: version 3 with positions in metres as floats, versions 1 and 2 in fixed point. TI counts
x to the right, y forward and z up; points are returned as x forward, y left, z up.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

MAGIC = b"\x02\x01\x04\x03\x06\x05\x08\x07"
MAX_PACKET_BYTES = 1 << 20
_HEADER = struct.Struct("<8s7I")
_HEADER_SIZES = (_HEADER.size + 4, _HEADER.size)
"""With the number of the subframe, and without it (SDK 1 and xWR14xx)."""

_TLV = struct.Struct("<II")
_MAX_ITEMS = 64
_POINTS, _SIDE_INFO = 1, 7
_PAD_BYTES = 32
_NAMES: Mapping[int, str] = {
    1: "points", 2: "range profile", 3: "noise profile", 4: "azimuth heat map", 5: "range-Doppler heat map", 6: "statistics",
    7: "SNR and noise", 8: "azimuth-elevation heat map", 9: "temperature",
}  # fmt: skip
_FLOATS = np.dtype([(name, "<f4") for name in ("right", "forward", "up", "velocity")])
_FIXED = np.dtype([
    ("range_index", "<u2"), ("doppler_index", "<i2"), ("peak", "<u2"), ("right", "<i2"), ("forward", "<i2"), ("up", "<i2"),
])  # fmt: skip
_SIDE = np.dtype([("snr", "<i2"), ("noise", "<i2")])
_RETURNS = np.dtype([(name, "<f4") for name in ("x", "y", "z", "velocity", "snr")])
_FIXED_RETURNS = np.dtype([(name, "<f4") for name in ("x", "y", "z", "power")])


@dataclass(frozen=True, slots=True)
class Tlv:
    """One item of a packet: its kind, and where its value lies in the packet."""

    kind: int
    start: int
    size: int


@dataclass(frozen=True, slots=True)
class Packet:
    """The head of one packet.

    Attributes:
        version: major version of the SDK.
        size: total number of bytes.
        platform: the chip, such as 0xA1843.
        frame: number of the frame, from 1 since the sensor was started.
        cycles: processor cycles when it was sent, modulo 2 ** 32.
        count: number of detected points.
        items: what it contains.
    """

    version: int
    size: int
    platform: int
    frame: int
    cycles: int
    count: int
    items: tuple[Tlv, ...]


def item_name(kind: int) -> str:
    """Name the kind of an item."""
    return _NAMES.get(kind, f"items of type {kind}")


def packet_in(data: bytes) -> Packet | None:
    """Read the packet that data begins with; None if it is cut off or its items do not fit into it."""
    if len(data) < _HEADER.size or not data.startswith(MAGIC):
        return None
    _, version, size, platform, frame, cycles, count, items = _HEADER.unpack_from(data)
    if not _HEADER.size <= size <= min(len(data), MAX_PACKET_BYTES) or items > _MAX_ITEMS:
        return None
    for header in _HEADER_SIZES:
        for inclusive in (0, _TLV.size):  # some demos count the item's own head
            found = _items(data[:size], header, items, inclusive)
            packet = Packet(version >> 24, size, platform, frame, cycles, count, found or ())
            if found is not None and _fits(packet, data):
                return packet
    return None


def _items(data: bytes, place: int, count: int, inclusive: int) -> tuple[Tlv, ...] | None:
    """Read the chain of items; None if it does not end with the packet, up to padding."""
    found = []
    for _ in range(count):
        if place + _TLV.size > len(data):
            return None
        kind, size = _TLV.unpack_from(data, place)
        size -= inclusive
        if size < 0 or place + _TLV.size + size > len(data):
            return None
        found.append(Tlv(kind, place + _TLV.size, size))
        place += _TLV.size + size
    return tuple(found) if 0 <= len(data) - place < _PAD_BYTES else None


def _fits(packet: Packet, data: bytes) -> bool:
    """Return whether the sizes of the points and of their side information agree with their number."""
    wanted = {_POINTS: packet.count * _FLOATS.itemsize, _SIDE_INFO: packet.count * _SIDE.itemsize}
    for item in packet.items:
        size = wanted.get(item.kind, item.size)
        if item.kind == _POINTS and _fixed_point(packet, item):
            size = 4 + packet.count * _FIXED.itemsize
            if struct.unpack_from("<H", data, item.start)[0] != packet.count:
                return False
        if item.size != size:
            return False
    return packet.count == 0 or any(item.kind == _POINTS for item in packet.items)


def _fixed_point(packet: Packet, item: Tlv) -> bool:
    return packet.version < 3 and item.size >= 4


def points_of(packet: Packet, data: bytes) -> np.ndarray:
    """Return the points of a packet (n,): x forward, y left, z up [m], and what else they have.

    SDK 3 gives the radial speed [m/s] and, if it is sent, the SNR [dB]; older ones give the strength of the peak, and the
    Doppler only as the number of a bin, whose size the stream does not state.
    """
    item = next((item for item in packet.items if item.kind == _POINTS), None)
    if item is None:
        return np.zeros(0, dtype=_FIXED_RETURNS if packet.version < 3 else _RETURNS)
    if _fixed_point(packet, item):
        shift = struct.unpack_from("<H", data, item.start + 2)[0] & 15
        raw = np.frombuffer(data, dtype=_FIXED, count=packet.count, offset=item.start + 4)
        returns = np.zeros(packet.count, dtype=_FIXED_RETURNS)
        returns["power"] = raw["peak"]
        scale = 2.0**-shift
    else:
        raw = np.frombuffer(data, dtype=_FLOATS, count=packet.count, offset=item.start)
        returns = np.zeros(packet.count, dtype=_RETURNS)
        returns["velocity"] = raw["velocity"]
        returns["snr"] = _snr_db(packet, data)
        scale = 1.0
    returns["x"], returns["y"], returns["z"] = raw["forward"] * scale, -raw["right"] * scale, raw["up"] * scale
    return returns


def _snr_db(packet: Packet, data: bytes) -> np.ndarray:
    """Return the SNR of each point [dB]; NaN if it is not sent."""
    item = next((item for item in packet.items if item.kind == _SIDE_INFO), None)
    if item is None:
        return np.full(packet.count, np.nan)
    side = np.frombuffer(data, dtype=_SIDE, count=packet.count, offset=item.start)
    return np.asarray(side["snr"] * 0.1)
