"""Look at JPEG and PNG files without decoding them: whether they are whole, their size, and repairs that change no pixel."""

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from calib_core.errors import MessageError

JPEG_MAGIC = b"\xff\xd8\xff"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_END = b"\xff\xd9"
_START_OF_SCAN = 0xDA
_APP1 = 0xE1
_ALONE = frozenset({0x01, *range(0xD0, 0xD9)})
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_HEAD_BYTES = 1 << 12
_PNG_END = b"IEND"
_BEGINNINGS = (b"BM", b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"II*\0", b"MM\0*", b"RIFF")


def repaired_jpeg(data: bytes) -> tuple[bytes, int, int]:
    """Return a JPEG ready for any decoder, with its width and height [px].

    The recorded bytes are kept except for two repairs: Exif blocks are removed (a viewer would rotate the image by
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


def is_cut_off(path: Path) -> bool:
    """Return whether a file is a JPEG without its end; its beginning can be decoded."""
    try:
        with path.open("rb") as file:
            is_jpeg = file.read(len(JPEG_MAGIC)) == JPEG_MAGIC
            file.seek(-min(path.stat().st_size, 1024), os.SEEK_END)
            return is_jpeg and not has_end(file.read())
    except OSError:
        return False


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
    """Return width, height, bits per channel and color type of a PNG.

    Raises:
        MessageError: the header block is missing.
    """
    if len(data) < 26 or data[12:16] != b"IHDR":
        raise MessageError("the PNG has no header")
    width, height, bits, colour = struct.unpack_from(">IIBB", data, 16)
    return width, height, bits, colour


def png_fault(data: bytes) -> str:
    """Say what the checksums of the parts that a PNG needs show; "" if it is whole."""
    place = len(PNG_MAGIC)
    while place + 12 <= len(data):
        end = place + 8 + int(struct.unpack_from(">I", data, place)[0])
        is_needed = not data[place + 4] & 0x20
        wrong = data[end : end + 4] != struct.pack(">I", zlib.crc32(data[place + 4 : end]))
        if end + 4 > len(data) or (is_needed and wrong):
            return f"is a PNG damaged after byte {place}"
        if data[place + 4 : place + 8] == _PNG_END:
            return ""
        place = end + 4
    return "is a PNG that is cut off"


def image_fault(path: Path) -> str:
    """Say why a file cannot be decoded, judging by its first and last bytes; "" if it looks whole."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
            if not head:
                return "has no bytes"
            if head.startswith(PNG_MAGIC):
                file.seek(max(path.stat().st_size - 16, 0))
                return "" if _PNG_END in file.read() else "is cut off"
            if head.startswith(JPEG_MAGIC):
                return _jpeg_fault(head, path)
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    return "" if head.startswith(_BEGINNINGS) else f"is not an image (it begins with {head[:4].hex()})"


def _jpeg_fault(head: bytes, path: Path) -> str:
    try:
        repaired_jpeg(head)
    except MessageError:
        try:
            repaired_jpeg(path.read_bytes())
        except MessageError as error:
            return f"cannot be read: {error}"
    return ""


def image_size_px(path: Path) -> tuple[int, int] | None:
    """Return width and height of a JPEG or PNG file; None for others, and for damaged ones."""
    try:
        data = path.read_bytes()
        if data.startswith(PNG_MAGIC):
            return png_size(data)[:2]
        if data.startswith(JPEG_MAGIC):
            _, width, height = repaired_jpeg(data)
            return width, height
    except (OSError, MessageError):
        return None
    return None
