"""MCAP files of other writers: no chunks, no index, no summary, LZ4, other encodings."""

import struct

import numpy as np
import pytest

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, first_picture, inspect_recording, open_recording
from tests.unit.recordings.containers.mcap_writing import mcap

START_NS = 1_700_000_000 * NS_PER_S


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
def test_every_shape_of_the_format_gives_every_message(shape, ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros2, plain(ros2, jpeg, n=40), **shape))
    with open_recording(path) as recording:
        np.testing.assert_array_equal(recording.radar_times, START_NS + 10**8 * np.arange(40))
        assert len(recording.radar_scans()) == 40
        assert recording.image_bytes(39).data == jpeg
        assert recording.warnings == ()


def test_an_encoding_that_is_not_of_ros_is_a_problem_of_its_topic(ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros2, plain(ros2, jpeg), encoding="protobuf"))
    with inspect_recording(path) as recording:
        assert {topic.kind for topic in recording.topics} == {"other"}
        assert "encoded as 'protobuf', but only ros1 and cdr are supported" in str(recording.topics[0].problem)
    with pytest.raises(MessageError, match="protobuf"):
        open_recording(path, RecordingOptions(radar_topic="/radar/points"))


@pytest.mark.parametrize("claimed", [1 << 40, 1 << 63, (1 << 64) - 1])
def test_a_chunk_that_claims_to_be_longer_than_any_file_is_skipped(claimed, ros2, plain, jpeg, tmp_path):
    data = bytearray(mcap(ros2, plain(ros2, jpeg, n=20), chunk_rows=15))
    start = 8 + 9 + int.from_bytes(data[9:17], "little")
    length = 9 + int.from_bytes(data[start + 1 : start + 9], "little")
    place = data.rindex(struct.pack("<QQ", start, length))  # in the summary
    data[place + 8 : place + 16] = struct.pack("<Q", claimed)
    path = tmp_path / "made.mcap"
    path.write_bytes(data)
    assert first_picture([path]) is None
    with open_recording(path) as recording:
        assert len(recording.radar_times) == len(recording.image_times) == 20
        assert [warning.code for warning in recording.warnings] == ["not-closed"]
