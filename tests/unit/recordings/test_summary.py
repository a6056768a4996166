"""The time for which radar and camera both have data."""

import json

import cv2
import msgspec
import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingSummary, describe, inspect_recording, recording_summary
from calib_core.recordings.summary import shared_time


def at(*parts):
    """Return stamps at 10 Hz in parts of (begin, length) [s]."""
    steps = [np.arange(round(length * 10) + 1) * 10**8 + round(begin * NS_PER_S) for begin, length in parts]
    return np.concatenate(steps).astype(np.int64)


@pytest.mark.parametrize(
    ("radar", "camera", "seconds", "stretches"),
    [
        (at((0, 10)), at((2, 20)), 8.0, 1),
        (at((0, 40), (4040, 40)), at((0, 40), (4040, 40)), 80.0, 2),
        (at((0, 4000)), at((0, 40), (3000, 40)), 80.0, 2),
        (at((0, 10)), at((20, 10)), 0.0, 0),
        (at((0, 10)), at((0, 4), (4.8, 5.2)), 9.2, 1),
        (at((0, 0)), at((0, 5)), 0.0, 1),
        (at((0, 5)), np.zeros(0, dtype=np.int64), 0.0, 0),
        (np.zeros(3, dtype=np.int64), np.zeros(2, dtype=np.int64), 0.0, 1),
    ],
    ids=["overlap", "pauses of both", "pauses of one", "apart", "a dropout", "one scan", "no camera", "equal times"],
)
def test_the_time_of_both_leaves_out_pauses(radar, camera, seconds, stretches):
    for a, b in ((radar, camera), (camera, radar)):
        found = shared_time(a, b)
        assert found.seconds == pytest.approx(seconds)
        assert found.stretches == stretches


def test_a_pause_of_an_hour_is_not_counted_as_data_of_both(ros1, write, plain, jpeg):
    rows = plain(ros1, jpeg, n=20)
    late = plain(ros1, jpeg, n=20, radar_shift_ns=3600 * NS_PER_S, camera_shift_ns=3600 * NS_PER_S)
    later = [(topic, time + 3600 * NS_PER_S, message) for topic, time, message in late]
    with inspect_recording(write(ros1, [*rows, *later])) as recording:
        text = describe(recording)
    assert "3.7 s, in 2" in text


def test_sensors_that_never_have_data_together_are_told(ros1, write, plain, jpeg):
    rows = plain(ros1, jpeg, n=20, radar_shift_ns=-9 * NS_PER_S)
    rows = [(topic, time - (9 * NS_PER_S if "radar" in topic else 0), message) for topic, time, message in rows]
    with inspect_recording(write(ros1, rows)) as recording:
        assert "never have data" in describe(recording)


# The text that `cocalib info` prints.


START_NS = 1_700_000_000 * NS_PER_S


def test_the_text_names_files_times_topics_radar_camera_and_warnings(ros1, write, plain, jpeg, cloud_points):
    rows = plain(ros1, jpeg)
    points = cloud_points(4)
    points["z"] = 0
    rows = [(t, at, ros1.cloud(at, points) if "radar" in t else message) for t, at, message in rows]
    path = write(ros1, [*rows, ("/odd", START_NS, ros1.new("std_msgs/msg/String", data="hello"))], "bag-lz4")
    with inspect_recording(path) as recording:
        text = describe(recording)
    size = f"{path.stat().st_size / 1000:.1f} kB"
    assert (
        text
        == f"""\
files     recording.bag  {size}  ROS 1 bag, lz4
time      2023-11-14 22:13:20.030 UTC to 2023-11-14 22:13:21.950 UTC, 1.9 s
          1700000000.030 to 1700000001.950 s since 1970
          61 messages in 4 topics
          radar and camera both have data for 1.9 s

used as     topic                     type                         messages     rate  longest gap  jitter  times used
intrinsics  /camera/camera_info       sensor_msgs/CameraInfo             20  10.0 Hz      0.100 s  0.0 ms
camera      /camera/image/compressed  sensor_msgs/CompressedImage        20  10.0 Hz      0.100 s  0.0 ms  stamps
            /odd                      std_msgs/String                     1
radar       /radar/points             sensor_msgs/PointCloud2            20  10.0 Hz      0.100 s  0.0 ms  stamps

clocks    /camera/image/compressed: times are header stamps, because the stamps are sound
            the recorder received each message 30.0 ms after its stamp (± 0.0 ms)
          /radar/points: times are header stamps, because the stamps are sound
            the recorder's receive times are equal to the stamps
radar     /radar/points, frame 'radar': 20 scans at 10.0 Hz, longest gap 0.100 s
          returns per scan: 4 (4 to 4)
          position from x, y, z (forward, left, up); speed from velocity; amplitude from snr
camera    /camera/image/compressed, frame 'camera': 20 images at 10.0 Hz, longest gap 0.100 s
          64 x 48 px, jpeg
          plumb_bob from /camera/camera_info: fx 500.00 fy 510.00 cx 319.50 cy 239.50 px; \
distortion -0.1, 0.02, 0.001, -0.002, 0.003

warning   /radar/points has the same height (0 m) for every return: it measures no elevation.
          put the reflector's center at the radar's height at every placement, and measure the camera position. [flat-radar]"""
    )


@pytest.mark.parametrize("part", ["radar", "camera", "nothing"])
def test_an_incomplete_recording_is_described(part, ros, write, plain, jpeg):
    rows = [row for row in plain(ros, jpeg) if part in row[0]]
    with inspect_recording(write(ros, rows)) as recording:
        text = describe(recording)
        summary = recording_summary(recording)
    assert ("radar     no readable topic" in text) == (part != "radar")
    assert ("camera    no readable topic" in text) == (part != "camera")
    assert (summary.radar is None, summary.camera is None) == (part != "radar", part != "camera")
    assert summary.overlap_s is None
    assert ("no messages" in text) == (part == "nothing")


def test_the_summary_survives_json(ros, write, plain, jpeg):
    with inspect_recording(write(ros, plain(ros, jpeg))) as recording:
        summary = recording_summary(recording)
    data = msgspec.json.encode(summary)
    assert msgspec.json.decode(data, type=RecordingSummary) == summary
    plain_values = json.loads(data)
    assert plain_values["start"] == {"sec": 1_700_000_000, "nanosec": 0}
    assert plain_values["radar"]["returns_per_scan"] == [3, 4.0, 5]
    assert plain_values["camera"]["matrix_px"][0][0] == 500.0


@pytest.mark.parametrize("encoding", ["bgr8", "bayer_rggb8", "mono8"])
def test_raw_pixels_are_described_by_their_encoding(ros, write, encoding):
    pixels = np.zeros((48, 64 * (3 if encoding == "bgr8" else 1)), dtype=np.uint8)
    message = ros.image(START_NS, pixels, encoding, width=64)
    with inspect_recording(write(ros, [("/camera/image_raw", START_NS, message)])) as recording:
        assert f"48 px, raw {encoding}" in describe(recording)


def test_a_png_is_described_as_png_whatever_its_message_says(ros, write):
    png = cv2.imencode(".png", np.zeros((48, 64, 3), np.uint8))[1].tobytes()
    with inspect_recording(write(ros, [("/camera/image", START_NS, ros.compressed(START_NS, png))])) as recording:
        assert "48 px, png" in describe(recording)


def test_what_cannot_be_read_is_explained(ros1, write):
    message = ros1.compressed(START_NS, b"qoif" + bytes(30), "qoi")
    with inspect_recording(write(ros1, [("/camera/qoi", START_NS, message)])) as recording:
        assert "/camera/qoi: the encoding 'qoi'" in describe(recording)
