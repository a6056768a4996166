"""Read camera frames from a folder of images."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import DataWarning, TimeNs
from calib_core.recordings.camera.jpeg import (
    JPEG_MAGIC,
    PNG_MAGIC,
    image_fault,
    image_size_px,
    is_cut_off,
    png_fault,
)
from calib_core.recordings.plain_files.file_stamps import stamp_files
from calib_core.recordings.plain_files.folder_cameras import FolderCamera, camera_beside
from calib_core.recordings.plain_files.source import (
    PlainOptions,
    PlainSource,
    image_channel,
    image_message,
    topic_of,
)

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp")
_FRAME = "camera"
_MAX_BYTES = 1 << 30
_SAMPLED = 8  # images whose checksums are read; if one is wrong, those of all


def open_image_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, known: PlainSource | None = None
) -> PlainSource:
    """Open a folder of images; files that cannot be images are left out, with a warning.

    Args:
        folder: of the images.
        files: the images.
        options: the user's.
        known: another folder, whose files have times.

    Raises:
        RecordingError: the files have no times, or none can be read.
    """
    faults = {file: fault for file in files if (fault := image_fault(file))}
    if any(_checksum_fault(file) for file in files[:: max(len(files) // _SAMPLED, 1)] if file not in faults):
        faults |= {file: fault for file in files if file not in faults and (fault := _checksum_fault(file))}
    sound = [file for file in files if file not in faults]
    if not sound:
        file, fault = next(iter(faults.items()))
        raise RecordingError(f"{folder}: none of its {len(files)} images can be read: {file.name} {fault}")
    stamped = stamp_files(folder, sound, options, known)
    camera = camera_beside(folder, stamped.files, image_size_px(stamped.files[0]))

    def message(row: int) -> bytes:
        return image_message(TimeNs(int(stamped.times_ns[row])), _FRAME, _image(stamped.files[row]))

    text = f"folder of images, {len(stamped.files)} files{_calibration_words(camera)}"
    source = stamped.source(folder, text, image_channel(topic_of(folder, "image")), message)
    warnings = (*_fault_warnings(folder, faults, len(files)), *_end_warnings(folder, sound), *source.warnings)
    return replace(source, warnings=warnings, camera=camera, unreadable=faults)


def _checksum_fault(file: Path) -> str:
    try:
        data = file.read_bytes()
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    return png_fault(data) if data.startswith(PNG_MAGIC) else ""


def _fault_warnings(folder: Path, faults: Mapping[Path, str], count: int) -> tuple[DataWarning, ...]:
    if not faults:
        return ()
    file, fault = next(iter(faults.items()))
    what = f"{len(faults)} of {count} images in {folder.name} cannot be read and are skipped; the first: {file.name} {fault}"
    return (DataWarning.reported("unreadable-pictures", what, "copy them again from their source if they matter"),)


def _end_warnings(folder: Path, files: Sequence[Path]) -> tuple[DataWarning, ...]:
    cut = [file.name for file in files if is_cut_off(file)]
    if not 0 < len(cut) <= len(files) / 2:  # some cameras never write the end
        return ()
    what = f"{len(cut)} of {len(files)} images in {folder.name} are cut off, and grey below; the first: {cut[0]}"
    return (
        DataWarning.reported("unreadable-pictures", what, "copy them again from their source; click nothing in them"),
    )


def _calibration_words(camera: FolderCamera | None) -> str:
    if camera is None:
        return ""
    return f"; intrinsics from {camera.file}" + (f"; {camera.pose}" if camera.pose else "")


def _image(path: Path) -> bytes:
    """Return a JPEG or PNG unchanged, and any other image losslessly as PNG."""
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise MessageError(f"{path.name} has {path.stat().st_size} bytes, which is too large for an image")
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
        raise MessageError(f"{path.name} is not a readable image (it begins with {data[:4].hex() or 'nothing'})")
    return bytes(cv2.imencode(".png", pixels)[1].tobytes())
