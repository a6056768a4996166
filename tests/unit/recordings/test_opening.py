"""Every container opens, gives the same values, and fails with a clear error."""

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import RecordingOptions, inspect_recording, open_recording
from calib_core.recordings.recording_file import recording_file_of

START_NS = 1_700_000_000 * NS_PER_S


def test_every_container_gives_the_same_scans_frames_and_camera(container, container_ros, write, plain, jpeg):
    path = write(container_ros, plain(container_ros, jpeg), container)
    with open_recording(path) as recording:
        assert (recording.radar_topic, recording.image_topic) == ("/radar/points", "/camera/image/compressed")
        assert recording.camera_info_topic == "/camera/camera_info"
        assert (recording.radar_frame, recording.camera_frame) == ("radar", "camera")
        np.testing.assert_array_equal(recording.radar_times, START_NS + np.arange(20) * 100_000_000)
        np.testing.assert_array_equal(recording.image_times, recording.radar_times + 50_000_000)
        scans = recording.radar_scans()
        np.testing.assert_array_equal(np.diff(scans.first_return), 3 + np.arange(20) % 3)
        np.testing.assert_allclose(scans.scan(7).points_radar_m[2], [12.0, -1.5, 0.5])
        np.testing.assert_allclose(scans.scan(7).doppler_mps, [0.0, 0.1, 0.2, 0.3][:4], atol=1e-7)
        np.testing.assert_allclose(scans.scan(7).snr_db, [10, 11, 12, 13])
        assert np.isnan(scans.sigma_polar).all()
        frame = recording.image_bytes(13)
        assert (frame.data, frame.format, frame.width_px, frame.height_px) == (jpeg, "jpeg", 64, 48)
        assert recording.image(13).shape == (48, 64, 3)
        camera = recording.camera()
        assert (camera.model, camera.matrix_px[0, 0]) == ("plumb_bob", 500.0)
        assert recording.warnings == ()


def test_a_folder_a_data_file_and_a_wrong_suffix_open_alike(ros2, write, plain, jpeg, tmp_path):
    file = write(ros2, plain(ros2, jpeg), "db3")
    lying = shutil.copy(file, tmp_path / "surprise.bag")
    above = tmp_path / "above"
    shutil.copytree(file.parent, above / "inside")
    for path in (file, file.parent, lying, above):
        with open_recording(path) as recording:
            assert len(recording.image_times) == 20


def test_two_files_of_different_formats_are_one_recording(ros1, ros2, write, plain, jpeg):
    radar = write(ros1, [row for row in plain(ros1, jpeg) if "radar" in row[0]], "bag-lz4", "radar")
    camera = write(ros2, [row for row in plain(ros2, jpeg) if "camera" in row[0]], "mcap", "camera")
    with open_recording([radar, camera]) as recording:
        assert len(recording.radar_times) == len(recording.image_times) == 20
        assert recording.name == "radar.bag + camera.mcap"


def test_a_topic_split_over_files_is_joined_in_order_of_time(ros1, write, plain, jpeg):
    rows = plain(ros1, jpeg)
    late = write(ros1, rows[30:], name="late")
    early = write(ros1, rows[:30], name="early")
    with open_recording([late, early]) as recording:
        np.testing.assert_array_equal(recording.radar_times, START_NS + np.arange(20) * 100_000_000)
        assert len(recording.radar_scans()) == 20
        assert recording.image_bytes(19).data == jpeg


def test_the_same_messages_in_two_files_are_used_once_with_a_warning(ros1, ros2, write, plain, jpeg):
    paths = [write(ros1, plain(ros1, jpeg)), write(ros2, plain(ros2, jpeg))]
    with open_recording(paths) as recording:
        assert len(recording.radar_times) == 20
        assert [warning.code for warning in recording.warnings] == ["repeated-messages"]
        assert recording.warnings[0].facts["message"].startswith("60 messages of /camera/camera_info")


def test_a_window_holds_exactly_the_scans_within_it(ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg, n=200))
    with open_recording(path) as recording:
        whole = recording.radar_scans()
        low, high = START_NS + 5 * NS_PER_S, START_NS + 8 * NS_PER_S
        part = recording.radar_scans(TimeNs(low), TimeNs(high))
        expected = whole.between(TimeNs(low), TimeNs(high))
        np.testing.assert_array_equal(part.times_ns, expected.times_ns)
        np.testing.assert_array_equal(part.points_radar_m, expected.points_radar_m)
        times = [TimeNs(START_NS + s * NS_PER_S // 10) for s in (50, 52, 150, 10_000, -10_000)]
        around = recording.radar_scans_around(times, 0.3)
        chosen = [t for t in whole.times_ns.tolist() if any(abs(t - time) <= 300_000_000 for time in times)]
        assert around.times_ns.tolist() == chosen
        assert len(recording.radar_scans_around([], 1.0)) == 0


def test_frames_outside_the_recording_and_closed_recordings_are_refused(ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg))
    with open_recording(path) as recording:
        for index in (-1, 20):
            with pytest.raises(IndexError, match="of 20"):
                recording.image_bytes(index)
    with pytest.raises(RecordingError, match="closed"):
        recording.image_bytes(0)
    with pytest.raises(RecordingError, match="closed"):
        recording.radar_scans()


def test_the_fingerprint_is_the_files_sha256(ros1, write, plain, jpeg):
    import hashlib

    path = write(ros1, plain(ros1, jpeg))
    seen = []
    with open_recording(path) as recording:
        (file,) = recording.fingerprint(lambda done, total: seen.append((done, total)))
    assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert (file.name, file.size_bytes) == (path.name, path.stat().st_size)
    assert seen[-1] == (path.stat().st_size, path.stat().st_size)


def test_reading_from_many_threads_gives_every_frame_its_own_bytes(container, container_ros, write):
    from concurrent.futures import ThreadPoolExecutor

    import cv2

    rows, files = [], []
    for i in range(40):
        image = np.full((16, 16, 3), 6 * i, dtype=np.uint8)
        files.append(cv2.imencode(".png", image)[1].tobytes())
        at = START_NS + i * 100_000_000
        rows.append(("/camera/image", at, container_ros.compressed(at, files[-1], "png")))
    path = write(container_ros, rows, container)
    with open_recording(path, require=("image",)) as recording, ThreadPoolExecutor(4) as pool:
        order = np.random.default_rng(1).integers(0, 40, 300).tolist()
        for index, frame in zip(order, pool.map(recording.image_bytes, order), strict=True):
            assert frame.data == files[index]


# -- refusals


def refusal(paths, options=None) -> str:
    with pytest.raises(RecordingError) as caught:
        open_recording(paths, options)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_missing_file_is_named(tmp_path):
    assert refusal(tmp_path / "gone.bag").startswith(f"{tmp_path / 'gone.bag'}: no such file")
    assert "no recording given" in refusal([])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"hello world, I am text", "not a recording (it begins with 'hello wo')"),
        (b"\x28\xb5\x2f\xfd" + bytes(20), "the Zstandard-compressed file cannot be decompressed"),
        (b"PK\x03\x04" + bytes(20), "zip"),
    ],
)
def test_a_file_that_is_not_a_recording_is_identified(tmp_path, content, words):
    path = tmp_path / "what.bag"
    path.write_bytes(content)
    assert words in refusal(path)


def test_an_empty_folder_is_refused(tmp_path):
    folder = tmp_path / "nothing"
    folder.mkdir()
    assert "contains no recording" in refusal(folder)


def test_a_recording_without_messages_is_refused_but_can_be_inspected(container, container_ros, write):
    path = write(container_ros, [], container)
    assert "contains no messages" in refusal(path)
    with inspect_recording(path) as recording:
        assert recording.topics == ()


def test_a_recording_without_radar_or_camera_names_what_there_is(ros, write, plain, jpeg):
    radar = write(ros, [row for row in plain(ros, jpeg) if "radar" in row[0]], name="radar")
    text = refusal(radar)
    assert "topics: /radar/points (sensor_msgs/" in text
    assert "--image-topic" in text
    camera = write(ros, [row for row in plain(ros, jpeg) if "camera" in row[0]], name="camera")
    assert "no readable radar topic" in refusal(camera)
    with inspect_recording(radar) as recording:
        assert recording.image_topic is None
        assert len(recording.image_times) == 0
        assert len(recording.radar_scans()) == 20
    with inspect_recording(camera) as recording:
        assert len(recording.radar_scans()) == len(recording.radar_times) == 0
        assert len(recording.radar_scans_around([TimeNs(START_NS)], 1.0)) == 0


def test_a_wrong_choice_of_topic_names_the_right_ones(ros, write, plain, jpeg):
    path = write(ros, plain(ros, jpeg))
    text = refusal(path, RecordingOptions(radar_topic="/radar/point"))
    assert "/radar/point; radar topics: /radar/points" in text
    text = refusal(path, RecordingOptions(image_topic="/radar/points"))
    assert "image topics: /camera/image/compressed" in text
    text = refusal(path, RecordingOptions(camera_info_topic="/nope"))
    assert "camera info topics: /camera/camera_info" in text


def test_sensors_that_do_not_overlap_in_time_are_refused_with_both_intervals(ros, write, plain, jpeg):
    rows = plain(ros, jpeg)
    day_ns = 86_400 * NS_PER_S
    radar = write(ros, [row for row in rows if "radar" in row[0]], name="radar")
    later = [(t, at + day_ns, m) for t, at, m in plain(ros, jpeg, camera_shift_ns=day_ns) if "camera" in t]
    camera = write(ros, later, name="camera")
    text = refusal([radar, camera])
    assert "/radar/points (2023-11-14 22:13:20.000 UTC" in text
    assert "/camera/image/compressed (2023-11-15 22:13:20.050 UTC" in text
    assert "86398.1 s apart" in text
    with inspect_recording([radar, camera]) as recording:
        assert [warning.code for warning in recording.warnings] == ["no-overlap"]


def test_recordings_whole_hours_apart_are_brought_together_by_the_radars_lateness(ros, write, plain, jpeg):
    hours_ns = 3 * 3600 * NS_PER_S
    radar = write(ros, [row for row in plain(ros, jpeg) if "radar" in row[0]], name="radar")
    later = [(t, at + hours_ns, m) for t, at, m in plain(ros, jpeg, camera_shift_ns=hours_ns) if "camera" in t]
    camera = write(ros, later, name="camera")
    assert "--radar-late -10800" in refusal([radar, camera])
    with open_recording([radar], require=("radar",)) as recording:
        stamps = recording.radar_times
    with open_recording([radar, camera], RecordingOptions(radar_late=-10800.0)) as recording:
        np.testing.assert_array_equal(recording.radar_times, stamps + hours_ns)
        assert "--radar-late -10800" in recording.radar_notes[0]
    recording_file_of(radar).write_text("radar_late = -10800\n")
    with open_recording([radar, camera]) as recording:
        np.testing.assert_array_equal(recording.radar_times, stamps + hours_ns)
    with pytest.raises(RecordingError, match="--radar-late nan"):
        open_recording([radar, camera], RecordingOptions(radar_late=float("nan")))


def test_a_damaged_definition_of_another_topic_does_no_harm(ros1, write, plain, jpeg):
    ros1.define("odd_msgs/msg/Odd", "Header header\nfloat32 value\n")
    odd = ros1.new("odd_msgs/msg/Odd", header=ros1.header(START_NS), value=1.0)
    path = write(ros1, [*plain(ros1, jpeg), ("/odd", START_NS, odd)])
    raw = path.read_bytes()
    assert raw.count(b"float32 value") == 2
    path.write_bytes(raw.replace(b"float32 value", b"float32 $alue"))
    with open_recording(path) as recording:
        (topic,) = [topic for topic in recording.topics if topic.name == "/odd"]
        assert topic.problem is not None
        assert "'float32 $alue'" in topic.problem
        assert len(recording.radar_scans()) == 20


def test_a_damaged_message_of_another_topic_does_no_harm(ros, write, plain, jpeg):
    ros.define("log_msgs/msg/Line", "Header header\nstring text\nfloat32 level\n")
    line = ros.new("log_msgs/msg/Line", header=ros.header(START_NS), text="all is well", level=1.0)
    path = write(ros, [*plain(ros, jpeg), ("/log", START_NS, line)], "bag" if ros.generation == 1 else "db3")
    raw = path.read_bytes()
    length = struct.pack("<I", len("all is well") + ros.generation - 1)
    place = raw.index(length + b"all is well")
    path.write_bytes(raw[:place] + b"\xff\xff\xff\x7f" + raw[place + 4 :])
    with open_recording(path) as recording:
        (topic,) = [topic for topic in recording.topics if topic.name == "/log"]
        assert topic.problem is not None
        assert "string of 2147483647 characters" in topic.problem
        assert len(recording.radar_scans()) == 20


def test_paths_may_be_text(ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg))
    with open_recording(str(path)) as recording:
        assert recording.paths == (Path(path),)
