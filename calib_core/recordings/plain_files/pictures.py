"""Read camera frames from a folder of pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC
from calib_core.recordings.plain_files.file_stamps import stamp_files
from calib_core.recordings.plain_files.messages import picture_channel, picture_message
from calib_core.recordings.plain_files.source import PlainSource, topic_of

__all__ = ["PICTURE_SUFFIXES", "open_picture_folder"]

PICTURE_SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp")
_FRAME = "camera"
_MAX_BYTES = 1 << 30


def open_picture_folder(folder: Path, files: Sequence[Path]) -> PlainSource:
    """Open a folder of pictures.

    Raises:
        RecordingError: the files have no times.
    """
    stamped = stamp_files(folder, files)

    def message(row: int) -> bytes:
        return picture_message(TimeNs(int(stamped.times_ns[row])), _FRAME, _picture(stamped.files[row]))

    return PlainSource(
        folder,
        sum(file.stat().st_size for file in stamped.files),
        f"folder of images, {len(stamped.files)} files",
        picture_channel(topic_of(folder, "image")),
        stamped.times_ns,
        message,
        stamped.warnings,
        file_of=lambda row: stamped.files[row],
    )


def _picture(path: Path) -> bytes:
    """Return a JPEG or PNG unchanged, and any other picture losslessly as PNG."""
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise MessageError(f"{path.name} has {path.stat().st_size} bytes, which is too large for a picture")
        data = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}; is it still there?") from error
    if data.startswith((JPEG_MAGIC, PNG_MAGIC)):
        return data
    import cv2

    pixels = (
        cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        if data
        else None
    )
    if pixels is None:
        raise MessageError(f"{path.name} is not a readable picture (it begins with {data[:4].hex() or 'nothing'})")
    return bytes(cv2.imencode(".png", pixels)[1].tobytes())
