"""A recording written again with its calibration, read with readers that are not ours."""

import io
import json
import tracemalloc
from collections import Counter
from itertools import pairwise

import cv2
import numpy as np
import pytest
from foxglove import layouts
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from calib_core.errors import InputError
from calib_core.interchange.own.calibration_json import read_calibration, write_calibration
from calib_core.radar import RadarErrors
from calib_core.recordings import open_recording
from calib_core.recordings.containers.writing import RADAR_SCAN_DEFINITION, RADAR_SCAN_TYPE
from tests.unit.deployment.conftest import RECORDED, SEEING, START_NS, Ros, calibration_file, exported, without_info
from tests.unit.recordings.conftest import CONTAINERS, altered

SECOND = 10**9
ADDED = ("/tf_static", "/cocalib/radar_points", "/cocalib/radar_points_corrected", "/cocalib/camera_info")


@pytest.mark.parametrize("container", CONTAINERS)
def test_every_message_of_the_original_is_there_byte_for_byte(container, rows, write, tmp_path):
    ros = Ros(1 if container.startswith("bag") else 2)
    path = write(ros, rows(ros), container)
    with AnyReader([path if container.startswith("bag") else path.parent]) as reader:
        expected = [
            (connection.topic, time, bytes(data), connection.msgdef.data)
            for connection, time, data in reader.messages()
        ]
    written = exported(path, calibration_file(RECORDED))
    found = [one for one in written.messages if one.topic not in ADDED]
    assert Counter((one.topic, one.log_time, one.data) for one in found) == Counter(row[:3] for row in expected)
    assert {one.topic: one.definition.decode() for one in found} == {row[0]: row[3] for row in expected}
    assert written.said.copied == len(expected) == 60
    assert {one.encoding for one in found} == {("ros1", "ros1msg") if ros.generation == 1 else ("cdr", "ros2msg")}
    assert not written.said.lost


def test_sequence_publish_time_and_the_recorders_notes_stay(ros2_file):
    original = make_reader(io.BytesIO(ros2_file.read_bytes()))
    written = make_reader(io.BytesIO(exported(ros2_file, calibration_file()).data))
    both = [
        [
            (channel.topic, channel.metadata, message.sequence, message.log_time, message.publish_time, message.data)
            for _, channel, message in reader.iter_messages(
                topics=["/camera/image/compressed", "/radar/points", "/other"]
            )
        ]
        for reader in (original, written)
    ]
    assert both[0] == both[1]
    assert {one[2] for one in both[0]} != {0}
    assert all(one[3] != one[4] for one in both[0])


@pytest.fixture
def ros2_file(rows, tmp_path):
    """Return a file of mcap's own writer with what others leave out: sequences, publish times, JSON, attachments, metadata."""
    ros, path = Ros(2), tmp_path / "rich.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream, compression=CompressionType.ZSTD, chunk_size=4000)
        writer.start(profile="ros2", library="other")
        ids = {}
        for number, (topic, time, message) in enumerate(without_info(rows(ros))):
            if topic not in ids:
                text = ros.store.generate_msgdef(message.__msgtype__, ros_version=2)[0].encode()
                schema = writer.register_schema(message.__msgtype__, "ros2msg", text)
                ids[topic] = writer.register_channel(topic, "cdr", schema, {"offered_qos_profiles": f"for {topic}"})
            writer.add_message(ids[topic], time, ros.serialise(message), time - 5, number + 7)
        schema = writer.register_schema("Other", "protobuf", b"\xff\x00\xfe binary")
        other = writer.register_channel("/other", "protobuf", schema, {"a": "1", "b": ""})
        writer.add_message(other, START_NS, b"\x00\x01", START_NS + 1, 3)
        writer.add_attachment(1, 2, "notes.bin", "application/octet-stream", bytes(range(256)) * 300)
        writer.add_metadata("site", {"place": "yard", "operator": ""})
        writer.finish()
    return path


def test_attachments_metadata_and_schemas_that_are_no_text_stay(ros2_file):
    reader = make_reader(io.BytesIO(exported(ros2_file, calibration_file()).data), validate_crcs=True)
    (notes,) = (one for one in reader.iter_attachments() if one.name == "notes.bin")
    assert (notes.data, notes.log_time, notes.create_time) == (bytes(range(256)) * 300, 2, 1) or (
        notes.data,
        notes.create_time,
        notes.log_time,
    ) == (bytes(range(256)) * 300, 1, 2)
    assert {"place": "yard", "operator": ""} in [one.metadata for one in reader.iter_metadata() if one.name == "site"]
    summary = reader.get_summary()
    (other,) = (channel for channel in summary.channels.values() if channel.topic == "/other")
    assert summary.schemas[other.schema_id].data == b"\xff\x00\xfe binary"
    assert (summary.statistics.attachment_count, summary.statistics.metadata_count) == (2, 2)
    assert reader.get_header().profile == "ros2"


@pytest.mark.parametrize("container", ["bag", "bag-lz4", "mcap", "mcap-zstd", "db3"])
def test_index_and_stream_agree_and_every_checksum_is_right(container, rows, write, tmp_path):
    ros = Ros(1 if container.startswith("bag") else 2)
    data = exported(write(ros, rows(ros), container), calibration_file()).data
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    indexed = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    streamed = NonSeekingReader(io.BytesIO(data), validate_crcs=True)
    assert Counter(indexed) == Counter(
        (channel.topic, message.log_time, message.data) for _, channel, message in streamed.iter_messages()
    )
    assert [one[1] for one in indexed] == sorted(one[1] for one in indexed)
    statistics = reader.get_summary().statistics
    assert statistics.message_count == len(indexed)
    assert Counter(topic for topic, _, _ in indexed) == {
        reader.get_summary().channels[number].topic: count
        for number, count in statistics.channel_message_counts.items()
    }
    assert (statistics.message_start_time, statistics.message_end_time) == (indexed[0][1], indexed[-1][1])
    assert type(list(StreamReader(io.BytesIO(data), validate_crcs=True).records)[-1]).__name__ == "Footer"
    saved = tmp_path / "saved.mcap"
    saved.write_bytes(data)
    if ros.generation == 2:  # rosbags reads no MCAP files of ROS 1
        with AnyReader([saved]) as other:
            assert sum(1 for _ in other.messages()) == len(indexed)


def projected(written, info_topic, point_radar_m):
    """Project a point as viewers do: through the recorded transform and the recorded intrinsics."""
    (joint,) = written.on("/tf_static")[0].decoded.transforms
    assert (joint.header.frame_id, joint.child_frame_id) == ("radar", "camera")
    q, t = joint.transform.rotation, joint.transform.translation
    radar_from_camera = Rotation.from_quat([q.x, q.y, q.z, q.w])
    point_camera_m = radar_from_camera.inv().apply(np.asarray(point_radar_m) - [t.x, t.y, t.z])
    info = written.on(info_topic)[0].decoded
    assert info.header.frame_id == "camera"
    k, d, p = ((getattr(info, name, None) or getattr(info, name.upper())) for name in "kdp")
    np.testing.assert_array_equal(np.reshape(p, (3, 4)), np.hstack([np.reshape(k, (3, 3)), np.zeros((3, 1))]))
    pixel, _ = cv2.projectPoints(point_camera_m[None], np.zeros(3), np.zeros(3), np.reshape(k, (3, 3)), np.array(d))
    return pixel[0, 0]


def test_transform_and_intrinsics_carry_the_check_point_to_its_pixel(ros, rows, write):
    file = calibration_file()
    written = exported(write(ros, without_info(rows(ros))), file)
    pixel_px = projected(written, "/camera/camera_info", file.check_point.radar_m)
    np.testing.assert_allclose(pixel_px, file.check_point.pixel_px, atol=1e-6)


def test_each_frame_has_intrinsics_of_its_stamp(ros, rows, write):
    written = exported(write(ros, without_info(rows(ros))), calibration_file())
    images, infos = written.on("/camera/image/compressed"), written.on("/camera/camera_info")
    assert [str(one.decoded.header.stamp) for one in infos] == [str(one.decoded.header.stamp) for one in images]
    assert [one.log_time for one in infos] == [one.log_time for one in images]
    assert (infos[0].decoded.width, infos[0].decoded.height) == (64, 48)
    if ros.generation == 1:
        assert [one.decoded.header.seq for one in infos] == list(range(len(infos)))


def test_equal_intrinsics_are_not_written_again(ros, rows, write):
    written = exported(write(ros, rows(ros)), calibration_file(RECORDED))
    assert written.said.added.keys() == {"/tf_static"}
    assert "has these intrinsics already" in written.notes


def test_other_intrinsics_keep_their_topic_and_the_calibrations_get_their_own(ros, rows, write):
    file = calibration_file(SEEING)
    written = exported(write(ros, rows(ros)), file)
    assert "has other intrinsics" in written.notes
    recorded = written.on("/camera/camera_info")[0].decoded
    assert (getattr(recorded, "k", None) or recorded.K)[0] == 500.0
    pixel_px = projected(written, "/cocalib/camera_info", file.check_point.radar_m)
    np.testing.assert_allclose(pixel_px, file.check_point.pixel_px, atol=1e-6)
    assert '"calibrationTopic": "/cocalib/camera_info"' in written.said.layout


def test_the_transform_comes_first_and_again_each_second_for_players_that_seek(ros, rows, write):
    written = exported(write(ros, rows(ros, n=45)), calibration_file())
    times = [one.log_time for one in written.on("/tf_static")]
    assert times[0] == min(one.log_time for one in written.messages)
    assert len(times) == 5
    assert all(after - before >= SECOND for before, after in pairwise(times))
    channels = make_reader(io.BytesIO(written.data)).get_summary().channels.values()
    (notes,) = (channel.metadata for channel in channels if channel.topic == "/tf_static")
    assert notes.get("latching") == "1" if ros.generation == 1 else "transient_local" in notes["offered_qos_profiles"]


def test_our_own_reader_takes_the_same_topics_and_reads_the_same(ros, rows, write, tmp_path):
    path = write(ros, rows(ros))
    written = exported(path, calibration_file(radar_errors=RadarErrors(range_bias_m=0.3)))
    assert "/cocalib/radar_points_corrected" in written.said.added
    new = tmp_path / "new.mcap"
    new.write_bytes(written.data)
    with open_recording(path) as before, open_recording(new) as after:
        assert before.radar_topics == after.radar_topics == ("/radar/points",)
        assert (before.image_topic, before.camera_info_topic) == (after.image_topic, after.camera_info_topic)
        for name in ("points_radar_m", "times_ns", "doppler_mps", "snr_db"):
            np.testing.assert_array_equal(getattr(before.radar_scans(), name), getattr(after.radar_scans(), name))
        np.testing.assert_array_equal(before.image_times, after.image_times)
        assert [before.image_bytes(i).data for i in range(20)] == [after.image_bytes(i).data for i in range(20)]
        assert [one.code for one in after.warnings] == [one.code for one in before.warnings]


def test_the_calibration_is_attached_whole_and_described(ros, rows, write):
    file = calibration_file()
    reader = make_reader(io.BytesIO(exported(write(ros, rows(ros)), file).data))
    (attached,) = reader.iter_attachments()
    assert (attached.name, attached.media_type) == ("calibration.json", "application/json")
    assert write_calibration(read_calibration(attached.data.decode())) == write_calibration(file)
    (described,) = (one for one in reader.iter_metadata() if one.name == "cocalib")
    text = "\n".join(described.metadata.values())
    assert "evidence: imported_assumed" in text
    assert "check point: p_radar" in text


def test_an_export_of_an_export_adds_nothing_twice(ros, rows, write, tmp_path):
    file = calibration_file()
    first = tmp_path / "first.mcap"
    first.write_bytes(exported(write(ros, without_info(rows(ros))), file).data)
    again = exported(first, file)
    assert not again.said.added
    assert "camera and radar already" in again.notes


def test_returns_that_viewers_cannot_draw_are_also_a_cloud(rows, write, tmp_path):
    ros = Ros(1)
    kind = ros.define(RADAR_SCAN_TYPE, RADAR_SCAN_DEFINITION)
    rest = {"range": 0.0, "velocity": 0.0, "doppler_bin": 0, "bearing": 0.0, "intensity": 20.0}
    scans = [
        (
            "/radar",
            at + k,
            ros.new(kind, header=ros.header(at, "radar"), point_id=k, x=5.0 + k, y=at % 7 / 10, z=0.2, **rest),
        )
        for at in range(START_NS, START_NS + 2 * SECOND, SECOND // 10)
        for k in range(4)
    ]
    path = write(ros, sorted([row for row in rows(ros) if row[0] != "/radar/points"] + scans, key=lambda row: row[1]))
    written = exported(path, calibration_file(RECORDED))
    assert "cannot draw /radar" in written.notes
    found = written.on("/cocalib/radar_points")
    with open_recording(path) as recording:
        expected = recording.radar_scans()
    assert len(found) == len(expected) == 20
    points = np.concatenate([np.frombuffer(one.decoded.data, "<f4").reshape(-1, 5)[:, :3] for one in found])
    np.testing.assert_allclose(points, expected.points_radar_m, atol=1e-6)
    assert {one.decoded.header.frame_id for one in found} == {"radar"}
    assert "/cocalib/radar_points" in json.loads(written.said.layout)["configById"]["Image!cocalib"]["topics"]


def test_returns_with_the_radars_errors_taken_out_project_as_the_calibration_says(ros, rows, write):
    file = calibration_file(radar_errors=RadarErrors(range_bias_m=0.3, azimuth_scale=0.02))
    written = exported(write(ros, rows(ros)), file)
    raw, corrected = written.on("/radar/points")[3], written.on("/cocalib/radar_points_corrected")[3]
    points_m = np.frombuffer(corrected.decoded.data, "<f4").reshape(-1, 5)[:, :3]
    reported_m = np.frombuffer(raw.decoded.data, "<f4").reshape(-1, 5)[:, :3]
    calibration = file.calibration
    np.testing.assert_allclose(
        calibration.camera.project(calibration.camera_from_radar @ points_m.astype(float)),
        calibration.reproject(reported_m.astype(float)),
        atol=1e-3,
    )


def test_the_layout_holds_only_keys_of_foxglove_and_topics_of_the_file(ros, rows, write):
    written = exported(write(ros, rows(ros)), calibration_file())
    layout = json.loads(written.said.layout)
    image, scene = (layout["configById"][layout["layout"][place]] for place in ("first", "second"))
    topics = {one.topic for one in written.messages}
    shown = (
        image["imageMode"]["imageTopic"],
        image["imageMode"]["calibrationTopic"],
        *image["topics"],
        *scene["topics"],
    )
    assert topics >= set(shown)
    (joint,) = written.on("/tf_static")[0].decoded.transforms
    frames = {joint.header.frame_id, joint.child_frame_id}
    assert {scene["followTf"], *(name.removeprefix("frame:") for name in scene["transforms"])} <= frames
    known = layouts.ImageModeConfig()._to_dict().keys()
    assert image["imageMode"].keys() <= known
    assert image.keys() - {"foxglovePanelTitle"} <= layouts.ImageConfig()._to_dict().keys()
    assert scene.keys() - {"foxglovePanelTitle"} <= layouts.ThreeDeeConfig()._to_dict().keys()
    (points,) = image["topics"].values()
    assert points.keys() <= layouts.BaseRendererPointCloudTopicSettings()._to_dict().keys()


def test_a_calibration_of_other_images_is_refused(ros, rows, write):
    with pytest.raises(InputError, match=r"have 64 x 48 pixels.*camera with 128 x 96"):
        exported(write(ros, rows(ros)), calibration_file(SEEING.scaled(2)))


@pytest.mark.parametrize(
    "container",
    ["bag", "mcap-zstd", *(pytest.param(name, marks=pytest.mark.slow) for name in ("bag-bz2", "mcap"))],
)
def test_of_a_damaged_recording_what_is_left_is_written_and_the_loss_is_said(container, rows, write):
    ros = Ros(1 if container.startswith("bag") else 2)
    path = write(ros, rows(ros, n=60), container)
    whole = {(one.topic, one.log_time, one.data) for one in exported(path, calibration_file(RECORDED)).messages}
    path.write_bytes(path.read_bytes()[:-4000])
    written = exported(path, calibration_file(RECORDED))
    kept = {(one.topic, one.log_time, one.data) for one in written.messages if one.topic not in ADDED}
    assert 0 < len(kept) == written.said.copied <= 180
    assert kept <= whole
    assert "not-closed" in written.notes or "damaged-file" in written.notes


def test_messages_that_cannot_be_read_are_counted(rows, write):
    ros = Ros(2)
    path = write(ros, rows(ros, n=60), "db3")
    altered(path, "UPDATE messages SET data = 'no bytes' WHERE id IN (33, 36, 39, 42)")
    written = exported(path, calibration_file(RECORDED))
    assert sum(written.said.lost.values()) == 4
    assert written.said.copied == 176
    assert "contains no bytes" in written.said.fault


class Sink(io.RawIOBase):
    """Counts what is written, and keeps nothing."""

    def __init__(self):
        self.count = 0

    def writable(self):
        return True

    def write(self, data):
        self.count += len(data)
        return len(data)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_recording(rows, write):
    from calib_core.deployment import write_into_recording

    ros = Ros(2)
    camera = SEEING.scaled(10)
    peaks = []
    for frames in (20, 160):
        image = np.zeros((480, 1920), np.uint8)
        times = range(START_NS, START_NS + frames * SECOND // 10, SECOND // 10)
        some = [("/camera/image_raw", at, ros.image(at, image, "bgr8", width=640)) for at in times]
        clouds = [row for row in rows(ros, n=frames) if row[0] == "/radar/points"]
        path = write(ros, sorted(some + clouds, key=lambda row: row[1]), "mcap", f"long{frames}")
        sink = Sink()
        with open_recording(path) as recording:
            tracemalloc.start()
            write_into_recording(recording, calibration_file(camera), sink, version="0")
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        assert sink.count >= path.stat().st_size
    assert path.stat().st_size > 140e6
    assert peaks[1] < 40e6
    assert peaks[1] < 2 * peaks[0]
