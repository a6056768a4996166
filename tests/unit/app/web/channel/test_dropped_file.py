"""A file dropped on the page is what its reader says, whatever its name."""

import json
from pathlib import Path

import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.files import camera_content
from calib_core.interchange.exporting import export
from cocalib.web.channel.dropped_file import sorted_file
from cocalib.web.messages.incoming import FileDropped, parse
from cocalib.web.messages.outgoing import Dropped

KALIBR = "".join(
    f"cam{n}:\n  camera_model: pinhole\n  intrinsics: [500, 500, 320, 240]\n  resolution: [640, 480]\n"
    "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n"
    for n in (0, 1)
)


def kind(content: bytes, name: str = "dropped.txt", *, has_camera: bool = True) -> str:
    return sorted_file(FileDropped(name, content), has_camera=has_camera).kind


def test_a_file_is_sorted_by_its_content(file, project_root: Path):
    camera: Camera = file.calibration.camera
    assert kind((project_root / "sample_data/rooftop/clicks.json").read_bytes()) == "clicks"
    assert kind(str(camera_content(camera, "ros")).encode()) == "camera"
    assert kind(KALIBR.encode()) == "camera", "with several, too"
    for form in ("json", "tf2", "kitti"):
        written = export(file, form).content
        assert kind(written if isinstance(written, bytes) else written.encode()) == "calibration"
    coco = {
        "images": [{"id": 1, "file_name": "000001.jpg", "width": 640, "height": 480}],
        "annotations": [],
        "categories": [],
    }
    assert kind(json.dumps(coco).encode()) == "boxes"


def test_a_file_that_is_a_calibration_and_a_cameras_gives_the_recording_what_it_lacks(file):
    content = export(file, "json").content
    assert isinstance(content, str)
    assert kind(content.encode()) == "calibration"
    assert kind(content.encode(), has_camera=False) == "camera"


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"#ROSBAG V2.0\n", "cocalib open drive.bag"),
        (b"\x89MCAP0\r\n", "cocalib open drive.bag"),
        (b"SQLite format 3\0", "cocalib open drive.bag"),
        (b"\x89PNG\r\n", "no camera, clicks, calibration, boxes"),
        (b"", "no camera, clicks, calibration, boxes"),
        (b"hello: world\n", "no camera, clicks, calibration, boxes"),
    ],
)
def test_a_recording_is_opened_elsewhere_and_what_is_nothing_is_said_so(head, words):
    with pytest.raises(InputError, match=words):
        kind(head, "drive.bag")


def test_of_a_large_file_only_the_beginning_is_looked_at():
    with pytest.raises(InputError, match="too large for the page"):
        sorted_file(FileDropped("large.json", b"{", is_whole=False), has_camera=True)


def test_the_message_is_read_and_its_answer_names_the_kind():
    text = '{"type": "file_dropped", "name": "a.yaml", "content_base64": "Zng6IDU=", "is_whole": true}'
    assert parse(text).command == FileDropped("a.yaml", b"fx: 5")
    assert Dropped("camera").kind == "camera"
