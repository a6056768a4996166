"""Write recordings with rosbags, message by message, as the counterpart of the reader under test."""

import sqlite3
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from calib_core.measurements import NS_PER_S

START_NS = 1_700_000_000 * NS_PER_S
CONTAINERS = ("bag", "bag-lz4", "bag-bz2", "mcap", "mcap-zstd", "db3", "db3-zstd")

POINT_CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def standard_types(generation: int) -> Any:
    """Return a new store of a generation's standard types."""
    return get_typestore(Stores.ROS1_NOETIC if generation == 1 else Stores.ROS2_JAZZY)


shared_types = cache(
    standard_types
)  # rosbags compiles a serialiser per type and store: all tests use those of one store


class Ros:
    """Messages of one ROS generation, and files of them."""

    def __init__(self, generation: int) -> None:
        self.generation = generation
        self.store = shared_types(generation)

    def define(self, name: str, text: str) -> str:
        """Register a type from its definition, in a store of our own; return its name."""
        if self.store is shared_types(self.generation):
            self.store = standard_types(self.generation)
        if self.generation == 2:
            text = text.replace("\nHeader ", "\nstd_msgs/Header ").removeprefix("\n")
            text = "std_msgs/" + text if text.startswith("Header ") else text
        self.store.register(get_types_from_msg(text, name))
        return name

    def new(self, kind: str, **fields: Any) -> Any:
        """Build a message; arrays as NumPy arrays of the right type."""
        if self.generation == 2 and kind == "sensor_msgs/msg/CameraInfo":
            fields = {name.lower() if len(name) == 1 else name: value for name, value in fields.items()}
        return self.store.types[kind](**fields)

    def header(self, stamp_ns: int, frame_id: str = "sensor") -> Any:
        """Build a header."""
        sec, nanosec = divmod(stamp_ns, NS_PER_S)
        stamp = self.store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        rest = {"seq": 0} if self.generation == 1 else {}
        return self.store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame_id, **rest)

    def serialise(self, message: Any) -> bytes:
        """Return the bytes of a message."""
        kind = message.__msgtype__
        write = self.store.serialize_ros1 if self.generation == 1 else self.store.serialize_cdr
        return bytes(write(message, kind))

    def cloud(
        self, stamp_ns: int, points: np.ndarray, *, padding: int = 0, height: int = 1, frame: str = "radar"
    ) -> Any:
        """Build a PointCloud2 from a structured array, keeping padding and byte order."""
        dtype = points.dtype
        point_field = self.store.types["sensor_msgs/msg/PointField"]
        fields = [
            point_field(name=name, offset=place[1], datatype=POINT_CODES[place[0].str[1:]], count=1)
            for name, place in dtype.fields.items()
        ]
        width = len(points) // height
        raw = np.frombuffer(points.tobytes(), dtype=np.uint8).reshape(height, width * dtype.itemsize)
        if padding:
            raw = np.pad(raw, ((0, 0), (0, padding)), constant_values=255)
        big = any(place[0].str.startswith(">") for place in dtype.fields.values())
        return self.new(
            "sensor_msgs/msg/PointCloud2",
            header=self.header(stamp_ns, frame),
            height=height,
            width=width,
            fields=fields,
            is_bigendian=big,
            point_step=dtype.itemsize,
            row_step=raw.shape[1],
            data=raw.reshape(-1),
            is_dense=True,
        )

    def compressed(self, stamp_ns: int, data: bytes, form: str = "jpeg", frame: str = "camera") -> Any:
        """Build a CompressedImage."""
        return self.new(
            "sensor_msgs/msg/CompressedImage",
            header=self.header(stamp_ns, frame),
            format=form,
            data=np.frombuffer(data, dtype=np.uint8),
        )

    def image(self, stamp_ns: int, pixels: np.ndarray, encoding: str, **changes: Any) -> Any:
        """Build an Image; pixels are uint8 (h, bytes per row)."""
        fields: dict[str, Any] = {
            "height": pixels.shape[0],
            "width": pixels.shape[1],
            "encoding": encoding,
            "is_bigendian": 0,
            "step": pixels.shape[1],
            "data": np.ascontiguousarray(pixels).reshape(-1),
        }
        fields.update(changes)
        return self.new("sensor_msgs/msg/Image", header=self.header(stamp_ns, "camera"), **fields)

    def camera_info(self, stamp_ns: int = START_NS, **changes: Any) -> Any:
        """Build a CameraInfo of a 640 x 480 camera; fields named as in ROS 1."""
        region = changes.pop("region", (0, 0, 0, 0))
        k = np.array([500.0, 0, 319.5, 0, 510.0, 239.5, 0, 0, 1])
        fields: dict[str, Any] = {
            "height": 480,
            "width": 640,
            "distortion_model": "plumb_bob",
            "D": np.array([-0.1, 0.02, 0.001, -0.002, 0.003]),
            "K": k,
            "R": np.eye(3).reshape(-1),
            "P": np.hstack([k.reshape(3, 3) * np.array([[0.9], [0.9], [1.0]]), np.zeros((3, 1))]).reshape(-1),
            "binning_x": 0,
            "binning_y": 0,
            "roi": self.new(
                "sensor_msgs/msg/RegionOfInterest",
                x_offset=region[0],
                y_offset=region[1],
                width=region[2],
                height=region[3],
                do_rectify=False,
            ),
        }
        fields.update(changes)
        return self.new("sensor_msgs/msg/CameraInfo", header=self.header(stamp_ns, "camera"), **fields)


Row = tuple[str, int, Any]
"""Topic, receive time [ns], message."""


def write_rows(path: Path, ros: Ros, rows: Iterable[Row], container: str) -> Path:
    """Write rows in the given order; return the file."""
    kind, _, compression = container.partition("-")
    if kind == "bag":
        writer1 = Writer1(path)
        if compression:
            writer1.set_compression(Writer1.CompressionFormat[compression.upper()])
        with writer1:
            _add(writer1, ros, rows)
        return path
    storage = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    writer2 = Writer2(path, version=9, storage_plugin=storage)
    if compression:
        mode = CompressionMode.STORAGE if kind == "mcap" else CompressionMode.MESSAGE
        writer2.set_compression(mode, CompressionFormat[compression.upper()])
    with writer2:
        _add(writer2, ros, rows)
    return next(path.glob(f"*.{kind}"))


def _add(writer: Any, ros: Ros, rows: Iterable[Row]) -> None:
    connections: dict[str, Any] = {}
    for topic, receive_ns, message in rows:
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=ros.store)
        writer.write(connections[topic], receive_ns, ros.serialise(message))


Write = Callable[..., Path]


@pytest.fixture(params=[1, 2], ids=["ros1", "ros2"])
def ros(request: pytest.FixtureRequest) -> Ros:
    """Return each ROS generation in turn."""
    return Ros(request.param)


@pytest.fixture
def ros1() -> Ros:
    """Return ROS 1."""
    return Ros(1)


@pytest.fixture
def ros2() -> Ros:
    """Return ROS 2."""
    return Ros(2)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes rows into a file below the test's folder."""

    def write_file(ros: Ros, rows: Sequence[Row], container: str = "", name: str = "recording") -> Path:
        container = container or ("bag" if ros.generation == 1 else "mcap")
        suffix = ".bag" if container.startswith("bag") else ""
        return write_rows(tmp_path / f"{name}{suffix}", ros, rows, container)

    return write_file


@pytest.fixture(params=CONTAINERS)
def container(request: pytest.FixtureRequest) -> str:
    """Return each container in turn."""
    return str(request.param)


@pytest.fixture
def container_ros(container: str) -> Ros:
    """Return the generation that writes the container."""
    return Ros(1 if container.startswith("bag") else 2)


@pytest.fixture(scope="session")
def jpeg() -> bytes:
    """Return a small JPEG with some texture."""
    import cv2

    pixels = np.random.default_rng(3).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    return bytes(cv2.imencode(".jpg", cv2.GaussianBlur(pixels, (5, 5), 0))[1].tobytes())


POINTS = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("velocity", "<f4"), ("snr", "<f4")])


def some_points(n: int = 3, shift: float = 0.0) -> np.ndarray:
    """Return n points of the simplest radar cloud."""
    points = np.zeros(n, dtype=POINTS)
    points["x"] = 3.0 + np.arange(n) + shift
    points["y"] = 0.5 - np.arange(n)
    points["z"] = 0.25 * np.arange(n)
    points["velocity"] = 0.1 * np.arange(n)
    points["snr"] = 10.0 + np.arange(n)
    return points


def altered(database: Path, statement: str) -> Path:
    """Change a database by an SQL statement."""
    with sqlite3.connect(database) as connection:
        connection.execute(statement)
    connection.close()
    return database


def plain_rows(
    ros: Ros, jpeg: bytes, *, n: int = 20, radar_shift_ns: int = 0, camera_shift_ns: int = 0, delay_ns: int = 30_000_000
) -> list[Row]:
    """Return n radar clouds at 10 Hz and n frames half a cycle later, with camera info; shifts move the header stamps."""
    rows: list[Row] = []
    for i in range(n):
        at = START_NS + i * 100_000_000
        rows.append(("/radar/points", at + delay_ns, ros.cloud(at + radar_shift_ns, some_points(3 + i % 3, i))))
        at += 50_000_000
        rows.append(("/camera/image/compressed", at + delay_ns, ros.compressed(at + camera_shift_ns, jpeg)))
        info = ros.camera_info(at + camera_shift_ns, width=64, height=48)
        rows.append(("/camera/camera_info", at + delay_ns, info))
    return rows


@pytest.fixture
def plain() -> Callable[..., list[Row]]:
    """Return the function that builds an ordinary recording."""
    return plain_rows


@pytest.fixture
def cloud_points() -> Callable[..., np.ndarray]:
    """Return the function that builds points of the simplest radar cloud."""
    return some_points
