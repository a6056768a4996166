"""Fuzz what reads boxes: files of labelling tools, and messages of detectors."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from calib_core.boxes import boxes_text, labels_text, read_boxes, read_labels
from calib_core.measurements import Box, Boxes, FrameBoxes, LabelledScan, ReturnLabels, TimeNs
from calib_core.recordings.box_topics import box_layout, frames_in_message
from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import parse_definition

_START_NS = TimeNs(1_700_000_000_000_000_000)
_TIMES = _START_NS + 100_000_000 * np.arange(10)
_BOXES = Boxes((FrameBoxes(_START_NS, (Box(1.0, 2.0, 30.0, 40.0, "person", 0.5, "p1"),)),), "boxes", (640, 480))
_COCO = {
    "images": [{"id": 1, "file_name": "a/000003.png", "width": 640, "height": 480}],
    "annotations": [
        {"id": 1, "image_id": 1, "category_id": 2, "bbox": [10, 20, 30, 40], "attributes": {"track_id": 4}}
    ],
    "categories": [{"id": 2, "name": "person"}],
}
_LENS = {"width_px": 640, "height_px": 480, "camera_matrix_3x4": [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]}
_POSE = [0, 0, 1, 1, -1, 0, 0, 0, 0, -1, 0, 2, 0, 0, 0, 1]
_CUBOID = {"val": [11, 1, 1, 0, 0, 0, 1, 4, 2, 1.5], "coordinate_system": "v"}
_OPENLABEL = {
    "openlabel": {
        "objects": {"o1": {"type": "person"}},
        "streams": {"c": {"stream_properties": {"intrinsics_pinhole": _LENS}}},
        "coordinate_systems": {"v": {"parent": ""}, "c": {"parent": "v", "pose_wrt_parent": {"matrix4x4": _POSE}}},
        "frames": {
            "0": {
                "objects": {"o1": {"object_data": {"bbox": [{"val": [100, 100, 20, 40]}], "rbbox": []}}},
                "frame_properties": {"timestamp": "2023-11-14T22:13:20.3Z", "streams": {"c": {"uri": "0.png"}}},
            },
            "1": {"objects": {"o1": {"object_data": {"cuboid": [_CUBOID]}}}, "frame_properties": {"timestamp": "1"}},
        },
    }
}
_CVAT = (
    b"<annotations><meta><task><size>10</size><start_frame>0</start_frame><stop_frame>9</stop_frame>"
    b"<frame_filter>step=1</frame_filter><original_size><width>640</width><height>480</height></original_size></task>"
    b'</meta><track id="1" label="car"><box frame="2" outside="0" xtl="1" ytl="2" xbr="30" ybr="40"/>'
    b'<box frame="7" outside="1" xtl="1" ytl="2" xbr="30" ybr="40" rotation="10"/></track></annotations>'
)
_CVAT_IMAGES = (
    b'<annotations><image id="0" name="frame_000000.png" width="640" height="480">'
    b'<box label="a" xtl="1" ytl="2" xbr="30" ybr="40"/></image></annotations>'
)
_KITTI = (
    b"1 4 Car 0 0 -0.2 100 50 140 150 1 1 1 1 1 1 0\n3 4 DontCare -1 -1 -10 1 5 14 15 -1 -1 -1 -1 -1 -1 -1\n",
    b"Car 0.00 0 1.85 100.0 50.0 140.0 150.0 1 1 1 1 1 1 0 0.5\n",
)
_YOLO = b"0 0.5 0.5 0.1 0.2 0.9 3\n1 0.1 0.1 0.2 0.1 0.2 0.2 0.1 0.2\n"
FILE_SEEDS = (
    boxes_text(_BOXES).encode(),
    labels_text(ReturnLabels((LabelledScan(_START_NS, ("", "p1")),), "labels")).encode(),
    json.dumps(_COCO).encode(),
    b'[{"image_id": 3, "category_id": 1, "bbox": [1, 2, 3, 4], "score": 0.5}]',
    json.dumps(_OPENLABEL).encode(),
    *(_CVAT, _CVAT_IMAGES, *_KITTI, _YOLO),
    b"PK\x05\x06" + bytes(18),
)
FILE_TOKENS = (b'"bbox"', b'"frames"', b"<box ", b"step=", b"1e999", b"-1", b"null", b"NaN", b"0.5 ")
_DEFINITION = (
    b"std_msgs/Header header\nDetection[] detections\n"
    + b"=" * 80
    + b"\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\n"
    b"string frame_id\n" + b"=" * 80 + b"\nMSG: some_msgs/Detection\nuint8 label\nfloat64 score\nfloat32 xmin\n"
    b"float32 ymin\nfloat32 xmax\nfloat32 ymax\nstring id\n"
)
MESSAGE_SEEDS = (_DEFINITION + b"\0" + bytes(12) + b"\0\0\0\0\1\0\0\0" + bytes(40), _DEFINITION + b"\0" + bytes(64))


def box_file_reader(swallow: Callable[[Callable[[], object]], None]) -> Callable[[bytes, Path], None]:
    """Return what reads the input as a file of boxes and as one of labels."""

    def run(data: bytes, folder: Path) -> None:
        path = folder / "000001.txt"
        path.write_bytes(data)
        swallow(lambda: read_boxes(path, image_times=_TIMES, image_size_px=(640, 480)))
        swallow(lambda: read_labels(data.decode("utf-8", "replace")))

    return run


def box_message_reader(swallow: Callable[[Callable[[], object]], None]) -> Callable[[bytes, Path], None]:
    """Return what reads a message definition, a zero byte, and a message of boxes."""

    def run(data: bytes, _folder: Path) -> None:
        text, _, payload = data.partition(b"\0")
        swallow(lambda: _read(text.decode("utf-8", "replace"), payload))

    return run


def _read(text: str, payload: bytes) -> None:
    for encoding in ("ros1", "cdr"):
        definition = parse_definition("some_msgs/Detections", text, encoding)
        layout = box_layout(definition)
        if layout is not None:
            frames_in_message(layout, decode(definition, payload))
