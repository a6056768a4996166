"""Parse the message definitions in a recording into fields. Nothing in them is ever executed."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

from calib_core.errors import MessageError
from calib_core.recordings.containers.sources import Channel, Encoding, StoredChannel
from calib_core.recordings.messages.foxglove import ros_channel

_POINT = "float64 x\nfloat64 y\nfloat64 z\n"
_RULE = "================\n"

KNOWN_DEFINITIONS: Mapping[str, str] = {
    "sensor_msgs/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n",
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
        "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n"
        f"{_RULE}MSG: sensor_msgs/RegionOfInterest\n"
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
    ),
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\nuint32 point_step\n"
        "uint32 row_step\nuint8[] data\nbool is_dense\n"
        f"{_RULE}MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"
    ),
    "sensor_msgs/PointCloud": (
        "std_msgs/Header header\ngeometry_msgs/Point32[] points\nChannelFloat32[] channels\n"
        f"{_RULE}MSG: geometry_msgs/Point32\nfloat32 x\nfloat32 y\nfloat32 z\n"
        f"{_RULE}MSG: sensor_msgs/ChannelFloat32\nstring name\nfloat32[] values\n"
    ),
    "foxglove_msgs/CompressedVideo": "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n",
    "ffmpeg_image_transport_msgs/FFMPEGPacket": (
        "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\nbool is_bigendian\n"
        "uint8[] data\n"
    ),
    "nebula_msgs/NebulaPackets": (
        "std_msgs/Header header\nNebulaPacket[] packets\n"
        f"{_RULE}MSG: nebula_msgs/NebulaPacket\nbuiltin_interfaces/Time stamp\nuint8[] data\n"
    ),
    "radar_msgs/RadarScan": (
        "std_msgs/Header header\nRadarReturn[] returns\n"
        f"{_RULE}MSG: radar_msgs/RadarReturn\n"
        "float32 range\nfloat32 azimuth\nfloat32 elevation\nfloat32 doppler_velocity\nfloat32 amplitude\n"
    ),
    "radar_msgs/RadarTracks": (
        "std_msgs/Header header\nRadarTrack[] tracks\n"
        f"{_RULE}MSG: radar_msgs/RadarTrack\n"
        "unique_identifier_msgs/UUID uuid\ngeometry_msgs/Point position\ngeometry_msgs/Vector3 velocity\n"
        "geometry_msgs/Vector3 acceleration\ngeometry_msgs/Vector3 size\nuint16 classification\n"
        "float32[6] position_covariance\nfloat32[6] velocity_covariance\nfloat32[6] acceleration_covariance\n"
        "float32[6] size_covariance\n"
        f"{_RULE}MSG: unique_identifier_msgs/UUID\nuint8[16] uuid\n"
        f"{_RULE}MSG: geometry_msgs/Point\n{_POINT}"
        f"{_RULE}MSG: geometry_msgs/Vector3\n{_POINT}"
    ),
    "tf2_msgs/TFMessage": (
        "geometry_msgs/TransformStamped[] transforms\n"
        f"{_RULE}MSG: geometry_msgs/TransformStamped\n"
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
        f"{_RULE}MSG: geometry_msgs/Transform\n"
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
        f"{_RULE}MSG: geometry_msgs/Vector3\n{_POINT}"
        f"{_RULE}MSG: geometry_msgs/Quaternion\n{_POINT}float64 w\n"
    ),
}
"""Standard and well-known messages, for recordings without definitions (as SQLite bags before ROS 2 Iron): the field lists of
ROS 2, and only of types whose layout has not changed since Foxy."""


PRIMITIVES: Mapping[str, str] = {
    "bool": "u1", "byte": "u1", "char": "u1", "octet": "u1",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
"""NumPy's name of each fixed-size type."""
_FIELD = re.compile(
    r"^(?P<type>[A-Za-z]\w*(?:/\w+){0,2})(?:<=(?P<bound>\d+))?(?P<array>\[(?:<=)?(?P<count>\d*)\])?\s+"
    r"(?P<name>[A-Za-z]\w*)(?P<rest>\s.*|=.*|)$"
)
_SEPARATOR = re.compile(r"^={3,}\s*$", re.MULTILINE)
_MAX_TEXT = 1 << 20
_MAX_FIXED = 1 << 24
_UNCHANGED = ("tf2_msgs/TFMessage",)


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message.

    Attributes:
        name: as the definition has it.
        type: a primitive, "string", "wstring", or the short name of another message ("std_msgs/Header").
        count: None for a single value, 0 for an array of any length, else the fixed length.
        comment: what the definition says about it; two fields that differ only in this are equal.
    """

    name: str
    type: str
    count: int | None = None
    comment: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Definition:
    """A message type and all types it contains.

    Attributes:
        type: short name, "package/Type".
        types: the fields of each type by short name.
        encoding: the serialisation of its messages.
        remarks: the comments of each type that stand on lines of their own, by short name.
    """

    type: str
    types: Mapping[str, tuple[Field, ...]]
    encoding: Encoding
    remarks: Mapping[str, str] = field(default_factory=dict)

    @property
    def fields(self) -> tuple[Field, ...]:
        """The fields of the message itself."""
        return self.types[self.type]

    @property
    def names(self) -> frozenset[str]:
        """The names of the message's own fields."""
        return frozenset(entry.name for entry in self.fields)

    def field(self, name: str) -> Field:
        """Return one of the message's own fields."""
        return next(entry for entry in self.fields if entry.name == name)

    @property
    def stamp_offset(self) -> int | None:
        """Byte offset of the 8-byte stamp that a message begins with; None if it does not begin with one."""
        first = self.fields[0].type if self.fields else ""
        if first == "std_msgs/Header" or (first in ("time", "builtin_interfaces/Time") and self.encoding == "cdr"):
            return 4  # after the sequence number (ROS 1), or after the encapsulation (CDR)
        return 0 if first == "time" else None


def short_type(name: str) -> str:
    """Return "package/Type" for "package/msg/Type"; short names are returned unchanged."""
    return name.replace("/msg/", "/")


def definition_of(channel: Channel) -> Definition:
    """Parse a channel's definition; if the recording has none, use the well-known one of that name.

    Raises:
        MessageError: there is none, it cannot be parsed, or the encoding is not a ROS encoding.
    """
    channel = ros_channel(channel)
    if channel.encoding not in ("ros1", "cdr"):
        raise MessageError(
            f"topic {channel.topic}: messages are encoded as '{channel.encoding}', but only ros1 and cdr are supported, and of "
            "json and protobuf the images, point clouds and camera calibrations of Foxglove; record the topic through ROS, or "
            "convert it"
        )
    encoding: Encoding = "ros1" if channel.encoding == "ros1" else "cdr"
    name = short_type(channel.type)
    text, form = channel.definition, channel.definition_format
    if form == "" or not text.strip():
        if name not in KNOWN_DEFINITIONS:
            raise MessageError(
                f"topic {channel.topic}: the recording has no definition of {channel.type}, and the type is unknown; "
                f"beside a .db3 put its package's files as {name.replace('/', '/msg/')}.msg, or convert the recording where "
                "that package is installed (ros2 bag convert to mcap writes definitions)"
            )
        text, form = KNOWN_DEFINITIONS[name], "msg"
    try:
        return parse_definition(name, text, encoding, form=form)
    except MessageError as error:
        raise MessageError(f"topic {channel.topic}: {error}") from error


@cache
def parse_definition(name: str, text: str, encoding: Encoding, *, form: str = "msg") -> Definition:
    """Parse a definition followed by the definitions it depends on.

    Args:
        name: short name of the message.
        text: the concatenated definitions, separated by lines of "=".
        encoding: "ros1" or "cdr".
        form: "msg" or "idl".

    Raises:
        MessageError: the text is not such a definition.
    """
    if len(text) > _MAX_TEXT:
        raise MessageError(f"the definition of {name} is {len(text)} characters long; at most {_MAX_TEXT} are allowed")
    types: dict[str, tuple[Field, ...]] = dict(_built_in(encoding))
    if form == "idl":
        types.update(_parse_idl(name, text))
    else:
        types.update((owner, tuple(_parse_fields(owner, body))) for owner, body in _sections(name, text))
    types = {owner: _resolve(owner, fields, types) for owner, fields in types.items()}
    definition = Definition(name, types, encoding, {} if form == "idl" else _remarks(name, text))
    _check(definition, name, ())
    return definition


def _built_in(encoding: Encoding) -> dict[str, tuple[Field, ...]]:
    if encoding == "ros1":
        return {
            "time": (Field("sec", "uint32"), Field("nanosec", "uint32")),
            "duration": (Field("sec", "int32"), Field("nanosec", "int32")),
            "std_msgs/Header": (Field("seq", "uint32"), Field("stamp", "time"), Field("frame_id", "string")),
        }
    stamp = (Field("sec", "int32"), Field("nanosec", "uint32"))
    return {
        "builtin_interfaces/Time": stamp,
        "builtin_interfaces/Duration": stamp,
        "std_msgs/Header": (Field("stamp", "builtin_interfaces/Time"), Field("frame_id", "string")),
    }


def _sections(name: str, text: str) -> list[tuple[str, str]]:
    """Split concatenated definitions into the short name and the text of each type."""
    found = []
    for number, section in enumerate(_SEPARATOR.split(text)):
        owner, body = name, section
        if number:
            head, _, body = section.strip().partition("\n")
            if not head.startswith("MSG:"):
                raise MessageError(
                    f"the definition of {name} has a section that begins with {head[:40]!r} instead of MSG:"
                )
            owner = short_type(head[4:].strip())
        found.append((owner, body))
    return found


def _remarks(name: str, text: str) -> dict[str, str]:
    """Return the comments on lines of their own, by type."""
    return {
        owner: "\n".join(line.strip("# \t") for line in body.splitlines() if line.lstrip().startswith("#"))
        for owner, body in _sections(name, text)
    }


def _parse_fields(owner: str, body: str) -> list[Field]:
    fields = []
    above: list[str] = []
    for line in body.splitlines():
        code, _, comment = line.partition("#")
        text = line.strip() if "=" in code else code.strip()
        if not text:
            above = [*above, comment.strip("# \t")] if comment else []
            continue
        said, above = comment.strip("# \t") or " ".join(above), []
        match = _FIELD.match(text)
        if not match:
            raise MessageError(f"the definition of {owner} has a line that is not a field: {text[:60]!r}")
        rest = match["rest"].strip()
        if rest.startswith("=") and not rest.startswith("=="):
            continue  # a constant takes no space in a message
        count = None if match["array"] is None else 0 if "<=" in match["array"] else int(match["count"] or 0)
        if match["array"] is not None and match["count"] and "<=" not in match["array"] and count == 0:
            continue  # neither does a fixed array of length 0
        fields.append(Field(match["name"], short_type(match["type"]), count, said))
    return fields


def _parse_idl(name: str, text: str) -> dict[str, tuple[Field, ...]]:
    """Parse OMG IDL with rosbags' grammar, which yields plain tuples."""
    from rosbags.typesys import get_types_from_idl
    from rosbags.typesys.base import TypesysError

    types: dict[str, tuple[Field, ...]] = {}
    try:
        for section in _SEPARATOR.split(text):
            body = re.sub(r"^\s*IDL:.*$", "", section, flags=re.MULTILINE)
            for owner, (_, fields) in get_types_from_idl(body).items() if body.strip() else ():
                types[short_type(owner)] = tuple(_field_from_rosbags(*field) for field in fields)
    except TypesysError as error:
        why = " ".join(str(error).split())
        raise MessageError(f"the definition of {name} is not valid IDL ({why})") from error
    if name not in types:
        raise MessageError(f"the IDL text does not define {name}")
    return types


def _field_from_rosbags(name: str, description: tuple[int, object]) -> Field:
    kind, inner = description  # 1 base, 2 name, 3 fixed array, 4 sequence
    if kind == 1:
        return Field(name, str(inner[0] if isinstance(inner, tuple) else inner))
    if kind == 2:
        return Field(name, short_type(str(inner)))
    assert isinstance(inner, tuple)
    element = _field_from_rosbags(name, inner[0])
    return Field(name, element.type, int(inner[1]) if int(kind) == 3 else 0)


def _resolve(owner: str, fields: tuple[Field, ...], types: Mapping[str, tuple[Field, ...]]) -> tuple[Field, ...]:
    """Replace every nested type by its short name: a bare name is in the same package, Header in std_msgs."""
    resolved = []
    for entry in fields:
        kind = entry.type
        if kind not in PRIMITIVES and kind not in ("string", "wstring") and kind not in types:
            package = owner.partition("/")[0]
            kind = "std_msgs/Header" if kind == "Header" else f"{package}/{kind}"
            if "/" in entry.type or kind not in types:
                unknown = entry.type if "/" in entry.type else kind
                raise MessageError(f"the definition of {owner} uses {unknown}, which is not defined in the recording")
        resolved.append(replace(entry, type=kind))
    return tuple(resolved)


def _check(definition: Definition, name: str, above: tuple[str, ...]) -> None:
    """Refuse types that contain themselves or two fields of one name, and implausibly long arrays."""
    if name in above or len(above) > 32:
        raise MessageError(f"the definition of {definition.type} contains itself at {name}")
    if len({one.name for one in definition.types[name]}) < len(definition.types[name]):
        raise MessageError(f"the definition of {name} has two fields of one name; it is damaged")
    for one in definition.types[name]:
        if (one.count or 0) > _MAX_FIXED:
            raise MessageError(
                f"the definition of {name} has a fixed array of {one.count} elements; at most {_MAX_FIXED} are allowed"
            )
        if one.type in definition.types:
            _check(definition, one.type, (*above, name))


def with_definition(channel: StoredChannel) -> StoredChannel:
    """Return the channel with the well-known definition of its type, where it has none and there is one."""
    kind = short_type(channel.schema_name)
    if channel.schema_data.strip() or channel.encoding != "cdr" or kind not in (*KNOWN_DEFINITIONS, *_UNCHANGED):
        return channel
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    name = kind.replace("/", "/msg/")
    if name not in store.types:
        return channel
    definition, _ = store.generate_msgdef(name, ros_version=2)
    return replace(channel, schema_encoding="ros2msg", schema_data=definition.encode())
