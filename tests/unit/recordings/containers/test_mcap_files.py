"""MCAP files have checksums of each chunk and of the summary. Mismatches are reported."""

import struct

import pytest

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, first_image, inspect_recording, open_recording, verify_recording
from tests.unit.recordings.containers.mcap_writing import mcap

CHUNK_ROWS = 15  # 5 clouds, 5 frames and 5 camera infos in each chunk


def write(tmp_path, ros, rows, change=None, **shape):
    data = bytearray(mcap(ros, rows, checksums=True, chunk_rows=CHUNK_ROWS, **shape))
    if change is not None:
        change(data)
    path = tmp_path / "made.mcap"
    path.write_bytes(data)
    return path


def spoil_checksum(number):
    """Change the checksum of a chunk: equivalent to changing its contents, but not detected by the decompressor first."""

    def change(data):
        place = 0
        for _ in range(number + 1):
            place = data.index(b"\x06", place + 1)
            while not 100 < struct.unpack_from("<Q", data, place + 1)[0] < len(data):
                place = data.index(b"\x06", place + 1)
            found, place = place, place + 9 + struct.unpack_from("<Q", data, place + 1)[0]
        data[found + 9 + 24] ^= 0x40

    return change


@pytest.mark.parametrize("compression", ["", "lz4"])
def test_a_chunk_with_a_wrong_checksum_gives_a_warning_with_its_message_count(compression, ros2, plain, jpeg, tmp_path):
    path = write(tmp_path, ros2, plain(ros2, jpeg, n=20), spoil_checksum(1), compression=compression)
    with open_recording(path) as recording:
        assert recording.image_bytes(7).data == jpeg
        assert len(recording.radar_scans()) == 20
        (warning,) = recording.warnings
    assert warning.code == "checksum"
    assert "with 15 messages" in warning.facts["message"]


def test_verification_checks_stored_chunks_of_a_file_without_a_summary(ros2, plain, jpeg, tmp_path):
    with inspect_recording(
        write(tmp_path, ros2, plain(ros2, jpeg, n=20), spoil_checksum(1), summary=False)
    ) as recording:
        assert recording.warnings == ()
        found = verify_recording(recording)
    assert not found.sound
    assert [one.damaged for one in found.topics] == [5, 5, 5]
    assert [warning.code for warning in found.warnings] == ["checksum"]


def test_a_flipped_byte_in_a_image_gives_a_warning(ros2, plain, jpeg, tmp_path):
    def flip(data):
        data[data.index(jpeg, data.index(jpeg, len(data) // 2) + 1) + len(jpeg) // 2] ^= 1

    path = write(tmp_path, ros2, plain(ros2, jpeg, n=20), flip)
    with open_recording(path) as recording:
        whole = [recording.image_bytes(number).data == jpeg for number in range(20)]
        assert whole.count(False) == 1
        assert [warning.code for warning in recording.warnings] == ["checksum"]


def test_a_compressed_chunk_with_a_wrong_checksum_counts_as_damaged_in_a_file_without_index(
    ros2, plain, jpeg, tmp_path
):
    path = write(tmp_path, ros2, plain(ros2, jpeg, n=20), spoil_checksum(2), compression="lz4", summary=False)
    with open_recording(path) as recording:
        assert len(recording.radar_scans()) == 20
        assert [warning.code for warning in recording.warnings] == ["not-closed"]
        assert "wrong checksum" in recording.warnings[0].facts["message"]


def test_a_summary_with_a_wrong_checksum_is_not_trusted(ros2, plain, jpeg, tmp_path):
    def change(data):
        data[data.rindex(b"/radar/points") + 1] ^= 0x20  # in the repeated channel, which comes in the summary

    with inspect_recording(write(tmp_path, ros2, plain(ros2, jpeg, n=20), change)) as recording:
        assert recording.radar_topic == "/radar/points"
        assert len(recording.radar_scans()) == 20
        assert [warning.code for warning in recording.warnings] == ["not-closed"]


# MCAP files of other writers: no chunks, no index, no summary, LZ4, other encodings.


START_NS = 1_700_000_000 * NS_PER_S


def test_a_file_without_chunks_that_ends_with_a_message_gives_this_one_too(ros2, plain, jpeg, tmp_path):
    rows = sorted(plain(ros2, jpeg, n=40), key=lambda row: row[0])
    data, last = mcap(ros2, rows, chunked=False, summary=False), ros2.serialise(rows[-1][2])
    path = tmp_path / "made.mcap"
    path.write_bytes(data[: data.rindex(last) + len(last)])
    with open_recording(path) as recording:
        assert rows[-1][0] == recording.radar_topic
        assert len(recording.radar_times) == 40


def test_an_encoding_that_is_not_of_ros_is_a_problem_of_its_topic(ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros2, plain(ros2, jpeg), encoding="protobuf"))
    with inspect_recording(path) as recording:
        assert {topic.kind for topic in recording.topics} == {"other"}
        assert "encoded as 'protobuf'" in str(recording.topics[0].problem)
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
    assert first_image([path]) is None
    with open_recording(path) as recording:
        assert len(recording.radar_times) == len(recording.image_times) == 20
        assert [warning.code for warning in recording.warnings] == ["not-closed"]
