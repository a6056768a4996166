"""Find the boxes and labels that a user names on the command line."""

from collections.abc import Callable
from pathlib import Path

from calib_core.boxes import MOVING, changed_boxes, read_boxes, read_labels
from calib_core.errors import InputError, MessageError
from calib_core.input_files import read_text
from calib_core.measurements import Boxes, ReturnLabels
from calib_core.recordings import Recording

_MAX_LABELS_BYTES = 256 * 1024 * 1024


def find_boxes(
    file_or_topic: str, recording: Recording, *, progress: Callable[[int, int], None] | None = None
) -> Boxes:
    """Return the boxes of a file, folder or zip archive, of a topic, or, for the word moving, of what changes in the image.

    Args:
        file_or_topic: what the user gave; a file or folder of that name comes first.
        recording: that the boxes belong to.
        progress: called with the frames looked at and their number, if boxes are found in the images.

    Raises:
        InputError: there is no such file or topic, it is of no known format, or belongs to another recording.
        MessageError: the topic's messages cannot be read.
    """
    path = Path(file_or_topic)
    if _exists(path):
        return read_boxes(
            path,
            image_times=recording.image_times,
            image_size_px=_image_size_px(recording),
            image_names=recording.image_names,
        )
    if any(topic.name == file_or_topic for topic in recording.topics):
        return recording.boxes(file_or_topic)
    if file_or_topic == MOVING:
        return changed_boxes(recording.image, recording.image_times, source=recording.name, progress=progress)
    able = ", ".join(topic.name for topic in recording.topics if topic.has_boxes)
    topics = f"its topics with boxes: {able}" if able else "none of its topics has boxes"
    raise InputError(
        f"{file_or_topic}: is neither a file nor a topic of {recording.name} ({topics}); give one, or the word {MOVING} "
        "for whatever moves before a fixed camera"
    )


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that no file can have
        return False


def find_labels(path: Path) -> ReturnLabels:
    """Return the true origin of a simulated recording's returns, from its labels.json.

    Raises:
        InputError: it cannot be read.
    """
    return read_labels(read_text(path, max_bytes=_MAX_LABELS_BYTES, is_what="a file of labels"), path.name)


def _image_size_px(recording: Recording) -> tuple[int, int] | None:
    """Return the width and height of the recorded images; None if the first cannot be read."""
    if not len(recording.image_times):
        return None
    try:
        height_px, width_px = recording.image(0).shape[:2]
    except MessageError:
        return None
    return width_px, height_px
