"""Radar messages of many drivers become scans."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.radar.message_layouts.single_returns import first_of_scans

START_NS = 1_700_000_000 * NS_PER_S

TI_SCAN = """\
Header header
uint16 point_id
float32 x
float32 y
float32 z
float32 range
float32 velocity
uint16 doppler_bin
float32 bearing
float32 intensity
"""
TI_FORK = """\
Header header
uint16 radar_frame_idx
uint16 point_id
float32 x
float32 y
float32 z
float32 range
float32 velocity
uint16 doppler_bin
float32 bearing
float32 intensity
float32 intensity_snr_noise
float32 noise
string time_human
"""


def opened(write, ros, messages, *, topic="/radar", step_ns=100_000_000, **options):
    rows = [(topic, START_NS + i * step_ns, message) for i, message in enumerate(messages)]
    return open_recording(write(ros, rows), RecordingOptions(**options), require=("radar",))


# -- clouds


def test_clouds_whose_layout_changes_are_each_read_by_their_own(ros, write, cloud_points):
    wide = cloud_points(5)
    narrow = wide[["x", "y", "z"]].astype([("x", "<f8"), ("y", "<f8"), ("z", "<f8")])
    empty = cloud_points(0)
    messages = [ros.cloud(START_NS + i * 10**8, [wide, narrow, empty][i % 3]) for i in range(9)]
    with opened(write, ros, messages) as recording:
        scans = recording.radar_scans()
    np.testing.assert_array_equal(np.diff(scans.first_return), [5, 5, 0] * 3)
    for number in (0, 1, 3, 4, 6, 7):
        np.testing.assert_array_equal(scans.scan(number).points_radar_m[:, 0], wide["x"])
    assert np.isnan(scans.scan(4).doppler_mps).all()
    np.testing.assert_array_equal(scans.scan(6).doppler_mps, wide["velocity"])


def test_returns_that_are_not_numbers_keep_their_row(ros, write, cloud_points):
    points = cloud_points(3)
    points["x"][1] = np.nan
    with opened(write, ros, [ros.cloud(START_NS, points)]) as recording:
        scan = recording.radar_scans().scan(0)
    assert np.isnan(scan.points_radar_m).tolist() == [[False] * 3, [True] * 3, [False] * 3]
    np.testing.assert_array_equal(scan.snr_db, points["snr"])


@pytest.mark.parametrize("fault", ["width", "nan"])
def test_returns_that_a_cloud_loses_are_counted_and_told(ros, write, cloud_points, fault):
    """A cloud that states too few points, and one whose positions are no numbers; the other clouds are sound."""
    points = cloud_points(10)
    broken = points.copy()
    if fault == "nan":
        broken["y"][6:] = np.nan
    bad = ros.cloud(START_NS + 10**8, broken)
    if fault == "width":
        bad.width = 6
    messages = [ros.cloud(START_NS, points), bad, *(ros.cloud(START_NS + i * 10**8, points) for i in range(2, 20))]
    with opened(write, ros, messages) as recording:
        scans = recording.radar_scans()
        everywhere = recording.losses()
        near = recording.losses([TimeNs(START_NS + 3 * 10**7)], 0.1)
        elsewhere = recording.losses([TimeNs(START_NS + 10**9)], 0.3)
        (warning,) = recording.warnings
    assert np.diff(scans.first_return).tolist() == [10] * 20
    assert np.isfinite(scans.points_radar_m).all(axis=1).sum() == 196
    assert (everywhere.lost, everywhere.read) == (4, 200)
    assert (near.lost, near.read) == (4, 20)
    assert (elsewhere.lost, elsewhere.read) == (0, 70)
    assert warning.code == "lost-returns"
    assert (warning.facts["lost"], warning.facts["read"]) == (4, 200)


def test_positions_that_are_none_mark_invalid_returns_in_a_cloud_that_is_not_dense(ros, write, cloud_points):
    holes, nothing = cloud_points(10), cloud_points(10)
    holes["x"][3:], nothing["x"] = np.nan, np.nan
    messages = [ros.cloud(START_NS + i * 10**8, nothing if i == 5 else holes) for i in range(20)]
    for message in messages:
        message.is_dense = False
    with opened(write, ros, messages) as recording:
        recording.radar_scans()
        at_once = recording.losses().lost
    rows = [("/radar", START_NS + i * 10**8, messages[i]) for i in (4, 5)]
    with open_recording(write(ros, rows, name="few"), require=("radar",)) as recording:
        for time in recording.radar_times.tolist():
            recording.radar_scans(TimeNs(time), TimeNs(time))
        one_by_one = recording.losses().lost
    assert at_once == one_by_one == 10, "only the cloud without any valid return is lost"


def test_zeros_behind_the_points_of_a_cloud_are_no_lost_returns(ros, write, cloud_points):
    padded = ros.cloud(START_NS, np.concatenate([cloud_points(5), np.zeros(3, cloud_points(1).dtype)]))
    padded.width = 5
    with opened(write, ros, [padded]) as recording:
        assert np.diff(recording.radar_scans().first_return).tolist() == [5]
        assert recording.losses().lost == 0
        assert recording.warnings == ()


def test_a_polar_cloud_with_its_own_noise_is_converted(ros, write):
    names = ("azimuth", "azimuth_std", "elevation", "elevation_std", "range", "range_std", "range_rate", "rcs")
    points = np.zeros(5, dtype=[(name, "<f4") for name in names])
    rng = np.random.default_rng(5)
    for name in names:
        points[name] = rng.uniform(0.1, 0.9, 5)
    with opened(write, ros, [ros.cloud(START_NS, points)]) as recording:
        scan = recording.radar_scans().scan(0)
    polar = np.stack([points["range"], points["azimuth"], points["elevation"]], axis=1).astype(np.float64)
    np.testing.assert_allclose(scan.points_radar_m, cartesian_from_polar(polar))
    np.testing.assert_array_equal(
        scan.sigma_polar, np.stack([points["range_std"], points["azimuth_std"], points["elevation_std"]], axis=1)
    )
    np.testing.assert_array_equal(scan.doppler_mps, points["range_rate"])


def test_an_inconsistent_cloud_counts_as_empty_with_a_warning(ros, write, cloud_points):
    good, bad = ros.cloud(START_NS, cloud_points()), ros.cloud(START_NS + 10**8, cloud_points())
    bad.width = 1000
    with opened(write, ros, [good, bad, good]) as recording:
        scans = recording.radar_scans()
        assert np.diff(scans.first_return).tolist() == [3, 3, 0]
        (warning,) = recording.warnings
        assert warning.code == "unreadable-messages"
        assert "is number 1" in warning.facts["message"]


# -- lists


def test_a_list_of_poses_is_not_a_radar(ros, write, plain, jpeg):
    pose = ros.new(
        "geometry_msgs/msg/Pose",
        position=ros.new("geometry_msgs/msg/Point", x=1.0, y=2.0, z=3.0),
        orientation=ros.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    path_message = ros.new("geometry_msgs/msg/PoseArray", header=ros.header(START_NS), poses=[pose])
    with open_recording(write(ros, [*plain(ros, jpeg), ("/radar/poses", START_NS, path_message)])) as recording:
        kinds = {topic.name: topic.kind for topic in recording.topics}
        assert kinds["/radar/poses"] == "other"
        assert recording.radar_topic == "/radar/points"


# -- one return per message


def ti_messages(ros, text: str, counts: list[int], **extra: Any) -> tuple[list[tuple[str, int, Any]], np.ndarray]:
    kind = ros.define("ti_mmwave_rospkg/msg/RadarScan", text)
    rng = np.random.default_rng(8)
    rows, positions = [], []
    for scan, count in enumerate(counts):
        at = START_NS + scan * 100_000_000
        for point in range(count):
            position = rng.uniform(0.5, 9.0, 3).astype(np.float32)
            fields: dict[str, Any] = {
                "point_id": point, "x": position[0], "y": position[1], "z": position[2], "range": 0.0,
                "velocity": 0.25 * scan, "doppler_bin": 3, "bearing": 0.0, "intensity": 0.0,
            }  # fmt: skip
            for name, value in extra.items():
                fields[name] = value(scan) if callable(value) else value
            stamp = at + 200_000 * point
            message = ros.new(kind, header=ros.header(stamp, "/ti_mmwave"), **fields)
            rows.append(("/ti_mmwave/radar_scan", stamp + 4_000_000, message))
            positions.append(position)
    return rows, np.array(positions, dtype=np.float64)


def test_one_message_per_return_becomes_scans_by_the_point_number(container, container_ros, write):
    counts = [3, 1, 5, 2, 1, 1, 7, 4]
    rows, positions = ti_messages(container_ros, TI_SCAN, counts)
    with open_recording(write(container_ros, rows, container), require=("radar",)) as recording:
        scans = recording.radar_scans()
        assert np.diff(scans.first_return).tolist() == counts
        np.testing.assert_array_equal(scans.times_ns, START_NS + 10**8 * np.arange(len(counts)))
        np.testing.assert_array_equal(scans.points_radar_m, positions)
        np.testing.assert_array_equal(scans.doppler_mps, np.repeat(0.25 * np.arange(8), counts))
        assert np.isnan(scans.snr_db).all()  # the stock driver leaves 0
        assert recording.radar_frame == "ti_mmwave"


def test_the_fork_with_frame_numbers_is_grouped_by_them_and_its_snr_is_tenths_of_a_db(ros, write):
    counts = [2, 3, 1, 4]
    extra: dict[str, Any] = {"radar_frame_idx": lambda scan: 65534 + scan & 0xFFFF, "intensity": 153.0}
    extra |= {"intensity_snr_noise": 1.0, "noise": 2.0, "time_human": "2024-01-01"}
    rows, positions = ti_messages(ros, TI_FORK, counts, **extra)
    with open_recording(write(ros, rows), require=("radar",)) as recording:
        scans = recording.radar_scans()
    assert np.diff(scans.first_return).tolist() == counts
    np.testing.assert_array_equal(scans.points_radar_m, positions)
    np.testing.assert_allclose(scans.snr_db, 15.3)


def test_the_scan_messages_are_preferred_to_the_drivers_cloud(ros, write):
    rows, _ = ti_messages(ros, TI_SCAN, [2, 2, 2])
    points = np.zeros(2, dtype=[(name, "<f4") for name in ("x", "y", "z", "intensity")])
    rows += [("/ti_mmwave/radar_scan_pcl", START_NS + i * 10**8, ros.cloud(0, points)) for i in range(3)]
    with open_recording(write(ros, sorted(rows, key=lambda row: row[1])), require=("radar",)) as recording:
        assert recording.radar_topic == "/ti_mmwave/radar_scan"


@given(st.lists(st.integers(1, 12), min_size=1, max_size=40), st.integers(20, 200), st.integers(0, 3), st.data())
def test_grouping_finds_every_scan_whatever_the_driver_filtered_out(counts, period_ms, phase, data):
    """Point numbers rise within a scan, some points are missing, and messages are close together in time."""
    times, numbers, owners = [], [], []
    for scan, count in enumerate(counts):
        kept = sorted(data.draw(st.sets(st.integers(0, 60), min_size=count, max_size=count)))
        times += [scan * period_ms * 10**6 + 50_000 * k for k in range(count)]
        numbers += kept
        owners += [scan] * count
    first = first_of_scans(np.array(times) + phase, None, np.array(numbers))
    scans = np.searchsorted(first, np.arange(len(times)), side="right") - 1
    together = np.diff(owners) == 0
    assert np.all(np.diff(scans)[together] == 0)  # no scan is ever split
    resets = np.diff(numbers) <= 0
    assert np.all(np.diff(scans)[resets] == 1)  # and a scan ends where the numbers fall
    if np.count_nonzero(resets) > 2 and np.all(np.diff(np.flatnonzero(resets)) > 0):
        usual = np.median(np.diff(np.array(times)[np.flatnonzero(resets) + 1]))
        if usual <= 1.5 * period_ms * 10**6:
            assert np.array_equal(scans, owners)


@given(st.lists(st.integers(1, 9), min_size=1, max_size=30), st.booleans())
def test_without_numbers_scans_are_separated_by_pauses(counts, same_stamp):
    times = [scan * 50_000_000 + (0 if same_stamp else 100_000 * k) for scan, n in enumerate(counts) for k in range(n)]
    first = first_of_scans(np.array(times, dtype=np.int64))
    assert first.tolist() == np.concatenate([[0], np.cumsum(counts)[:-1]]).tolist()


def test_big_endian_messages_are_read(ros2, write, cloud_points, monkeypatch, plain, jpeg):
    """Written on a machine of the other byte order, which CDR declares in its first bytes."""
    little = ros2.serialise
    monkeypatch.setattr(
        ros2, "serialise", lambda m: bytes(ros2.store.serialize_cdr(m, m.__msgtype__, little_endian=False))
    )
    messages = [ros2.cloud(START_NS + i * 10**8, cloud_points(3)) for i in range(3)]
    ti, positions = ti_messages(ros2, TI_SCAN, [2, 3, 1])
    rows = [("/radar/cloud", START_NS + i * 10**8, message) for i, message in enumerate(messages)] + ti
    assert little(messages[0]) != ros2.serialise(messages[0])
    path = write(ros2, rows)
    with open_recording(path, RecordingOptions(radar_topic="/radar/cloud"), require=("radar",)) as recording:
        np.testing.assert_array_equal(recording.radar_times, START_NS + 10**8 * np.arange(3))
        np.testing.assert_array_equal(recording.radar_scans().scan(2).points_radar_m[:, 0], cloud_points(3)["x"])
    with open_recording(path, RecordingOptions(radar_topic="/ti_mmwave/radar_scan"), require=("radar",)) as recording:
        np.testing.assert_array_equal(recording.radar_scans().points_radar_m, positions)
        assert np.diff(recording.radar_scans().first_return).tolist() == [2, 3, 1]


def test_windows_hold_every_scan_once_and_few_returns_each(ros, write, plain, jpeg, cloud_points):
    at = [START_NS + i * 10**8 for i in range(80)]
    rows = [("/radar/points", t, ros.cloud(t, cloud_points(1 + 2000 * (i % 40 == 7), i))) for i, t in enumerate(at)]
    with open_recording(write(ros, rows), require=("radar",)) as recording:
        whole, windows = recording.radar_scans(), list(recording.radar_windows())
    assert len(windows) > 1
    assert max(len(window) for window in windows) < 80
    for name in ("times_ns", "points_radar_m", "doppler_mps", "snr_db", "sigma_polar"):
        np.testing.assert_array_equal(np.concatenate([getattr(w, name) for w in windows]), getattr(whole, name))


def test_scans_of_a_window_cannot_be_written_to(ros, write, plain, jpeg):
    with open_recording(write(ros, plain(ros, jpeg))) as recording:
        scans = recording.radar_scans(START_NS, START_NS + 10**9)
    for name in ("times_ns", "points_radar_m", "doppler_mps", "snr_db", "sigma_polar"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(scans, name)[0] = 1
        with pytest.raises(ValueError, match="cannot set WRITEABLE"):
            getattr(scans, name)[:1].setflags(write=True)


@pytest.mark.parametrize("sizes", [[3], [3, 5, 0]])
def test_clouds_far_apart_in_a_file_are_read_like_any(sizes, ros, write, plain, jpeg, cloud_points):
    at = [START_NS + i * 10**8 for i in range(200)]
    clouds = [cloud_points(sizes[i % len(sizes)], i) for i in range(200)]
    rows = []
    for t, points in zip(at, clouds, strict=True):
        rows.append(("/radar/points", t, ros.cloud(t, points)))
        rows.append(("/camera/image/compressed", t, ros.compressed(t, jpeg + bytes(20_000))))
    with open_recording(write(ros, rows)) as recording:
        scans = recording.radar_scans()
        windows = list(recording.radar_windows())
    expected = np.concatenate([np.stack([p["x"], p["y"], p["z"]], axis=1) for p in clouds])
    np.testing.assert_array_equal(scans.points_radar_m, expected)
    np.testing.assert_array_equal(np.concatenate([w.points_radar_m for w in windows]), expected)
    np.testing.assert_array_equal(scans.doppler_mps, np.concatenate([p["velocity"] for p in clouds]))
