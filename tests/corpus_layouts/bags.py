"""Write bags of any kind with the comments of the message definitions, as drivers' bags have them."""

from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.corpus_layouts.truth import CAMERA, HEIGHT_PX, WIDTH_PX, jpeg

Kind = Literal["bag", "mcap", "db3"]
DELAY_NS = 18_000_000  # a message is received after the moment it was measured at
SEPARATOR = "=" * 80


class Bag:
    """A bag of a kind, of new message types with their definitions as text."""

    def __init__(self, folder: Path, kind: Kind) -> None:
        self.kind = kind
        self.path = folder / ("drive.bag" if kind == "bag" else "drive")
        self.store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
        self._definitions: dict[str, str] = {}
        self._connections: dict[str, Any] = {}
        if kind == "bag":
            self._writer: Any = rosbag1.Writer(self.path)
        else:
            plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
            self._writer = rosbag2.Writer(self.path, version=9, storage_plugin=plugin)

    def __enter__(self) -> Self:
        self._writer.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.close()

    def define(self, name: str, text: str, **nested: str) -> None:
        """Register a message; nested are the types of its package that it uses, by name.

        Args:
            name: such as acme_msgs/msg/Frame.
            text: its definition, with comments.
            nested: definitions of types of the same package.
        """
        package = name.split("/")[0]
        for inner, inner_text in nested.items():
            self.store.register(get_types_from_msg(inner_text, f"{package}/msg/{inner}"))
        self.store.register(get_types_from_msg(text, name))
        parts = [text.rstrip("\n")]
        parts += [
            f"{SEPARATOR}\nMSG: {package}/{inner}\n{inner_text.rstrip(chr(10))}" for inner, inner_text in nested.items()
        ]
        generated = self.store.generate_msgdef(name, ros_version=1 if self.kind == "bag" else 2)[0]
        own = {f"MSG: {package}/{inner}" for inner in nested} | {f"MSG: {package}/msg/{inner}" for inner in nested}
        for section in generated.split(SEPARATOR + "\n")[1:]:
            if section.split("\n", 1)[0] not in own:
                parts.append(SEPARATOR + "\n" + section.rstrip("\n"))
        self._definitions[name] = "\n".join(parts) + "\n"

    def make(self, name: str, /, **fields: Any) -> Any:
        return self.store.types[name](**fields)

    def header(self, time_ns: int, frame: str) -> Any:
        sec, nanosec = divmod(int(time_ns), 10**9)
        stamp = self.make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        fields: dict[str, Any] = {"stamp": stamp, "frame_id": frame}
        if self.kind == "bag":
            fields["seq"] = 0
        return self.make("std_msgs/msg/Header", **fields)

    def write(self, topic: str, name: str, message: Any, time_ns: int) -> None:
        """Write a message, received shortly after its time."""
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, name, typestore=self.store, **self._stated(name)
            )
        serialize = self.store.serialize_ros1 if self.kind == "bag" else self.store.serialize_cdr
        self._writer.write(self._connections[topic], int(time_ns) + DELAY_NS, bytes(serialize(message, name)))

    def _stated(self, name: str) -> dict[str, str]:
        if name not in self._definitions:
            return {}
        if self.kind == "bag":
            return {"msgdef": self._definitions[name], "md5sum": self.store.generate_msgdef(name)[1]}
        return {"msgdef": self._definitions[name], "rihs01": self.store.hash_rihs01(name)}

    def write_camera(self, times_ns: np.ndarray, topic: str = "/camera") -> None:
        """Write JPEG frames and their camera info."""
        info = self._camera_info
        for number, time_ns in enumerate(times_ns.tolist()):
            header = self.header(time_ns, "camera_optical")
            data = np.frombuffer(jpeg(number), dtype=np.uint8)
            image = self.make("sensor_msgs/msg/CompressedImage", header=header, format="jpeg", data=data)
            self.write(f"{topic}/image_raw/compressed", "sensor_msgs/msg/CompressedImage", image, time_ns)
            self.write(f"{topic}/camera_info", "sensor_msgs/msg/CameraInfo", info(header), time_ns)

    def _camera_info(self, header: Any) -> Any:
        region = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        projection = np.hstack([CAMERA, np.zeros((3, 1))]).reshape(-1)
        letter = str.upper if self.kind == "bag" else str.lower
        matrices = {letter("d"): np.zeros(5), letter("k"): CAMERA.reshape(-1)}
        matrices |= {letter("r"): np.eye(3).reshape(-1), letter("p"): projection}
        sizes = {"height": HEIGHT_PX, "width": WIDTH_PX, "binning_x": 0, "binning_y": 0}
        return self.make(
            "sensor_msgs/msg/CameraInfo", header=header, distortion_model="plumb_bob", roi=region, **sizes, **matrices
        )

    def write_cloud(
        self, topic: str, frame: str, time_ns: int, rows: np.ndarray, *, height: int = 1, row_padding: int = 0
    ) -> None:
        """Write a PointCloud2 of a structured array, which may be padded and of either byte order."""
        datatypes = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
        fields = [
            self.make("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=datatypes[kind.str[1:]], count=1)
            for name, (kind, offset) in ((name, entry[:2]) for name, entry in rows.dtype.fields.items())
        ]
        bigendian = any(entry[0].byteorder == ">" for entry in rows.dtype.fields.values())
        width = len(rows) // height
        lines = [rows[row * width : (row + 1) * width].tobytes() + b"\xa5" * row_padding for row in range(height)]
        cloud = self.make(
            "sensor_msgs/msg/PointCloud2",
            header=self.header(time_ns, frame),
            height=height,
            width=width,
            fields=fields,
            is_bigendian=bigendian,
            point_step=rows.dtype.itemsize,
            row_step=rows.dtype.itemsize * width + row_padding,
            data=np.frombuffer(b"".join(lines), dtype=np.uint8),
            is_dense=True,
        )
        self.write(topic, "sensor_msgs/msg/PointCloud2", cloud, time_ns)
