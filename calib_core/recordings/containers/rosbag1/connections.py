"""The connections of a ROS 1 bag exactly as stored, as channels of MCAP."""

from collections.abc import Iterator, Mapping

from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source
from calib_core.recordings.containers.rosbag1.records import fields_of
from calib_core.recordings.containers.rosbag1.recovery import scan_bag
from calib_core.recordings.containers.rosbag1.tail import CONNECTION, record_head
from calib_core.recordings.containers.stored_channels import StoredChannel

_MAGIC_BYTES = len(b"#ROSBAG V2.0\n")
_OWN_FIELDS = ("topic", "type", "message_definition")


def stored_connections(source: Rosbag1Source) -> Mapping[int, StoredChannel]:
    """Return the connections by number; a bag without an index is walked through once more."""
    found = {}
    for header, data in _records(source.file, recovered=source.recovered):
        fields = fields_of(data)
        if fields is not None and len(header.get("conn", b"")) == 4:
            found[int.from_bytes(header["conn"], "little")] = _channel(header, fields)
    return found


def _records(file: FileBytes, *, recovered: bool) -> Iterator[tuple[Mapping[str, bytes], bytes]]:
    """Yield header and data of the connection records."""
    head = record_head(FileStretch(file, 0, file.size_bytes), _MAGIC_BYTES, file, 0)
    after = _MAGIC_BYTES + 8 + len(head[0]) + head[1]
    if recovered:
        yield from scan_bag(file, after).connections.values()
        return
    position = int.from_bytes((fields_of(head[0]) or {}).get("index_pos", b""), "little")
    stretch = FileStretch(file, position, file.size_bytes - position)
    place = 0
    while place < stretch.size:
        raw, size = record_head(stretch, place, file, position)
        place += 8 + len(raw)
        header = fields_of(raw) or {}
        if header.get("op") == bytes([CONNECTION]):
            yield header, stretch.up_to(place, size)
        place += size


def _channel(header: Mapping[str, bytes], fields: Mapping[str, bytes]) -> StoredChannel:
    definition = fields.get("message_definition", b"")
    notes = tuple((name, _text(value)) for name, value in fields.items() if name not in _OWN_FIELDS)
    topic, kind = _text(header.get("topic", b"")), _text(fields.get("type", b""))
    return StoredChannel(topic, "ros1", kind, "ros1msg", definition, notes)


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
