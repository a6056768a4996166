"""Write recordings: ROS 1 bags, and ROS 2 bags as MCAP or SQLite. For simulated recordings and for tests."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Literal

from calib_core.errors import RecordingError
from calib_core.recordings.containers.message_building import MESSAGE_TYPES, MessageBuilder
from calib_core.recordings.containers.recorded_messages import RecordedMessage

Ros1Compression = Literal["none", "bz2", "lz4"]
Ros2Container = Literal["mcap", "sqlite3"]


def write_ros1_bag(path: Path, messages: Iterable[RecordedMessage], *, compression: Ros1Compression = "none") -> Path:
    """Write a ROS 1 bag and return its path.

    Args:
        path: of a file that does not exist yet.
        messages: in the order to write them; recorders write by receive time.
        compression: "lz4" is written in a form that ROS itself cannot read; "none" and "bz2" are readable everywhere.

    Raises:
        RecordingError: the file exists.
    """
    from rosbags.rosbag1 import Writer

    _refuse_existing(path)
    build = MessageBuilder(1)
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    with writer:
        _write_all(
            messages,
            lambda topic, kind: writer.add_connection(topic, kind, typestore=build.typestore),
            lambda connection, message: writer.write(connection, int(message.receive_time), build.ros1(message.body)),
        )
    return path


def write_ros2(path: Path, messages: Iterable[RecordedMessage], *, container: Ros2Container = "mcap") -> Path:
    """Write a ROS 2 bag, a folder with metadata.yaml, and return its data file, which can also be read on its own.

    Args:
        path: of a folder that does not exist yet.
        messages: in the order to write them.
        container: "mcap" or "sqlite3".

    Raises:
        RecordingError: the folder exists.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer

    _refuse_existing(path)
    build = MessageBuilder(2)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[container.upper()])
    with writer:
        _write_all(
            messages,
            lambda topic, kind: writer.add_connection(topic, kind, typestore=build.typestore),
            lambda connection, message: writer.write(connection, int(message.receive_time), build.cdr(message.body)),
        )
    return path / f"{path.name}.{'mcap' if container == 'mcap' else 'db3'}"


def _refuse_existing(path: Path) -> None:
    if path.exists():
        raise RecordingError(
            f"{path} already exists; recordings are never overwritten: choose another name or delete it"
        )


def _write_all(
    messages: Iterable[RecordedMessage],
    connect: Callable[[str, str], Any],
    write: Callable[[Any, RecordedMessage], None],
) -> None:
    """Write messages one by one, adding a connection at the first message of each topic."""
    connections: dict[str, Any] = {}
    for message in messages:
        if message.topic not in connections:
            connections[message.topic] = connect(message.topic, MESSAGE_TYPES[type(message.body)])
        write(connections[message.topic], message)
