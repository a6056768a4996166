"""Parse JPEG and PNG files without decoding: image size, and repairs that change no pixel."""

import struct
from collections.abc import Iterator

from calib_core.errors import MessageError

JPEG_MAGIC = b"\xff\xd8\xff"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_END = b"\xff\xd9"
_START_OF_SCAN = 0xDA
_APP1 = 0xE1
_ALONE = frozenset({0x01, *range(0xD0, 0xD9)})
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def repaired_jpeg(data: bytes) -> tuple[bytes, int, int]:
    """Return a JPEG ready for any decoder, with its width and height [px].

    The recorded bytes are kept except for two repairs: Exif blocks are removed (a viewer would rotate the picture by
    their orientation, away from the camera's pixels), and a missing end marker is added (browsers require it).

    Raises:
        MessageError: not a JPEG, or cut off before the image data.
    """
    if not data.startswith(JPEG_MAGIC):
        raise MessageError(f"begins with {data[:4].hex() or 'nothing'}, which is not a JPEG")
    size, kept_from = None, 0
    kept: list[bytes] = []
    for marker, place, after in _segments(data):
        if marker in _FRAMES and place + 9 <= len(data):
            size = struct.unpack_from(">HH", data, place + 5)
        if marker == _APP1 and data[place + 4 : place + 10] == b"Exif\0\0":
            kept.append(data[kept_from:place])
            kept_from = after
    if size is None:
        raise MessageError("the JPEG ends before its image data")
    if kept:
        data = b"".join([*kept, data[kept_from:]])
    height, width = size
    return (data if has_end(data) else data + _END), width, height


def has_end(data: bytes) -> bool:
    """Return whether a JPEG ends with its end marker, or shortly before its end: some cameras pad with zeros."""
    return _END in data[-1024:]


def _segments(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield the segments before the image data: marker, its offset, and the offset of the next."""
    place = 2
    while place + 4 <= len(data):
        marker = data[place + 1]
        if data[place] != 0xFF:
            raise MessageError(f"the JPEG is damaged at byte {place}")
        if marker == _START_OF_SCAN:
            return
        if marker == 0xFF or marker in _ALONE:
            place += 1 if marker == 0xFF else 2
            continue
        after = place + 2 + max(int(struct.unpack_from(">H", data, place + 2)[0]), 2)
        yield marker, place, after
        place = after


def png_size(data: bytes) -> tuple[int, int, int, int]:
    """Return width, height, bits per channel and colour type of a PNG.

    Raises:
        MessageError: the header block is missing.
    """
    if len(data) < 26 or data[12:16] != b"IHDR":
        raise MessageError("the PNG has no header")
    width, height, bits, colour = struct.unpack_from(">IIBB", data, 16)
    return width, height, bits, colour
