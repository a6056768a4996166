"""Real recordings: every container of the road recording, a lidar cloud with holes, camera formats, raw radar packets."""

from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.radar import cartesian_from_polar
from calib_core.recordings import RecordingOptions, describe, inspect_recording, open_recording

pytestmark = pytest.mark.real

ROAD = (
    "pjlab_radar_camera.bag",
    "pjlab_radar_camera_mcap",
    "pjlab_radar_camera_mcap/pjlab_radar_camera_mcap.mcap",
    "pjlab_radar_camera_db3",
    "pjlab_radar_camera_db3/pjlab_radar_camera_db3.db3",
)


@pytest.fixture
def road(shared_data: Path) -> Path:
    return shared_data / "real_radar_camera_road"


@pytest.mark.parametrize("name", ROAD)
def test_the_road_recording_opens_in_every_container(road, name):
    with open_recording(road / name) as recording:
        scans = recording.radar_scans()
        assert (len(scans), len(recording.image_times)) == (7, 7)
        np.testing.assert_array_equal(recording.radar_times, recording.image_times)
        assert int(recording.radar_times[0]) == 1_604_546_789_558_788_096
        counts = np.diff(scans.first_return)
        assert (counts.min(), counts.max(), counts.sum()) == (81, 83, 575)
        np.testing.assert_allclose(scans.points_radar_m[:2], [[206.6, 0.8, 0.0], [46.6, -4.6, 0.0]], rtol=1e-6)
        assert np.isfinite(scans.doppler_mps).all()
        frame = recording.image_bytes(3)
        assert (frame.format, frame.width_px, frame.height_px) == ("jpeg", 1920, 1200)
        assert recording.image(3).shape == (1200, 1920, 3)
        camera = recording.camera()
        assert camera.model == "plumb_bob"
        np.testing.assert_allclose(camera.matrix_px, [[2117.87, 0, 950.144], [0, 2121.65, 588.036], [0, 0, 1]])
        assert [warning.code for warning in recording.warnings] == ["flat-radar"]


@pytest.mark.parametrize("name", ROAD)
def test_the_readers_agree_with_rosbags_message_by_message(road, name):
    from rosbags.highlevel import AnyReader

    path = road / name
    with (
        open_recording(path) as recording,
        AnyReader([path if path.suffix == ".bag" else path.parent / path.name]) as reader,
    ):
        images = [c for c in reader.connections if c.topic == recording.image_topic]
        for index, (connection, _, raw) in enumerate(reader.messages(images)):
            message = reader.deserialize(raw, connection.msgtype)
            assert recording.image_bytes(index).data == message.data.tobytes()
        clouds = [c for c in reader.connections if c.topic == recording.radar_topic]
        scans = recording.radar_scans()
        for index, (connection, _, raw) in enumerate(reader.messages(clouds)):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec * NS_PER_S + message.header.stamp.nanosec
            assert stamp == scans.times_ns[index]
            table = message.data.reshape(message.width, message.point_step)[:, :12].copy().view("<f4")
            np.testing.assert_array_equal(scans.scan(index).points_radar_m, table)


def test_the_folder_of_all_three_copies_is_one_recording_and_says_so(road):
    with open_recording(road) as recording:
        assert len(recording.radar_times) == len(recording.image_times) == 7
        assert "repeated-messages" in [warning.code for warning in recording.warnings]


def test_a_lidar_cloud_with_holes_and_mixed_types_is_read(shared_data):
    with inspect_recording(shared_data / "real_pointcloud2" / "test.bag") as recording:
        scans = recording.radar_scans()
        assert len(scans.points_radar_m) == 180_822
        assert np.isfinite(scans.points_radar_m).all()
        assert np.abs(scans.points_radar_m).max() < 300
        assert recording.radar_frame == "luminar_lidar"
        # stamps of March 2020 in a bag received in November: the stamps are used
        assert int(scans.times_ns[0]) == 1_583_971_570_015_299_642
        assert [warning.code for warning in recording.warnings] == ["looks-like-lidar"]
        assert "looks like a lidar" in describe(recording)


def test_raw_camera_images_go_by_their_stamps_of_another_year(shared_data):
    with open_recording(shared_data / "real_camera_formats" / "raw.bag", require=("image",)) as recording:
        assert int(recording.image_times[0]) == 1_648_052_479_616_566_426
        assert recording.image(0).shape == (480, 640, 3)
        frame = recording.image_bytes(0)
        assert (frame.format, frame.width_px, frame.height_px) == ("jpeg", 640, 480)
        assert recording.warnings == ()


@pytest.mark.parametrize(
    ("name", "topic", "words"),
    [
        ("compressed.bag", "/spot/camera/hand_color/image/qoi", "the encoding 'qoi' is not supported"),
        ("compressedDepth.bag", "/spot/depth/frontleft/image/compressedDepth", "is a depth image, not an image"),
    ],
)
def test_unsupported_data_is_refused_with_a_clear_error(shared_data, name, topic, words):
    path = shared_data / "real_camera_formats" / name
    with pytest.raises(RecordingError, match=words) as caught:
        open_recording(path, RecordingOptions(image_topic=topic), require=("image",))
    assert topic in str(caught.value)
    with pytest.raises(RecordingError, match="no readable camera image topic"):
        open_recording(path, require=("image",))


@pytest.mark.parametrize("name", ["ars548/1708578204", "srr520/1708578209"])
def test_raw_packets_of_a_radar_are_listed_with_the_reason_they_are_not_read(shared_data, name):
    inside = "src/nebula_continental/nebula_continental/test_resources/decoder_ground_truth"
    with inspect_recording(shared_data / "real_radar_packets" / inside / name) as recording:
        (topic,) = recording.topics
        assert topic.type == "nebula_msgs/msg/NebulaPackets"
        assert "raw sensor packets" in str(topic.problem)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "folder", "file"),
    [
        ("ContinentalArs548Detection", "ars548", "1708578204_202447652_detection.yaml"),
        ("ContinentalSrr520Detection", "srr520", "1708578209_76111685_hrr_detection.yaml"),
        ("ContinentalSrr520Detection", "srr520", "1708578209_45566935_near_detection.yaml"),
    ],
)
def test_real_detection_lists_of_two_radars_become_scans(shared_data, tmp_path, kind, folder, file):
    """Detections decoded by the driver's authors, with the driver's own message definitions, written to a bag."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    from ruamel.yaml import YAML

    home = shared_data / "real_radar_packets" / "src" / "nebula_continental"
    values = YAML(typ="safe", pure=True).load(
        home / "nebula_continental" / "test_resources" / "decoder_ground_truth" / folder / file
    )
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name in (kind, f"{kind}List"):
        text = (home / "continental_msgs" / "msg" / f"{name}.msg").read_text()
        store.register(get_types_from_msg(text, f"continental_msgs/msg/{name}"))
    detection = store.types[f"continental_msgs/msg/{kind}"]
    rows = values["detections"]
    stamp = store.types["builtin_interfaces/msg/Time"](**values["header"]["stamp"])
    fields = {**values, "detections": [detection(**row) for row in rows]}
    fields["header"] = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="radar")
    if "origin_pos" in fields:
        fields["origin_pos"] = store.types["geometry_msgs/msg/Point"](**fields["origin_pos"])
    list_type = f"continental_msgs/msg/{kind}List"
    message = store.types[list_type](**fields)
    with Writer(tmp_path / "bag", version=9) as writer:
        connection = writer.add_connection("/radar/detections", list_type, typestore=store)
        writer.write(connection, 1_708_578_209 * NS_PER_S, store.serialize_cdr(message, list_type))
    with open_recording(tmp_path / "bag", require=("radar",)) as recording:
        scan = recording.radar_scans().scan(0)
    assert len(scan) == len(rows) > 30

    def column(name: str) -> np.ndarray:
        return np.array([row.get(name, 0.0) for row in rows], dtype=np.float32).astype(np.float64)

    polar = np.stack([column("range"), column("azimuth_angle"), column("elevation_angle")], axis=1)
    valid = ~np.array([row.get("invalid_azimuth", False) or row.get("invalid_elevation", False) for row in rows])
    np.testing.assert_allclose(scan.points_radar_m[valid], cartesian_from_polar(polar)[valid])
    np.testing.assert_array_equal(scan.doppler_mps, column("range_rate"))
    np.testing.assert_array_equal(scan.snr_db, column("snr" if "snr" in rows[0] else "rcs"))
    if "range_std" in rows[0]:
        sigma = [column("range_std"), column("azimuth_angle_std"), column("elevation_angle_std")]
        np.testing.assert_array_equal(scan.sigma_polar, np.stack(sigma, axis=1))
