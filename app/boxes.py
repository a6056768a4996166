"""Find the boxes and labels that a user names on the command line."""

from pathlib import Path

from calib_core.boxes import read_boxes, read_labels
from calib_core.detections import Boxes, ReturnLabels
from calib_core.errors import InputError, MessageError
from calib_core.input_files import file_text, read_input
from calib_core.recordings import Recording

__all__ = ["find_boxes", "find_labels"]

_MAX_LABELS_BYTES = 256 * 1024 * 1024


def find_boxes(file_or_topic: str, recording: Recording) -> Boxes:
    """Return the boxes of a file, folder or zip archive.

    Args:
        file_or_topic: what the user gave.
        recording: that the boxes belong to.

    Raises:
        InputError: there is no such file, it is of no known format, or belongs to another recording.
    """
    path = Path(file_or_topic)
    if not path.exists():
        raise InputError(f"{file_or_topic}: no such file; give a file of boxes")
    return read_boxes(path, image_times=recording.image_times, image_size_px=_image_size_px(recording))


def find_labels(path: Path) -> ReturnLabels:
    """Return the true origin of a simulated recording's returns, from its labels.json.

    Raises:
        InputError: it cannot be read.
    """
    try:
        text = file_text(read_input(path, max_bytes=_MAX_LABELS_BYTES, is_what="a file of labels"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text (byte {error.start} is not UTF-8); give a file of labels") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check the path") from None
    return read_labels(text, path.name)


def _image_size_px(recording: Recording) -> tuple[int, int] | None:
    """Return the width and height of the recorded pictures; None if the first cannot be read."""
    if not len(recording.image_times):
        return None
    try:
        height_px, width_px = recording.image(0).shape[:2]
    except MessageError:
        return None
    return width_px, height_px
