"""COCO JSON: a data set with images, annotations and categories, or a list of detections; xywh from the image's corner."""

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    edge_box,
    finite_number,
    score_of,
    whole_number,
)
from calib_core.errors import InputError
from calib_core.measurements import Box

_TRACK_KEYS = ("track_id", "instance_id", "tracking_id")


def _recognizes(file: BoxFile) -> bool:
    if isinstance(file.value, list):
        return bool(file.value) and all(isinstance(one, dict) and "image_id" in one for one in file.value[:50])
    return isinstance(file.mapping.get("images"), list) and isinstance(file.mapping.get("annotations"), list)


def _read(file: BoxFile) -> FileBoxes:
    return _detections(file.value, file.source) if isinstance(file.value, list) else _dataset(file)


def _detections(found: Sequence[Any], source: str) -> FileBoxes:
    """Read a list of detections: images by their id, which is a number or the image's name."""
    boxes: dict[Any, list[Box]] = {}
    for at, one in enumerate(found):
        place = f"{source}: [{at}]"
        boxes.setdefault(_image_of(one, place), []).append(_box(_mapping(one, place), {}, place))
    frames = [
        FileFrame(tuple(boxes[key]), number=key) if isinstance(key, int) else FileFrame(tuple(boxes[key]), name=key)
        for key in boxes
    ]
    note = "a list of detections states no names of classes; its category numbers are used as labels"
    return FileBoxes(tuple(frames), notes=(note,))


def _image_of(one: Any, place: str) -> int | str:
    key = _mapping(one, place).get("image_id")
    return _stem(key) if isinstance(key, str) else whole_number(key, f"{place}.image_id")


def _dataset(file: BoxFile) -> FileBoxes:
    source = file.source
    labels = _labels(file.mapping.get("categories"), source)
    images = {}
    for at, image in enumerate(file.mapping["images"]):
        place = f"{source}: images[{at}]"
        images[str(_mapping(image, place).get("id"))] = image
    if len({str(image.get("video_id")) for image in images.values()}) > 1:
        raise InputError(f"{source}: has the images of several videos; export one of them")
    boxes: dict[str, list[Box]] = {key: [] for key in images}
    for at, one in enumerate(file.mapping["annotations"]):
        place = f"{source}: annotations[{at}]"
        key = str(_mapping(one, place).get("image_id"))
        if key not in boxes:
            raise InputError(
                f"{place}.image_id: there is no image {key[:40]}; export the images with their annotations"
            )
        if one.get("bbox"):  # others are masks without a box
            boxes[key].append(_box(one, labels, place))
    frames = [_frame(image, tuple(boxes[key]), f"{source}: image {key}") for key, image in images.items()]
    return FileBoxes(tuple(frames), _size(list(images.values()), source))


def _labels(categories: Any, source: str) -> dict[str, str]:
    if not isinstance(categories, list):
        return {}
    found = (_mapping(category, f"{source}: categories[{at}]") for at, category in enumerate(categories))
    return {str(one.get("id")): str(one.get("name", one.get("id"))) for one in found}


def _box(one: Mapping[str, Any], labels: Mapping[str, str], place: str) -> Box:
    bbox = one.get("bbox")
    if not isinstance(bbox, list) or len(bbox) != 4:
        raise InputError(f"{place}.bbox: expected [left, top, width, height]; correct it")
    left_px, top_px, width_px, height_px = (finite_number(value, f"{place}.bbox") for value in bbox)
    edges = (left_px, top_px, left_px + width_px, top_px + height_px)
    category = str(one.get("category_id", ""))
    stated = one.get("attributes")
    places = (one, stated if isinstance(stated, dict) else {})
    track = next((str(where[key]) for where in places for key in _TRACK_KEYS if where.get(key) is not None), "")
    return edge_box(
        edges,
        f"{place}.bbox",
        label=labels.get(category, category),
        score=score_of(one.get("score", 1.0)),
        track=track,
    )


def _frame(image: Mapping[str, Any], boxes: tuple[Box, ...], place: str) -> FileFrame:
    """Identify an image by its frame_id, else by its name, else by its id."""
    name = _stem(str(image.get("file_name", "")))
    number = image.get("frame_id")
    if number is None and not any(letter.isdecimal() for letter in name):
        number = image.get("id")
    return FileFrame(boxes, number=None if number is None else whole_number(number, place), name=name)


def _size(images: Sequence[Mapping[str, Any]], source: str) -> tuple[int, int] | None:
    sizes = {(image.get("width"), image.get("height")) for image in images}
    if len(sizes) != 1 or None in next(iter(sizes)):
        return None
    width, height = next(iter(sizes))
    return whole_number(width, f"{source}: width"), whole_number(height, f"{source}: height")


def _mapping(value: Any, place: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{place}: expected an object in braces; correct it")
    return value


def _stem(name: str) -> str:
    return PurePosixPath(name.replace("\\", "/")).stem if "." in name else name


COCO = BoxFormat("COCO JSON (data set or detections)", _recognizes, _read)
