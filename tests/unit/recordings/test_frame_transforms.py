"""The transforms between frames of a recording, in each of its containers."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from calib_core.errors import RecordingError
from calib_core.recordings import frame_transforms, holds_recording

KIND = "tf2_msgs/msg/TFMessage"
Rows = Sequence[tuple[str, int, Sequence[tuple[str, str, tuple[float, float, float]]]]]


def message(store: Any, transforms: Sequence[tuple[str, str, tuple[float, float, float]]], generation: int) -> Any:
    """Return a TFMessage of shifts without rotation."""
    types = store.types
    time = types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    header = types["std_msgs/msg/Header"]
    stamped = [
        types["geometry_msgs/msg/TransformStamped"](
            header=header(stamp=time, frame_id=parent, **({"seq": 0} if generation == 1 else {})),
            child_frame_id=child,
            transform=types["geometry_msgs/msg/Transform"](
                translation=types["geometry_msgs/msg/Vector3"](*shift),
                rotation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            ),
        )
        for parent, child, shift in transforms
    ]
    return types[KIND](transforms=stamped)


def write(path: Path, container: str, rows: Rows) -> Path:
    generation = 1 if container == "bag" else 2
    store = get_typestore(Stores.ROS1_NOETIC if generation == 1 else Stores.ROS2_JAZZY)
    if generation == 1:
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", KIND))
    writer: Any = (
        Writer1(path)
        if generation == 1
        else Writer2(
            path, version=9, storage_plugin=StoragePlugin.MCAP if container == "mcap" else StoragePlugin.SQLITE3
        )
    )
    serialize = store.serialize_ros1 if generation == 1 else store.serialize_cdr
    with writer:
        connections: dict[str, Any] = {}
        for topic, time, transforms in rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, KIND, typestore=store)
            writer.write(connections[topic], time, bytes(serialize(message(store, transforms, generation), KIND)))
    return path


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


@pytest.mark.parametrize("container", ["bag", "mcap", "sqlite"])
def test_static_and_still_transforms_are_read_and_moving_ones_said_so(tmp_path, container):
    path = write(tmp_path / ("tf.bag" if container == "bag" else "tf"), container, ROWS)

    found = {one.child: one for one in frame_transforms([path])}
    assert list(found) == ["radar", "camera_optical", "camera_link", "base_link", "lever"]
    assert {name: one.moves for name, one in found.items() if one.moves} == {"base_link": True}
    np.testing.assert_array_equal(found["camera_link"].translation_m, [0.6, 0.0, 1.0])
    assert (found["lever"].topic, found["radar"].topic, found["radar"].parent) == ("/tf", "/tf_static", "/base_link")
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
