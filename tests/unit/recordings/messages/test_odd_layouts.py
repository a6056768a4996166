"""Messages with standard field names of other types: a problem of their topic only."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from calib_core.recordings import inspect_recording

START_NS = 1_700_000_000 * NS_PER_S

ODD = {
    "Image": ("string height\nstring width\nuint32 encoding\nstring step\nfloat32[] data\n", "image"),
    "Compressed": ("uint32 format\nuint8[] data\n", "image"),
    "Wide": ("string format\nfloat64[] data\n", "image"),
    "Cloud": (
        "string height\nuint32 width\nstring fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nstring data\n",
        "other",
    ),
    "Channels": ("float32[] points\nstring channels\n", "other"),
    "Info": ("string height\nuint32 width\nstring distortion_model\nfloat64[] D\nstring K\n", "camera-info"),
}


@pytest.mark.parametrize("name", ODD)
def test_fields_of_the_wrong_type_are_explained(name, ros, write, plain, jpeg):
    text, kind = ODD[name]
    odd = ros.define(f"odd_msgs/msg/{name}", f"Header header\n{text}")
    values = {}
    for line in text.splitlines():
        field_type, field = line.split()
        if field_type.endswith("[]"):
            values[field] = np.ones(3, dtype=field_type[:-2])
        else:
            values[field] = "text" if field_type == "string" else field_type == "bool" or 7
    message = ros.new(odd, header=ros.header(START_NS), **values)
    path = write(ros, [*plain(ros, jpeg), ("/camera/other/camera_info", START_NS, message)])
    with inspect_recording(path) as recording:
        (topic,) = [topic for topic in recording.topics if topic.name.startswith("/camera/other")]
        assert topic.kind == kind
        assert kind == "camera-info" or topic.problem is not None
        assert len(recording.radar_scans()) == len(recording.image_times) == 20


def test_camera_info_of_an_odd_layout_gives_no_camera_and_says_why(ros, write, plain, jpeg):
    odd = ros.define("odd_msgs/msg/Info", f"Header header\n{ODD['Info'][0]}")
    info = ros.new(odd, header=ros.header(START_NS), height="x", width=1, distortion_model="", D=np.zeros(5), K="no")
    rows = [row for row in plain(ros, jpeg) if "info" not in row[0]]
    with inspect_recording(write(ros, [*rows, ("/camera/camera_info", START_NS, info)])) as recording:
        assert recording.camera() is None
        assert [warning.code for warning in recording.warnings] == ["camera-unreadable"]
        assert "is not 9 numbers" in recording.warnings[0].message or "is not an array" in recording.warnings[0].message
