"""ASAM OpenLABEL 1.0: objects by frame, each with bbox [centre u, centre v, width, height] or a turned rbbox."""

from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    finite_number,
    rotated_box,
    whole_number,
)
from calib_core.errors import InputError, RecordingError
from calib_core.measurements import Box, TimeNs
from calib_core.recordings.time.written_times import read_time


def _root(file: BoxFile) -> Mapping[str, Any]:
    return _part(file.mapping, "openlabel") or _part(file.mapping, "vcd")


def _part(parent: Any, key: str) -> Mapping[str, Any]:
    value = parent.get(key) if isinstance(parent, dict) else None
    return value if isinstance(value, dict) else {}


def _recognizes(file: BoxFile) -> bool:
    return bool(_part(_root(file), "frames"))


def _read(file: BoxFile) -> FileBoxes:
    root = _root(file)
    objects = _part(root, "objects")
    cameras: set[str] = set()
    frames = []
    for number, frame in _part(root, "frames").items():
        place = f"{file.source}: frames.{number}"
        boxes = [
            _box(entry, key, _label(objects, key), f"{place}.objects.{key}.{entry.get('name', 'bbox')}")
            for key, entry in _entries(frame)
        ]
        cameras |= {str(entry["coordinate_system"]) for _, entry in _entries(frame) if entry.get("coordinate_system")}
        stamp, name = _stamp(frame, place), _picture(frame)
        frames.append(FileFrame(tuple(boxes), stamp, whole_number(number, place), name))
    if not any(frame.boxes for frame in frames) and any(_cuboids(frame) for frame in _part(root, "frames").values()):
        raise InputError(
            f"{file.source}: has cuboids and no bbox; export the rectangles of the camera's picture (bbox) as well"
        )
    if len(cameras) > 1:
        raise InputError(
            f"{file.source}: has the boxes of {len(cameras)} cameras ({', '.join(sorted(cameras)[:5])}); export one camera's"
        )
    return FileBoxes(tuple(frames), _size(root, file.source))


def _entries(frame: Any) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield each object's key and each of its rectangles in a frame."""
    for key, found in _part(frame, "objects").items():
        data = _part(found, "object_data")
        for kind in ("bbox", "rbbox"):
            listed = data.get(kind)
            for entry in listed if isinstance(listed, list) else ():
                if isinstance(entry, dict):
                    yield key, entry


def _cuboids(frame: Any) -> bool:
    return any("cuboid" in _part(found, "object_data") for found in _part(frame, "objects").values())


def _label(objects: Mapping[str, Any], key: str) -> str:
    return str(_part(objects, key).get("type", ""))


def _box(entry: Mapping[str, Any], key: str, label: str, place: str) -> Box:
    values = entry.get("val")
    if not isinstance(values, list) or len(values) not in (4, 5):
        raise InputError(f"{place}.val: expected [centre u, centre v, width, height]; correct it")
    numbers = [finite_number(value, f"{place}.val") for value in values]
    angle_rad = numbers[4] if len(numbers) == 5 else 0.0
    return rotated_box(numbers[:2], numbers[2:4], angle_rad, f"{place}.val", label=label, score=1.0, track=key)


def _stamp(frame: Any, place: str) -> TimeNs | None:
    """Return the stamp of a frame: its own, else the one stream's."""
    properties = _part(frame, "frame_properties")
    stated = [properties.get("timestamp")]
    for stream in _part(properties, "streams").values():
        sync = _part(_part(stream, "stream_properties"), "sync")
        stated.append(sync.get("timestamp"))
    written = next((one for one in stated if isinstance(one, str | int | float) and not isinstance(one, bool)), None)
    if written is None:
        return None
    try:
        return read_time(str(written))
    except RecordingError:  # counted from the file's own beginning: the frames are matched by number
        return None


def _picture(frame: Any) -> str:
    streams = _part(_part(frame, "frame_properties"), "streams").values()
    uri = next((stream["uri"] for stream in streams if isinstance(stream, dict) and "uri" in stream), "")
    return PurePosixPath(str(uri)).stem if uri else ""


def _size(root: Mapping[str, Any], source: str) -> tuple[int, int] | None:
    sizes = set()
    for stream in _part(root, "streams").values():
        lens = _part(_part(stream, "stream_properties"), "intrinsics_pinhole")
        if "width_px" in lens and "height_px" in lens:
            width, height = (whole_number(lens[key], f"{source}: {key}") for key in ("width_px", "height_px"))
            sizes.add((width, height))
    return next(iter(sizes)) if len(sizes) == 1 else None


OPENLABEL = BoxFormat("OpenLABEL", _recognizes, _read)
