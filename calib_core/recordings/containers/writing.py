"""Build ROS messages from values, with rosbags, and write them as bags: for simulated recordings, exports and tests."""

import errno
import sqlite3
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from calib_core.arrays import freeze
from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.lens_models.registry import written_lens
from calib_core.measurements import TimeNs, time_parts
from calib_core.recordings.containers.sources import ChannelNotes, StoredChannel

Ros2Container = Literal["mcap", "sqlite3"]
RADAR_SCAN_TYPE = "ti_mmwave_rospkg/msg/RadarScan"
RADAR_SCAN_DEFINITION = """\
Header header
uint16 point_id
float32 x
float32 y
float32 z
float32 range
float32 velocity
uint16 doppler_bin
float32 bearing
float32 intensity
"""
TRANSFORMS_TYPE = "tf2_msgs/msg/TFMessage"
TRANSFORMS_DEFINITION = "geometry_msgs/TransformStamped[] transforms\n"


@dataclass(frozen=True, slots=True)
class CompressedImageMessage:
    """A sensor_msgs/CompressedImage: the bytes of a JPEG or PNG file."""

    stamp: TimeNs
    frame_id: str
    data: bytes
    format: str = "jpeg"


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfoMessage:
    """A sensor_msgs/CameraInfo."""

    stamp: TimeNs
    frame_id: str
    camera: Camera


@dataclass(frozen=True, slots=True, eq=False)
class CloudMessage:
    """A sensor_msgs/PointCloud2 of little-endian float32 fields without padding: values are (n, k) for k names."""

    stamp: TimeNs
    frame_id: str
    names: tuple[str, ...]
    values: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, np.float32, values=(None, len(self.names)))


@dataclass(frozen=True, slots=True)
class RadarReturnMessage:
    """A ti_mmwave_rospkg/RadarScan: one return; point_id 0 begins a scan.

    Attributes:
        stamp: when the driver parsed the return.
        frame_id: of the radar.
        point_id: index in its scan.
        x_m: forward.
        y_m: left.
        z_m: up.
        range_m: the slant range.
        velocity_mps: positive moving away.
        doppler_bin: 0 to the number of bins minus 1; zero speed is at half the number of bins.
        bearing_deg: positive to the left.
        intensity_db: SNR.
    """

    stamp: TimeNs
    frame_id: str
    point_id: int
    x_m: float
    y_m: float
    z_m: float
    range_m: float
    velocity_mps: float
    doppler_bin: int
    bearing_deg: float
    intensity_db: float


@dataclass(frozen=True, slots=True, eq=False)
class TransformMessage:
    """A tf2_msgs/TFMessage of one transform.

    Attributes:
        stamp: of the transform.
        frame_id: of the parent.
        child_frame_id: of the child.
        parent_from_child: the pose of the child in the parent.
    """

    stamp: TimeNs
    frame_id: str
    child_frame_id: str
    parent_from_child: RigidTransform


MessageBody: TypeAlias = (
    CompressedImageMessage | CameraInfoMessage | CloudMessage | RadarReturnMessage | TransformMessage
)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedMessage:
    """A message as received by the recorder."""

    topic: str
    receive_time: TimeNs
    body: MessageBody


def write_ros1_bag(path: Path, messages: Iterable[RecordedMessage]) -> Path:
    """Write a ROS 1 bag and return its path.

    Args:
        path: of a file that does not exist yet.
        messages: in the order to write them; recorders write by receive time.

    Raises:
        RecordingError: the file exists.
    """
    from rosbags.rosbag1 import Writer

    _refuse_existing(path)
    build = MessageBuilder(1)
    with Writer(path) as writer:
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
        OSError: it cannot be written.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer

    _refuse_existing(path)
    build = MessageBuilder(2)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[container.upper()])
    try:
        with writer:
            _write_all(
                messages,
                lambda topic, kind: writer.add_connection(topic, kind, typestore=build.typestore),
                lambda connection, message: writer.write(
                    connection, int(message.receive_time), build.cdr(message.body)
                ),
            )
    except sqlite3.OperationalError as error:
        raise OSError(errno.EIO, str(error)) from error
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


MESSAGE_TYPES: dict[type, str] = {
    CompressedImageMessage: "sensor_msgs/msg/CompressedImage",
    CameraInfoMessage: "sensor_msgs/msg/CameraInfo",
    CloudMessage: "sensor_msgs/msg/PointCloud2",
    RadarReturnMessage: RADAR_SCAN_TYPE,
    TransformMessage: TRANSFORMS_TYPE,
}


class MessageBuilder:
    """Convert message values to serialised messages of one ROS generation."""

    def __init__(self, generation: Literal[1, 2]) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.generation = generation
        self.typestore: Any = get_typestore(Stores.ROS1_NOETIC if generation == 1 else Stores.ROS2_JAZZY)
        header = "Header header" if generation == 1 else "std_msgs/Header header"
        definition = RADAR_SCAN_DEFINITION.replace("Header header", header, 1)
        self.typestore.register(get_types_from_msg(definition, RADAR_SCAN_TYPE))
        if TRANSFORMS_TYPE not in self.typestore.types:  # as in the store of ROS 1
            self.typestore.register(get_types_from_msg(TRANSFORMS_DEFINITION, TRANSFORMS_TYPE))
        self.sequence: dict[type, int] = {}

    def serialised(self, body: MessageBody) -> bytes:
        """Serialise for this generation."""
        return self.ros1(body) if self.generation == 1 else self.cdr(body)

    def channel(self, topic: str, kind: type, notes: ChannelNotes = ()) -> StoredChannel:
        """Return the channel of a topic, with the definition of its messages.

        Args:
            topic: its name.
            kind: the class of the values.
            notes: the recorder's notes.
        """
        name, language = MESSAGE_TYPES[kind], f"ros{self.generation}msg"
        definition, md5sum = self.typestore.generate_msgdef(name, ros_version=self.generation)
        if self.generation == 1:
            name, notes = name.replace("/msg/", "/"), (("md5sum", md5sum), *notes)
        return StoredChannel(
            topic, "ros1" if self.generation == 1 else "cdr", name, language, definition.encode(), notes
        )

    def ros1(self, body: MessageBody) -> bytes:
        """Serialise for ROS 1."""
        return bytes(self.typestore.serialize_ros1(self.message(body), MESSAGE_TYPES[type(body)]))

    def cdr(self, body: MessageBody) -> bytes:
        """Serialise for ROS 2."""
        return bytes(self.typestore.serialize_cdr(self.message(body), MESSAGE_TYPES[type(body)]))

    def message(self, body: MessageBody) -> Any:
        """Build the ROS message for a value."""
        if isinstance(body, RadarReturnMessage):
            return self._radar_return(body)
        if isinstance(body, CloudMessage):
            return self._cloud(body)
        if isinstance(body, CameraInfoMessage):
            return self._camera_info(body)
        if isinstance(body, TransformMessage):
            return self._transform(body)
        data = np.frombuffer(body.data, dtype=np.uint8)
        return self._new(body, header=self._header(body), format=body.format, data=data)

    def _new(self, body: MessageBody, **fields: Any) -> Any:
        return self.typestore.types[MESSAGE_TYPES[type(body)]](**fields)

    def _header(self, body: MessageBody) -> Any:
        sec, nanosec = time_parts(body.stamp)
        stamp = self.typestore.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        header = self.typestore.types["std_msgs/msg/Header"]
        if self.generation == 2:
            return header(stamp=stamp, frame_id=body.frame_id)
        sequence = self.sequence.get(type(body), 0)
        self.sequence[type(body)] = sequence + 1
        return header(seq=sequence, stamp=stamp, frame_id=body.frame_id)

    def _transform(self, body: TransformMessage) -> Any:
        w, *xyz = quaternion_wxyz_from_matrix(body.parent_from_child.rotation).tolist()
        types = self.typestore.types
        vector = types["geometry_msgs/msg/Vector3"](*body.parent_from_child.translation_m.tolist())
        pose = types["geometry_msgs/msg/Transform"](
            translation=vector, rotation=types["geometry_msgs/msg/Quaternion"](*xyz, w)
        )
        stamped = types["geometry_msgs/msg/TransformStamped"]
        return self._new(
            body,
            transforms=[stamped(header=self._header(body), child_frame_id=body.child_frame_id, transform=pose)],
        )

    def _radar_return(self, body: RadarReturnMessage) -> Any:
        """Build the message: its fields follow the header in the order of ours."""
        names = [line.split()[1] for line in RADAR_SCAN_DEFINITION.splitlines()[1:]]
        return self._new(body, header=self._header(body), **dict(zip(names, astuple(body)[-len(names) :], strict=True)))

    def _cloud(self, body: CloudMessage) -> Any:
        field = self.typestore.types["sensor_msgs/msg/PointField"]
        count, width = body.values.shape
        return self._new(
            body,
            header=self._header(body),
            height=1,
            width=count,
            fields=[field(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(body.names)],
            is_bigendian=False,
            point_step=4 * width,
            row_step=4 * width * count,
            data=np.frombuffer(body.values.astype("<f4").tobytes(), dtype=np.uint8),
            is_dense=True,
        )

    def _camera_info(self, body: CameraInfoMessage) -> Any:
        camera = body.camera
        projection = np.zeros((3, 4))
        projection[:, :3] = camera.matrix_px
        lens = written_lens(camera.lens, camera.distortion, "camera_info")
        arrays = {
            "D": np.array(lens.coefficients),
            "K": camera.matrix_px.reshape(-1),
            "R": np.eye(3).reshape(-1),
            "P": projection.reshape(-1),
        }
        region = self.typestore.types["sensor_msgs/msg/RegionOfInterest"]
        return self._new(
            body,
            header=self._header(body),
            height=camera.height_px,
            width=camera.width_px,
            distortion_model=lens.name,
            **{(name if self.generation == 1 else name.lower()): values for name, values in arrays.items()},
            binning_x=0,
            binning_y=0,
            roi=region(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
        )
