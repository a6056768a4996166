"""Look at a picture file without decoding it: its size, and whether it can be a picture at all."""

from pathlib import Path

from calib_core.errors import MessageError
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC, png_size, repaired_jpeg

_HEAD_BYTES = 1 << 12
_PNG_END = b"IEND"
_BEGINNINGS = (b"BM", b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"II*\0", b"MM\0*", b"RIFF")


def picture_fault(path: Path) -> str:
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
    return "" if head.startswith(_BEGINNINGS) else f"is not a picture (it begins with {head[:4].hex()})"


def _jpeg_fault(head: bytes, path: Path) -> str:
    try:
        repaired_jpeg(head)
    except MessageError:
        try:
            repaired_jpeg(path.read_bytes())
        except MessageError as error:
            return f"cannot be read: {error}"
    return ""


def picture_size_px(path: Path) -> tuple[int, int] | None:
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
