"""Our own boxes-1: frames by their stamps, box edges in our pixels."""

from calib_core.boxes.file_frames import FileBoxes, FileFrame
from calib_core.boxes.formats.box_format import BoxFile, BoxFormat
from calib_core.boxes.own_files import own_boxes


def _recognizes(file: BoxFile) -> bool:
    schema = file.mapping.get("schema")
    return isinstance(schema, str) and schema.startswith("cocalib/boxes-")


def _read(file: BoxFile) -> FileBoxes:
    boxes = own_boxes(file.mapping, file.source)
    return FileBoxes(
        tuple(FileFrame(frame.boxes, stamp=frame.image_time) for frame in boxes), image_size_px=boxes.image_size_px
    )


OWN = BoxFormat("our boxes-1", _recognizes, _read)
