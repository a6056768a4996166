"""Find the boxes that a user names."""

from calib_core.detections import Boxes
from calib_core.errors import InputError
from calib_core.recordings import Recording

__all__ = ["find_boxes"]


def find_boxes(file_or_topic: str, recording: Recording) -> Boxes:
    """Return the boxes of a file or a topic."""
    raise InputError(f"{file_or_topic}: cannot be read in {recording.name}")
