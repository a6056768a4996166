"""The transforms between frames of a recording, in each of its containers."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.recordings import frame_transforms, holds_recording
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.frame_transforms import recorded_mount
from calib_core.recordings.topics import join_topics
from tests.unit.recordings.conftest import Ros, write_rows

KIND = "tf2_msgs/msg/TFMessage"
Rows = Sequence[tuple[str, int, Sequence[tuple[str, str, tuple[float, float, float]]]]]


def message(ros: Ros, transforms: Sequence[tuple[str, str, tuple[float, float, float]]]) -> Any:
    """Return a TFMessage of shifts without rotation."""
    types = ros.store.types
    stamped = [
        types["geometry_msgs/msg/TransformStamped"](
            header=ros.header(10**9, parent),
            child_frame_id=child,
            transform=types["geometry_msgs/msg/Transform"](
                translation=types["geometry_msgs/msg/Vector3"](*shift),
                rotation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            ),
        )
        for parent, child, shift in transforms
    ]
    return ros.new(KIND, transforms=stamped)


def write(path: Path, container: str, rows: Rows) -> Path:
    ros = Ros(1 if container == "bag" else 2)
    if ros.generation == 1:
        ros.define(KIND, "geometry_msgs/TransformStamped[] transforms\n")
    messages = [(topic, time, message(ros, transforms)) for topic, time, transforms in rows]
    return write_rows(path, ros, messages, container)


ROWS: Rows = (
    ("/tf", 10, [("map", "base_link", (0.0, 0.0, 0.0)), ("base_link", "lever", (1.0, 0.0, 0.0))]),
    ("/tf_static", 11, [("/base_link", "radar", (3.0, 0.0, 0.5))]),
    (
        "/tf_static",
        12,
        [("camera_link", "camera_optical", (0.0, 0.01, 0.0)), ("base_link", "camera_link", (0.5, 0.0, 1.0))],
    ),
    ("/tf", 13, [("map", "base_link", (1.0, 0.0, 0.0)), ("base_link", "lever", (1.0, 0.0, 0.0))]),
    ("/tf_static", 14, [("base_link", "camera_link", (0.6, 0.0, 1.0))]),
)


@pytest.mark.parametrize("container", ["bag", "mcap", "db3"])
def test_static_and_still_transforms_are_read_and_moving_ones_said_so(tmp_path, container):
    path = write(tmp_path / ("tf.bag" if container == "bag" else "tf"), container, ROWS)

    found = {one.child: one for one in frame_transforms([path])}
    assert list(found) == ["radar", "camera_optical", "camera_link", "base_link", "lever"]
    assert {name: one.moves for name, one in found.items() if one.moves} == {"base_link": True}
    np.testing.assert_array_equal(found["camera_link"].translation_m, [0.6, 0.0, 1.0])
    assert (found["lever"].topic, found["radar"].topic, found["radar"].parent) == ("/tf", "/tf_static", "base_link")
    assert holds_recording(path)


def test_a_folder_of_other_files_holds_no_recording(tmp_path):
    (tmp_path / "robot.urdf").write_text("<robot/>")

    assert not holds_recording(tmp_path)
    assert not holds_recording(tmp_path / "robot.urdf")


def test_a_recording_without_transforms_gives_none_and_a_damaged_one_is_refused(tmp_path):
    assert frame_transforms([write(tmp_path / "empty.bag", "bag", ())]) == ()
    (tmp_path / "x.bag").write_bytes(b"nonsense")
    with pytest.raises(RecordingError, match="not a recording"):
        frame_transforms([tmp_path / "x.bag"])


MOUNTED: Rows = (
    ("/tf", 10, [("map", "base_link", (0.0, 0.0, 0.0)), ("base_link", "rear_radar", (-1.0, 0.0, 0.0))]),
    (
        "/tf_static",
        11,
        [
            ("base_link", "bumper", (3.0, 0.0, 0.5)),
            ("bumper", "radar_left_mount", (0.0, 0.9, 0.0)),
            ("radar_left_mount", "radar_left", (0.5, 0.0, 0.0)),
            ("bumper", "radar_right", (0.5, -0.9, 0.0)),
        ],
    ),
    ("/tf", 13, [("map", "base_link", (1.0, 0.0, 0.0)), ("base_link", "rear_radar", (-1.0, 0.0, 0.0))]),
)


@pytest.mark.parametrize("container", ["bag", "mcap"])
@pytest.mark.parametrize(
    ("frame", "topic", "body", "expected"),
    [
        ("base_link", "/radar/left/points", True, ("radar_left", (3.5, 0.9, 0.5))),
        ("base_link", "/radar_right", True, ("radar_right", (3.5, -0.9, 0.5))),
        ("base_link", "/points", True, None),
        ("base_link", "/rear/points", True, ("rear_radar", (-1.0, 0.0, 0.0))),
        ("radar_left", "/points", False, ("radar_left", (3.5, 0.9, 0.5))),
        ("rear_radar", "/points", False, None),
        ("rear_radar", "/points", True, ("rear_radar", (-1.0, 0.0, 0.0))),
        ("odom", "/points", True, None),
    ],
)
def test_the_mount_of_a_radar_is_found_by_its_frame_or_its_topic(tmp_path, container, frame, topic, body, expected):
    path = write(tmp_path / ("tf.bag" if container == "bag" else "tf"), container, MOUNTED)
    sources = open_sources([path])
    found = recorded_mount(join_topics(sources)[0], frame, radar=topic, body=body)
    for source in sources:
        source.close()
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        assert found[1] == expected[0]
        np.testing.assert_allclose(found[0].translation_m, expected[1])
