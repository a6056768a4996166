"""Read boxes from a file, folder or zip archive of any known format, and match them to recorded frames."""

from pathlib import Path

from calib_core.arrays import TimesNs
from calib_core.boxes.box_files import load_box_file
from calib_core.boxes.formats.registry import BOX_FORMATS
from calib_core.boxes.matching import matched_boxes
from calib_core.detections import Boxes
from calib_core.errors import InputError
from calib_core.input_files import name_text


def read_boxes(path: str | Path, *, image_times: TimesNs, image_size_px: tuple[int, int] | None) -> Boxes:
    """Read boxes of any known format, recognised by content, and give them the stamps of recorded frames.

    Args:
        path: of the file, of a folder with one file per frame, or of a zip archive of either.
        image_times: (m,) stamps of the recorded frames, ascending.
        image_size_px: width and height of the recorded pictures; None if unknown.

    Raises:
        InputError: it cannot be read, is of no known format, or belongs to another recording.
    """
    file = load_box_file(Path(path), image_size_px=image_size_px)
    for known in BOX_FORMATS:
        if known.recognizes(file):
            found = known.read(file)
            return matched_boxes(found, file.source, image_times=image_times, image_size_px=image_size_px)
    names = ", ".join(known.name for known in BOX_FORMATS)
    raise InputError(f"{name_text(Path(path))}: is no known file of boxes; known: {names}")
