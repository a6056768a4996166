"""What a file is that was dropped on the page: decided by the readers of each kind."""

from collections.abc import Callable, Mapping

from calib_core.boxes import holds_boxes
from calib_core.errors import CalibrationError, InputError
from calib_core.file_tag import kind_of
from calib_core.input_files import name_text
from calib_core.interchange.cameras.files import holds_camera
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.documents import CLICKS_SCHEMA
from calib_core.recordings import begins_recording
from cocalib.web.messages.incoming import FileDropped
from cocalib.web.messages.outgoing import Dropped, DroppedKind


def sorted_file(file: FileDropped, *, has_camera: bool) -> Dropped:
    """Say what a dropped file is; a file that is a camera's and a calibration's too is what the recording lacks.

    Args:
        file: its name, and its content or the beginning of it.
        has_camera: whether the recording has intrinsics.

    Raises:
        InputError: it is a recording, too large, or nothing that the page takes; the message says what to do.
    """
    name, data = name_text(file.name), file.content
    if begins_recording(data):
        raise InputError(f"{name} is a recording: open it with: cocalib open {name}")
    if not file.is_whole:
        raise InputError(
            f"{name} is too large for the page; give it to a command, or a recording to cocalib open {name}"
        )
    text = data.decode(errors="replace")
    readers: Mapping[DroppedKind, Callable[[], bool]] = {
        "clicks": lambda: kind_of(data) == CLICKS_SCHEMA,
        "calibration": lambda: _reads(lambda: read_any(data, name)),
        "camera": lambda: holds_camera(text, name),
        "boxes": lambda: holds_boxes(data, name),
    }
    kinds = sorted(readers, key=lambda kind: kind == "calibration") if not has_camera else readers
    kind = next((kind for kind in kinds if readers[kind]()), None)
    if kind is None:
        raise InputError(f"{name} is no camera, clicks, calibration, boxes or recording of a known format")
    return Dropped(kind)


def _reads(read: Callable[[], object]) -> bool:
    try:
        read()
    except CalibrationError:
        return False
    return True
