"""Read boxes from a file, folder or zip archive of any known format, and match them to recorded frames.

The rule, which docs/boxes.md states: equal names of files are one frame; else a stamp, or a time in an image's name, is the
recorded frame within 1 ms of it; else a number counts the recorded frames from 0 or 1. A file whose stamps, count or images
differ is of another recording.

The formats are asked in the order of `BOX_FORMATS`. To add one: write its module in `formats/`, and add it there.
"""

import io
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.boxes.formats.box_format import BoxFile, BoxFormat, FileBoxes, FileFrame
from calib_core.boxes.formats.coco import COCO
from calib_core.boxes.formats.cvat import CVAT
from calib_core.boxes.formats.kitti import KITTI_OBJECTS, KITTI_TRACKS
from calib_core.boxes.formats.nuscenes import ANNOTATIONS, NUSCENES
from calib_core.boxes.formats.openlabel import OPENLABEL
from calib_core.boxes.formats.own import OWN
from calib_core.boxes.formats.yolo import YOLO
from calib_core.errors import InputError
from calib_core.input_files import file_text, name_text, other_kind, read_input
from calib_core.interchange.syntax.xml_places import parse_xml
from calib_core.measurements import Box, Boxes
from calib_core.parsing import json_value
from calib_core.recordings.box_topics import frames_of_stamps, joined_frames
from calib_core.recordings.plain_files.file_stamps import times_in_names

BOX_FORMATS: tuple[BoxFormat, ...] = (OWN, OPENLABEL, NUSCENES, COCO, CVAT, KITTI_TRACKS, KITTI_OBJECTS, YOLO)


def read_boxes(
    path: str | Path,
    *,
    image_times: TimesNs,
    image_size_px: tuple[int, int] | None,
    image_names: Sequence[str] = (),
) -> Boxes:
    """Read boxes of any known format, recognised by content, and give them the stamps of recorded frames.

    Args:
        path: of the file, of a folder with one file per frame, or of a zip archive of either.
        image_times: (m,) stamps of the recorded frames, ascending.
        image_size_px: width and height of the recorded images; None if unknown.
        image_names: (m,) of the frames' files without suffix; none if they are not files.

    Raises:
        InputError: it cannot be read, is of no known format, or belongs to another recording.
    """
    file = load_box_file(Path(path), image_size_px=image_size_px)
    return _boxes_in(file, image_times, image_names)


def boxes_from_bytes(
    data: bytes, name: str, *, image_times: TimesNs, image_size_px: tuple[int, int], image_names: Sequence[str] = ()
) -> Boxes:
    """Read boxes from the content of a file or of a zip archive, as `read_boxes` does.

    Args:
        data: the content.
        name: the file's, for messages and for what its ending says.
        image_times: (m,) stamps of the recorded frames, ascending.
        image_size_px: width and height of the recorded images.
        image_names: (m,) of the frames' files without suffix; none if they are not files.

    Raises:
        InputError: it cannot be read, is of no known format, or belongs to another recording.
    """
    return _boxes_in(_sent_file(data, name, image_size_px), image_times, image_names)


def holds_boxes(data: bytes, name: str) -> bool:
    """Return whether a content is of a known format of boxes, of whatever recording."""
    try:
        file = _sent_file(data, name, None)
        return any(known.recognizes(file) for known in BOX_FORMATS)
    except InputError:
        return False


def _sent_file(data: bytes, name: str, image_size_px: tuple[int, int] | None) -> BoxFile:
    """Parse what was sent instead of named by a path."""
    source = name_text(Path(name).name) or "boxes"
    members = _archive(data, source) if data.startswith(b"PK") else {source: data}
    return _box_file(source, members, image_size_px)


def _boxes_in(file: BoxFile, image_times: TimesNs, image_names: Sequence[str]) -> Boxes:
    file = replace(file, image_names=tuple(image_names))
    for known in BOX_FORMATS:
        if known.recognizes(file):
            return matched_boxes(
                known.read(file),
                file.source,
                image_times=image_times,
                image_size_px=file.image_size_px,
                image_names=image_names,
            )
    names = ", ".join(known.name for known in BOX_FORMATS)
    schema = file.value.get("schema") if isinstance(file.value, dict) else None
    reason = other_kind(schema, _IS_WHAT) or f"is no known file of boxes; known: {names}"
    raise InputError(f"{file.source}: {reason}")


_MAX_BYTES = 256 * 1024 * 1024
_MOST_XML_MARKS = 500_000
_MOST_MEMBERS = 200_000
_IS_WHAT = "a file of boxes"
_SUFFIXES = (".txt", ".yaml", ".yml", ".json", ".xml", ".names")

_DAMAGED = (
    EOFError,
    LookupError,
    NotImplementedError,
    OSError,
    RuntimeError,
    ValueError,
    zlib.error,
    zipfile.BadZipFile,
)


def load_box_file(path: Path, *, image_size_px: tuple[int, int] | None) -> BoxFile:
    """Load what a user names.

    Args:
        path: of a file, a folder or a zip archive.
        image_size_px: width and height of the recorded images; None if unknown.

    Raises:
        InputError: it cannot be read, is damaged, or is too large.
    """
    source = name_text(path.name or path)
    try:
        if path.is_dir():
            files = {name_text(inner.relative_to(path).as_posix()): inner for inner in _text_files(path)}
            if any(inner.name == f"{ANNOTATIONS}.json" for inner in files.values()):
                return BoxFile(source, members=dict.fromkeys(files, ""), tables=path, image_size_px=image_size_px)
            members = _folder(path, files)
        else:
            data = read_input(path, max_bytes=_MAX_BYTES, is_what=_IS_WHAT)
            members = _archive(data, source) if data.startswith(b"PK") else {path.name: data}
    except OSError as error:
        raise InputError(f"{name_text(path)}: cannot be read: {error.strerror}; check the path") from None
    return _box_file(source, members, image_size_px)


def _box_file(source: str, members: Mapping[str, bytes], image_size_px: tuple[int, int] | None) -> BoxFile:
    """Parse the content of a file, or of the files of a folder or archive by their names."""
    alone = next(iter(members.items())) if len(members) == 1 else None
    text = _text(alone[1], source) if alone else ""
    start = text.lstrip()[:1]
    if start in ("{", "["):
        return BoxFile(source, value=json_value(text, source=source), image_size_px=image_size_px)
    if start == "<":
        return BoxFile(
            source, root=parse_xml(text, source=source, most_marks=_MOST_XML_MARKS), image_size_px=image_size_px
        )
    texts = {name_text(name): _text(data, f"{source}/{name_text(name)}") for name, data in members.items()}
    return BoxFile(source, members=texts, image_size_px=image_size_px)


def _folder(path: Path, files: Mapping[str, Path]) -> dict[str, bytes]:
    """Read the text files of a folder and its subfolders."""
    if len(files) > _MOST_MEMBERS:
        raise InputError(f"{name_text(path)}: has more than {_MOST_MEMBERS} files; give the folder of one recording")
    if not files:
        raise InputError(f"{name_text(path)}: has no file of boxes ({', '.join(_SUFFIXES)}); is it the right folder?")
    members: dict[str, bytes] = {}
    left = _MAX_BYTES
    for name, inner in files.items():
        members[name] = read_input(inner, max_bytes=left, is_what=_IS_WHAT)
        left -= len(members[name])
    return members


def _text_files(path: Path) -> Iterator[Path]:
    """Yield the text files of a folder, sorted, at most two folders down."""
    for pattern in ("*", "*/*", "*/*/*"):
        yield from sorted(
            inner for inner in path.glob(pattern) if inner.suffix.lower() in _SUFFIXES and inner.is_file()
        )


def _archive(data: bytes, source: str) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            wanted = [
                member
                for member in archive.infolist()
                if member.filename.lower().endswith(_SUFFIXES) and not member.filename.startswith("__MACOSX")
            ]
            if len(wanted) > _MOST_MEMBERS or sum(member.file_size for member in wanted) > _MAX_BYTES:
                raise InputError(
                    f"{source}: unpacks to more than {_MAX_BYTES >> 20} MB; unpack it, and give the folder of its boxes"
                )
            members = {member.filename: archive.open(member).read(member.file_size) for member in wanted}
    except _DAMAGED as error:
        raise InputError(f"{source}: a damaged zip archive ({error}); export it again") from None
    if not members:
        raise InputError(f"{source}: contains no file of boxes ({', '.join(_SUFFIXES)}); is it the right archive?")
    return members


def _text(data: bytes, source: str) -> str:
    try:
        return file_text(data)
    except UnicodeDecodeError as error:
        raise InputError(f"{source}: not text (byte {error.start} is not UTF-8); give {_IS_WHAT}") from None


_LEAST_INSIDE = 0.5
_DIGITS = re.compile(r"[0-9]+")
_OTHER = "is it of another recording?"


def matched_boxes(
    boxes: FileBoxes,
    source: str,
    *,
    image_times: TimesNs,
    image_size_px: tuple[int, int] | None,
    image_names: Sequence[str] = (),
) -> Boxes:
    """Give the frames of a file the stamps of recorded frames.

    Args:
        boxes: the file's content.
        source: its name, for messages.
        image_times: (m,) stamps of the recorded frames, ascending.
        image_size_px: width and height of the recorded images; None if unknown.
        image_names: (m,) of the frames' files without suffix; none if they are not files.

    Raises:
        InputError: the file does not belong to the recording.
    """
    if not len(image_times):
        raise InputError(
            f"{source}: the recording has no camera frames that boxes could belong to; add the camera's file"
        )
    if not boxes.frames:
        raise InputError(f"{source}: has no annotated frame; export it again with its frames")
    _refuse_other_images(boxes, source, image_size_px)
    by_name = _by_name(boxes.frames, image_names)
    stamps = _stamps_of(boxes.frames) if by_name is None else None
    if by_name is not None:
        places, notes = by_name
    elif stamps is not None:
        places, notes = frames_of_stamps(stamps, source, image_times)
    else:
        places, notes = _by_number(boxes, source, len(image_times))
    frames = joined_frames([frame.boxes for frame in boxes.frames], places, image_times)
    return Boxes(frames, source, image_size_px or boxes.image_size_px, (*boxes.notes, *notes))


def _refuse_other_images(found: FileBoxes, source: str, image_size_px: tuple[int, int] | None) -> None:
    """Refuse boxes that were made on images of another size, or that lie beside the image.

    Raises:
        InputError: they were.
    """
    if image_size_px is None:
        return
    width, height = image_size_px
    if found.image_size_px is not None and found.image_size_px != image_size_px:
        made_width, made_height = found.image_size_px
        raise InputError(
            f"{source}: its boxes were made on images of {made_width} x {made_height} px, the recorded ones have "
            f"{width} x {height}; export the boxes for the recorded images, or give the other camera's topic"
        )
    boxes = [box for frame in found.frames for box in frame.boxes]
    inside = sum(_touches(box, width, height) for box in boxes)
    if boxes and inside < _LEAST_INSIDE * len(boxes):
        raise InputError(
            f"{source}: {len(boxes) - inside} of {len(boxes)} boxes lie outside the image of {width} x {height} px; "
            f"{_OTHER}"
        )


def _touches(box: Box, width_px: int, height_px: int) -> bool:
    centre_u_px, centre_v_px = (box.left_px + box.right_px) / 2, (box.top_px + box.bottom_px) / 2
    return -0.5 <= centre_u_px <= width_px - 0.5 and -0.5 <= centre_v_px <= height_px - 0.5


def _by_name(frames: Sequence[FileFrame], image_names: Sequence[str]) -> tuple[Indices, tuple[str, ...]] | None:
    """Return the recorded frame of each frame by the name of its image, -1 for none, and notes; None if no name is equal."""
    place_of = {name: index for index, name in enumerate(image_names)}
    places = np.array([place_of.get(frame.name, -1) for frame in frames], dtype=np.int64)
    matched = int(np.count_nonzero(places >= 0))
    if not matched:
        return None
    left_out = len(places) - matched
    others = f"; {left_out} others are not among the recorded images, and are left out" if left_out else ""
    return places, (f"{matched} annotated frames have the names of recorded images, and are matched by them{others}",)


def _stamps_of(frames: Sequence[FileFrame]) -> TimesNs | None:
    """Return the stamp of each frame: stated, or in its image's name; None if any frame has none."""
    if all(frame.stamp is not None for frame in frames):
        return np.array([frame.stamp for frame in frames], dtype=np.int64)
    names = [frame.name for frame in frames]
    named = times_in_names(names) if all(names) else None
    return named.times_ns if named is not None and len(named.places) == len(names) else None


def _by_number(boxes: FileBoxes, source: str, count: int) -> tuple[Indices, tuple[str, ...]]:
    """Return the recorded frame of each frame by its number, and what was assumed.

    Raises:
        InputError: frames have no number, or the numbers do not fit the recorded frames.
    """
    numbers = _numbers_of(boxes.frames, source)
    if boxes.frame_count is not None and boxes.frame_count != count:
        raise InputError(
            f"{source}: is for a sequence of {boxes.frame_count} frames, the recording has {count}; {_OTHER}"
        )
    first, why = _first_number(boxes, numbers, count)
    places = numbers - first
    if places.min() < 0 or places.max() >= count:
        raise InputError(
            f"{source}: has frames numbered {numbers.min()} to {numbers.max()}, which do not fit the recording's {count} "
            f"frames counted from {first}; {_OTHER}"
        )
    listed = len(np.unique(numbers))
    note = f"the file has no stamps; its frame number {first} is taken for the first recorded frame ({why})"
    part = f"{listed} of the recording's {count} frames are annotated"
    return places, (note, part) if listed < count else (note,)


def _numbers_of(frames: Sequence[FileFrame], source: str) -> Indices:
    """Return the number of each frame: stated, else in its image's name.

    Raises:
        InputError: an image's name has no number.
    """
    groups = [_DIGITS.findall(frame.name) for frame in frames]
    for frame, found in zip(frames, groups, strict=True):
        if frame.number is None and not found:
            raise InputError(
                f"{source}: the image {frame.name!r} has neither a time nor a number in its name, so its recorded frame "
                "is unknown; name the images by their stamps in nanoseconds"
            )
    which = _counting_group([found for frame, found in zip(frames, groups, strict=True) if frame.number is None])
    numbers = [
        int(found[which][-18:]) if frame.number is None else frame.number
        for frame, found in zip(frames, groups, strict=True)
    ]
    return np.array(numbers, dtype=np.int64)


def _counting_group(groups: Sequence[Sequence[str]]) -> int:
    """Return which number in a name counts the frames: the last that differs between all, as in 000012_camera0; else the last."""
    for which in range(-1, -1 - min(map(len, groups), default=0), -1):
        if len({found[which] for found in groups}) == len(groups):
            return which
    return -1


def _first_number(boxes: FileBoxes, numbers: Indices, count: int) -> tuple[int, str]:
    """Return the number of the sequence's first frame, and how it is known."""
    lowest, highest = int(numbers.min()), int(numbers.max())
    if boxes.first_number is not None:
        return boxes.first_number, "as the format defines"
    if len(np.unique(numbers)) == count and highest - lowest == count - 1:
        return lowest, "there are as many as recorded frames"
    if lowest == 0:
        return 0, "the file counts from 0"
    if highest == count:
        return 1, "its last number is the number of recorded frames"
    if lowest == 1:
        return 1, "the file begins with 1"
    return 0, "assumed; check a box in the overlay"
