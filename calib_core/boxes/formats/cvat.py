"""CVAT XML 1.1: for images, boxes by image; for video, tracks whose boxes are given at keyframes and interpolated."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from xml.etree.ElementTree import Element

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    edge_box,
    finite_number,
    rotated_box,
    whole_number,
)
from calib_core.errors import InputError
from calib_core.measurements import Box

_EDGES = ("xtl", "ytl", "xbr", "ybr")
_OTHER_SHAPES = ("polygon", "polyline", "points", "cuboid", "mask", "ellipse", "skeleton")
_MOST_FRAMES = 10_000_000


def _recognizes(file: BoxFile) -> bool:
    return (
        file.root is not None
        and file.root.tag == "annotations"
        and (
            file.root.find("image") is not None
            or file.root.find("track") is not None
            or file.root.find("meta") is not None
        )
    )


def _read(file: BoxFile) -> FileBoxes:
    assert file.root is not None
    tasks = file.root.findall("meta/project/tasks/task")
    if len(tasks) > 1:
        raise InputError(
            f"{file.source}: is the export of a project with {len(tasks)} tasks; export the task of this recording"
        )
    boxes = _images(file.root, file.source) if file.root.find("image") is not None else _video(file.root, file.source)
    others = sum(1 for kind in _OTHER_SHAPES for _ in file.root.iter(kind))
    note = f"{others} shapes that are not boxes are left out"
    return replace(boxes, notes=(*boxes.notes, note)) if others else boxes


def _box(element: Element, place: str, label: str, track: str = "") -> Box:
    """Read a box; one that was turned becomes the upright box around it."""
    edges = [finite_number(element.get(edge), f"{place}: {edge}") for edge in _EDGES]
    angle_deg = finite_number(element.get("rotation", "0"), f"{place}: rotation")
    if not angle_deg:
        return edge_box(edges, place, label=label, track=track)
    centre = (edges[0] + edges[2]) / 2, (edges[1] + edges[3]) / 2
    size = edges[2] - edges[0], edges[3] - edges[1]
    return rotated_box(centre, size, math.radians(angle_deg), place, label=label, score=1.0, track=track)


def _images(root: Element, source: str) -> FileBoxes:
    frames, sizes = [], set()
    for image in root.findall("image"):
        name = PurePosixPath(image.get("name", "").replace("\\", "/")).stem
        place = f"{source}: image {name or image.get('id')}"
        boxes = tuple(_box(box, place, box.get("label", "")) for box in image.findall("box"))
        numbered = any(letter.isdecimal() for letter in name)
        frames.append(
            FileFrame(boxes, number=None if numbered else whole_number(image.get("id"), f"{place}: id"), name=name)
        )
        sizes.add((image.get("width"), image.get("height")))
    width, height = next(iter(sizes)) if len(sizes) == 1 else (None, None)
    known = width is not None and height is not None
    size = (whole_number(width, f"{source}: width"), whole_number(height, f"{source}: height")) if known else None
    return FileBoxes(tuple(frames), size)


@dataclass(frozen=True, slots=True)
class _Task:
    """Which frames of a video were annotated, and their size."""

    frames: range | None
    count: int | None
    image_size_px: tuple[int, int] | None


def _task(root: Element, source: str) -> _Task:
    meta = next((part for kind in ("task", "job") if (part := root.find(f"meta/{kind}")) is not None), None)
    if meta is None:
        return _Task(None, None, None)

    def stated(path: str) -> int | None:
        text = (meta.findtext(path) or "").strip()
        return whole_number(text, f"{source}: meta/{path}") if text else None

    size, first, last = stated("size"), stated("start_frame") or 0, stated("stop_frame")
    step_text = (meta.findtext("frame_filter") or "").partition("step=")[2]
    step = max(1, whole_number(step_text, f"{source}: meta/frame_filter")) if step_text else 1
    width, height = stated("original_size/width"), stated("original_size/height")
    if last is None and size is not None:
        last = first + (size - 1) * step
    if last is not None and not 0 <= last - first < _MOST_FRAMES:
        raise InputError(
            f"{source}: has frames {first} to {last}, which is no task; correct its start_frame and stop_frame"
        )
    whole = size if first == 0 and step == 1 else None
    frames = None if last is None else range(first, last + 1, step)
    return _Task(frames, whole, None if width is None or height is None else (width, height))


def _video(root: Element, source: str) -> FileBoxes:
    """Read tracks; a frame of the task in which no track has a box was annotated as empty."""
    task = _task(root, source)
    tracks = [(track, _keyframes(track, source)) for track in root.findall("track")]
    listed = [number for _, keys in tracks for number in keys]
    frames = task.frames or (range(min(listed), max(listed) + 1) if listed else range(0))
    if len(frames) > _MOST_FRAMES:
        raise InputError(f"{source}: has frames {frames[0]} to {frames[-1]}; no video is that long, correct it")
    boxes: dict[int, list[Box]] = {}
    for _, keys in tracks:
        for number, box in _interpolated(keys, frames):
            boxes.setdefault(number, []).append(box)
    made = tuple(FileFrame(tuple(boxes.get(number, ())), number=number) for number in frames)
    return FileBoxes(made, task.image_size_px, first_number=0, frame_count=task.count)


def _keyframes(track: Element, source: str) -> dict[int, Box | None]:
    """Return a track's boxes by frame, None where the object leaves the image."""
    name, label = track.get("id", ""), track.get("label", "")
    keys: dict[int, Box | None] = {}
    for element in track.findall("box"):
        place = f"{source}: track {name}"
        number = whole_number(element.get("frame"), f"{place}: frame")
        keys[number] = None if element.get("outside") == "1" else _box(element, f"{place}, frame {number}", label, name)
    return dict(sorted(keys.items()))


def _interpolated(keys: dict[int, Box | None], frames: range) -> Iterator[tuple[int, Box]]:
    """Yield a track's box in each of the frames: linear between two keyframes, the last one until the end."""
    numbers = list(keys)
    for number, following in zip(numbers, [*numbers[1:], frames.stop], strict=True):
        box, after = keys[number], keys.get(following)
        if box is None:
            continue
        for at in _frames_between(frames, number, following):
            share = (at - number) / (following - number)
            yield at, box if after is None else _interpolated_box(box, after, share)


def _frames_between(frames: range, first: int, stop: int) -> Sequence[int]:
    skipped = max(0, -((frames.start - first) // frames.step))
    return range(frames.start + skipped * frames.step, min(stop, frames.stop), frames.step)


def _interpolated_box(box: Box, after: Box, share: float) -> Box:
    left_px, top_px, right_px, bottom_px = (
        (1 - share) * one + share * other
        for one, other in (
            (box.left_px, after.left_px),
            (box.top_px, after.top_px),
            (box.right_px, after.right_px),
            (box.bottom_px, after.bottom_px),
        )
    )
    return replace(box, left_px=left_px, top_px=top_px, right_px=right_px, bottom_px=bottom_px)


CVAT = BoxFormat("CVAT XML 1.1", _recognizes, _read)
