"""The first image is read from the beginning of a file, and little else is read."""

from typing import Any

import pytest
from rosbags.rosbag1 import Writer

from calib_core.recordings import RecordingOptions, first_image, open_recording
from calib_core.recordings.containers.positioned_reads import FileBytes
from tests.unit.recordings.conftest import Ros
from tests.unit.recordings.containers.mcap_writing import mcap


def numbered(jpeg: bytes, number: int) -> bytes:
    """Return another image of the same size: a JPEG whose comment says which one it is."""
    return jpeg[:2] + b"\xff\xfe\x00\x06" + number.to_bytes(4, "big") + jpeg[2:]


def two_cameras(ros, plain, jpeg, n=400):
    """Return a recording of many small chunks with a second camera that has fewer images."""
    rows = []
    frames = 0
    for topic, at, message in plain(ros, jpeg, n=n):
        if topic == "/camera/image/compressed":
            message = ros.compressed(at - 30_000_000, numbered(jpeg, frames))
            frames += 1
            if frames > n // 2:
                rows.append(("/aside/image/compressed", at, message))
        rows.append((topic, at, message))
    return rows


def test_the_first_image_is_the_first_frame_of_the_recording(plain, jpeg, write, container):
    ros = Ros(1 if container.startswith("bag") else 2)
    path = write(ros, two_cameras(ros, plain, jpeg, n=60), container)
    image = first_image([path])
    assert image is not None
    with open_recording(path) as recording:
        assert image == recording.image_bytes(0)
        assert recording.image_topic == "/camera/image/compressed"


@pytest.mark.parametrize("chunk_rows", [3, 50])
def test_the_camera_is_the_one_that_opening_chooses(chunk_rows, ros2, plain, jpeg, tmp_path):
    path = tmp_path / "made.mcap"
    path.write_bytes(mcap(ros2, two_cameras(ros2, plain, jpeg), chunk_rows=chunk_rows))
    with open_recording(path) as recording:
        assert first_image([path]) == recording.image_bytes(0)
    aside = RecordingOptions(image_topic="/aside/image/compressed")
    with open_recording(path, aside) as recording:
        assert first_image([path], aside) == recording.image_bytes(0)


def test_little_of_a_large_bag_is_read_for_it(ros1, plain, jpeg, write, monkeypatch):
    big = jpeg + bytes(200_000)
    rows = [
        (topic, at, ros1.compressed(at, big) if "image" in topic else message)
        for topic, at, message in plain(ros1, jpeg, n=800)
    ]
    path = write(ros1, rows, "bag")
    read = []
    up_to = FileBytes.up_to

    def counted(self, offset, size):
        data = up_to(self, offset, size)
        read.append(len(data))
        return data

    monkeypatch.setattr(FileBytes, "up_to", counted)
    assert first_image([path]) is not None
    assert len(read) < 20
    assert sum(read) < 1_000_000


def test_gaps_after_the_chunks_of_a_bag_are_not_read(ros1, plain, jpeg, tmp_path, monkeypatch):
    path = tmp_path / "gaps.bag"
    writer = Writer(path)
    topics: dict[str, Any] = {}
    with writer:
        for topic, at, message in plain(ros1, jpeg, n=30):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, message.__msgtype__, typestore=ros1.store)
            writer.write(topics[topic], at, ros1.serialise(message))
            if topic == "/camera/camera_info" and len(writer.chunks) < 20:
                writer.write_chunk(writer.chunks[-1])
                writer.bio.seek(5_000_000, 1)
    assert path.stat().st_size > 80_000_000
    sizes = []
    up_to = FileBytes.up_to

    def counted(self, offset, size):
        data = up_to(self, offset, size)
        sizes.append(len(data))
        return data

    monkeypatch.setattr(FileBytes, "up_to", counted)
    with open_recording(path) as recording:
        assert len(recording.image_times) == 30
        assert len(recording.radar_scans()) == 30
        assert recording.warnings == ()
        assert first_image([path]) == recording.image_bytes(0)
    assert sum(sizes) < 2_000_000


@pytest.mark.parametrize("keep", [0.0, 0.5, 0.99])
def test_a_file_without_its_end_has_no_first_image_before_it_is_opened(keep, ros, plain, jpeg, write):
    path = write(ros, plain(ros, jpeg))
    path = path if path.is_file() else next(path.glob("*.mcap"))
    path.write_bytes(path.read_bytes()[: int(keep * path.stat().st_size)])
    assert first_image([path]) is None


def test_files_that_are_not_ros_recordings_have_no_first_image(tmp_path):
    (tmp_path / "a.txt").write_text("nothing")
    assert first_image([tmp_path / "a.txt"]) is None
    assert first_image([tmp_path]) is None
    assert first_image([tmp_path / "missing.bag"]) is None
