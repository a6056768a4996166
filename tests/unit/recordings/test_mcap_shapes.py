"""MCAP files other writers make: no chunks, no index, no summary, LZ4, other encodings."""

import struct

import lz4.frame
import numpy as np
import pytest

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, inspect_recording, open_recording

START_NS = 1_700_000_000 * NS_PER_S
MAGIC = b"\x89MCAP0\r\n"


def text(value: str) -> bytes:
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def mcap(
    ros, rows, *, chunked=True, compression="", summary=True, chunk_index=True, message_index=True, encoding="cdr"
) -> bytes:
    """Write an MCAP by its specification, with the parts left out that a test asks for."""
    topics = sorted({topic for topic, _, _ in rows})
    kinds = {topic: message.__msgtype__ for topic, _, message in rows}
    profile = "ros1" if ros.generation == 1 else "ros2"
    form = "ros1msg" if ros.generation == 1 else "ros2msg"
    declared = b""
    for number, topic in enumerate(topics, 1):
        definition = ros.store.generate_msgdef(kinds[topic], ros_version=ros.generation)[0]
        name = kinds[topic].replace("/msg/", "/") if ros.generation == 1 else kinds[topic]
        declared += record(3, struct.pack("<H", number) + text(name) + text(form) + text(definition))
        channel = struct.pack("<HH", number, number) + text(topic) + text("ros1" if ros.generation == 1 else encoding)
        declared += record(4, channel + struct.pack("<I", 0))
    out = MAGIC + record(1, text(profile) + text("a test"))
    places: dict[int, list[tuple[int, int]]] = {}
    body = declared
    for sequence, (topic, at, message) in enumerate(rows):
        number = topics.index(topic) + 1
        places.setdefault(number, []).append((at, len(body)))
        body += record(5, struct.pack("<HIQQ", number, sequence, at, at) + ros.serialise(message))
    times = [at for _, at, _ in rows]
    infos = b""
    if chunked:
        packed = lz4.frame.compress(body) if compression == "lz4" else body
        head = struct.pack("<QQQI", min(times), max(times), len(body), 0) + text(compression)
        start, chunk = len(out), record(6, head + struct.pack("<Q", len(packed)) + packed)
        out += chunk
        indexes, offsets = b"", b""
        if message_index:
            for number, entries in places.items():
                offsets += struct.pack("<HQ", number, len(out) + len(indexes))
                array = b"".join(struct.pack("<QQ", *entry) for entry in entries)
                indexes += record(7, struct.pack("<HI", number, len(array)) + array)
        out += indexes
        info = struct.pack("<QQQQI", min(times), max(times), start, len(chunk), len(offsets)) + offsets
        info += struct.pack("<Q", len(indexes)) + text(compression) + struct.pack("<QQ", len(packed), len(body))
        infos = record(8, info) if chunk_index else b""
    else:
        out += body
    out += record(15, bytes(4))
    summary_start = len(out) if summary else 0
    if summary:
        out += declared + infos
    return out + record(2, struct.pack("<QQI", summary_start, 0, 0)) + MAGIC


SHAPES = [
    {},
    {"compression": "lz4"},
    {"message_index": False},
    {"message_index": False, "compression": "lz4"},
    {"chunk_index": False},
    {"summary": False},
    {"summary": False, "compression": "lz4"},
    {"chunked": False},
    {"chunked": False, "summary": False},
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: "-".join(f"{k}" for k in shape) or "usual")
def test_every_shape_of_the_format_gives_every_message(shape, ros, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros, plain(ros, jpeg, n=40), **shape))
    with open_recording(path) as recording:
        np.testing.assert_array_equal(recording.radar_times, START_NS + 10**8 * np.arange(40))
        assert len(recording.radar_scans()) == 40
        assert recording.image_bytes(39).data == jpeg
        assert recording.cautions == ()


@pytest.mark.parametrize("shape", [{"summary": False}, {"chunked": False}])
def test_a_file_that_was_not_closed_is_read_up_to_its_end_and_said(shape, ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    data = mcap(ros2, plain(ros2, jpeg, n=40), **shape)
    path.write_bytes(data[: data.rindex(b"\x0f" + struct.pack("<Q", 4))] + b"\x05\x30")
    with open_recording(path) as recording:
        assert len(recording.radar_times) == 40
        assert [caution.code for caution in recording.cautions] == ["not-closed"]
        assert "120 messages" in recording.cautions[0].message


def test_an_encoding_that_is_not_of_ros_is_a_problem_of_its_topic(ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros2, plain(ros2, jpeg), encoding="protobuf"))
    with inspect_recording(path) as recording:
        assert {topic.kind for topic in recording.topics} == {"other"}
        assert "encoded as 'protobuf'; only ros1 and cdr can be read" in str(recording.topics[0].problem)
    with pytest.raises(MessageError, match="protobuf"):
        open_recording(path, RecordingOptions(radar_topic="/radar/points"))
