"""Our own files: boxes (boxes-1: by stamp, edges in our pixels), and the true origin of simulated returns (labels-1)."""

from collections.abc import Iterable, Mapping
from typing import Any

from calib_core.boxes.formats.box_format import BoxFile, BoxFormat, FileBoxes, FileFrame
from calib_core.errors import InputError
from calib_core.interchange.own.detection_documents import (
    BOXES_SCHEMA,
    LABELS_SCHEMA,
    BoxDocument,
    BoxesDocument,
    FrameDocument,
    LabelsDocument,
)
from calib_core.interchange.syntax.strict_json import checked, document_text, parse_document
from calib_core.measurements import (
    Box,
    Boxes,
    FrameBoxes,
    ReturnLabels,
    TimeNs,
)


def _recognizes(file: BoxFile) -> bool:
    schema = file.mapping.get("schema")
    return isinstance(schema, str) and schema.startswith("cocalib/boxes-")


def _read(file: BoxFile) -> FileBoxes:
    boxes = own_boxes(file.mapping, file.source)
    return FileBoxes(
        tuple(FileFrame(frame.boxes, stamp=frame.image_time) for frame in boxes), image_size_px=boxes.image_size_px
    )


OWN = BoxFormat("our boxes-1", _recognizes, _read)


def boxes_text(boxes: Boxes) -> str:
    """Write boxes as boxes-1 text; the same boxes give the same bytes."""
    frames = [FrameDocument(frame.image_time, [_document(box) for box in frame.boxes]) for frame in boxes]
    return document_text(BoxesDocument(BOXES_SCHEMA, frames, boxes.image_size_px))


def own_boxes(content: Mapping[str, Any], source: str = "boxes") -> Boxes:
    """Return the boxes of parsed boxes-1; the frames are sorted by time.

    Args:
        content: the file's JSON.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    if content.get("schema") != BOXES_SCHEMA:
        found = str(content.get("schema"))
        raise InputError(
            f"{source}: schema: expected {BOXES_SCHEMA!r}, found {found!r}; a later version wrote it: update this program"
        )
    document = checked(content, BoxesDocument, source=source)
    frames = [
        FrameBoxes(
            frame.image_time,
            tuple(_box(box, f"{source}: frames[{at}].boxes[{which}]") for which, box in enumerate(frame.boxes)),
        )
        for at, frame in enumerate(document.frames)
    ]
    _refuse_repeated([frame.image_time for frame in frames], source=source, place="frames")
    return Boxes(tuple(sorted(frames, key=lambda frame: frame.image_time)), source, document.image_size_px)


def labels_text(labels: ReturnLabels) -> str:
    """Write the origin of returns as labels-1 text; the same labels give the same bytes."""
    return document_text(LabelsDocument(LABELS_SCHEMA, list(labels.scans)))


def read_labels(text: str, source: str = "labels") -> ReturnLabels:
    """Read labels-1 text; the scans are sorted by time, scans of one stamp stay in the file's order.

    Args:
        text: the file's content.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, LabelsDocument, source=source)
    return ReturnLabels(tuple(sorted(document.scans, key=lambda scan: scan.radar_time)), source)


def _document(box: Box) -> BoxDocument:
    sides = (float(box.left_px), float(box.top_px), float(box.right_px), float(box.bottom_px))
    return BoxDocument(sides, box.label, box.score, box.track)


def _box(box: BoxDocument, place: str) -> Box:
    left_px, top_px, right_px, bottom_px = box.box_px
    if left_px > right_px or top_px > bottom_px:
        raise InputError(
            f"{place}.box_px: expected left, top, right, bottom, found {list(box.box_px)}; correct the order"
        )
    return Box(left_px, top_px, right_px, bottom_px, box.label, box.score, box.track)


def _refuse_repeated(times: Iterable[TimeNs], *, source: str, place: str) -> None:
    first: dict[TimeNs, int] = {}
    for index, time in enumerate(times):
        if time in first:
            raise InputError(
                f"{source}: {place}[{first[time]}] and {place}[{index}] have the same stamp; join them into one"
            )
        first[time] = index
