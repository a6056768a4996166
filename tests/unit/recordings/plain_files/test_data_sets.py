"""Folders of data sets: their pictures, radar and intrinsics are found, and what is not used is named."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import describe, inspect_recording, open_recording

START_NS = 1_700_000_000 * NS_PER_S
K = np.array([[1495.47, 0, 961.27], [0, 1495.47, 624.9], [0, 0, 1]])
SIZE = (1936, 1216)


def picture(path: Path, size_px: tuple[int, int] = SIZE) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), np.zeros((size_px[1], size_px[0], 3), np.uint8))


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.6e}" for value in np.asarray(values).ravel())


def calib_text(matrix_px: np.ndarray = K) -> str:
    projection = np.hstack([matrix_px, np.zeros((3, 1))])
    zero = np.hstack([np.diag([1.0, 1.0, 1.0]), np.zeros((3, 1))])
    pose = np.array(
        [[-0.0138, -0.9997, 0.0191, 0.05], [0.1093, -0.0205, -0.9938, 1.46], [0.9939, -0.0116, 0.1095, 1.48]]
    )
    rows = [f"P{number}: {numbers(projection if number == 2 else zero)}" for number in range(4)]
    return "\n".join([*rows, f"R0_rect: {numbers(np.eye(3))}", f"Tr_velo_to_cam: {numbers(pose)}", ""])


def floats_bin(path: Path, count: int, columns: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(np.random.default_rng(count).uniform(1, 9, (count, columns)).astype(np.float32).tobytes())


def view_of_delft(root: Path, count: int = 3) -> Path:
    for number in range(count):
        picture(root / "radar" / "training" / "image_2" / f"{number:05}.jpg")
        floats_bin(root / "radar" / "training" / "velodyne" / f"{number:05}.bin", 5 + number, 7)
        floats_bin(root / "lidar" / "training" / "velodyne" / f"{number:05}.bin", 101 + number, 4)
        calib = root / "radar" / "training" / "calib" / f"{number:05}.txt"
        calib.parent.mkdir(exist_ok=True)
        calib.write_text(calib_text())
    return root


@pytest.mark.parametrize("inner", [".", "radar", "radar/training"])
def test_view_of_delft_brings_its_camera_and_names_its_pose(tmp_path, inner) -> None:
    root = view_of_delft(tmp_path / "view_of_delft")
    with open_recording(root / inner) as recording:
        camera = recording.camera()
        assert (recording.radar_topic, recording.image_topic) == ("/velodyne/radar", "/image_2/image")
        text = describe(recording)
        codes = {warning.code for warning in recording.warnings}
    assert camera is not None
    np.testing.assert_allclose(camera.matrix_px, K)
    assert (camera.model, camera.width_px, camera.height_px) == ("pinhole", *SIZE)
    calib = root / inner / Path("radar/training" if inner == "." else "training" if inner == "radar" else ".") / "calib"
    assert f"its pose: --calibration {calib / '00000.txt'}" in text
    assert ("unused-files" in codes) == (inner == ".")
    assert "numbered-files" in codes
    if inner == ".":
        assert "velodyne (3 lidar clouds, which this program does not use)" in text


def test_sums_of_scans_beside_the_scans_are_not_the_radar(tmp_path) -> None:
    root = view_of_delft(tmp_path / "view_of_delft")
    for number in range(3):
        floats_bin(root / "radar_5frames" / "training" / "velodyne" / f"{number:05}.bin", 60, 7)
    with open_recording(root) as recording:
        assert recording.radar_topic == "/velodyne/radar"
        assert np.diff(recording.radar_scans().first_return).tolist() == [5, 6, 7]
        assert "radar_5frames (sums of several scans of radar, which are used one by one)" in describe(recording)
    with open_recording([root / "radar_5frames", root / "radar" / "training" / "image_2"]) as recording:
        assert np.diff(recording.radar_scans().first_return).tolist() == [60, 60, 60]


def test_intrinsics_that_differ_between_frames_are_told(tmp_path) -> None:
    root = view_of_delft(tmp_path / "drive")
    (root / "radar" / "training" / "calib" / "00002.txt").write_text(calib_text(K * [[1.1], [1.1], [1]]))
    with open_recording(root) as recording:
        warning = next(one for one in recording.warnings if one.code == "camera-changes")
    assert "other frames have other intrinsics" in warning.message


def kitti_raw(root: Path, *, rectified: bool) -> tuple[Path, np.ndarray]:
    """Write a day with one drive; return the drive and the right K."""
    drive = root / "2011_09_26" / "2011_09_26_drive_0001_sync"
    raw, rect = K, np.array([[721.5, 0, 609.6], [0, 721.5, 172.9], [0, 0, 1]])
    size, rect_size = (1392, 512), (1242, 375)
    drive.mkdir(parents=True)
    (drive.parent / "calib_cam_to_cam.txt").write_text(
        "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
        f"S_02: {numbers(np.array(size))}\nK_02: {numbers(raw)}\nD_02: {numbers(np.array([-0.37, 0.2, 1e-3, 1e-4, -0.07]))}\n"
        f"S_rect_02: {numbers(np.array(rect_size))}\nP_rect_02: {numbers(np.hstack([rect, np.ones((3, 1))]))}\n"
    )
    for number in range(3):
        picture(drive / "image_02" / "data" / f"{number:010}.png", rect_size if rectified else size)
        floats_bin(drive / "velodyne_points" / "data" / f"{number:010}.bin", 99 + number, 4)
    stamps = "".join(f"2011-09-26 13:02:2{number}.964389445\n" for number in range(3))
    (drive / "image_02" / "timestamps.txt").write_text(stamps)
    (drive / "oxts").mkdir()
    (drive / "oxts" / "dataformat.txt").write_text("lat: latitude\n")
    return drive, rect if rectified else raw


@pytest.mark.parametrize("rectified", [True, False])
def test_raw_kitti_brings_its_camera_and_its_stamps(tmp_path, rectified) -> None:
    drive, matrix_px = kitti_raw(tmp_path, rectified=rectified)
    with open_recording(drive, require=("image",)) as recording:
        camera = recording.camera()
        assert recording.image_topic == "/image_02/image"
        assert recording.image_times[0] == 1_317_042_140_964_389_445
        assert "data (3 lidar clouds, which this program does not use)" in describe(recording)
    assert camera is not None
    np.testing.assert_allclose(camera.matrix_px, matrix_px)
    assert camera.model == ("pinhole" if rectified else "plumb_bob")


def nuscenes(root: Path) -> Path:
    """Write the tables, two cameras, a radar and a lidar of a nuScenes data set."""
    head = (
        "VERSION 0.7\nFIELDS x y z rcs vx vy\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH 1\nHEIGHT 1\n"
        "POINTS 1\nDATA ascii\n5 1 0 7 1 0\n"
    )
    channels = ("CAM_BACK", "CAM_FRONT", "RADAR_FRONT", "LIDAR_TOP")
    for channel in channels:
        for number in range(3):
            name = f"n008-2018-08-01-15-16-36-0400__{channel}__{1533151603512404 + 500_000 * number}"
            path = root / "samples" / channel / name
            if channel.startswith("CAM"):
                picture(path.with_suffix(".jpg"), (160, 90))
            elif channel.startswith("LIDAR"):
                floats_bin(path.with_suffix(".pcd.bin"), 28, 5)
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.with_suffix(".pcd").write_text(head)
    (root / "sweeps" / "CAM_FRONT").mkdir(parents=True)
    tables = root / "v1.0-mini"
    tables.mkdir()
    matrices = {"CAM_BACK": np.diag([81.0, 81.0, 1.0]), "CAM_FRONT": np.diag([126.6, 126.6, 1.0])}
    sensors = [{"token": f"s{n}", "channel": channel, "modality": "any"} for n, channel in enumerate(channels)]
    calibrated = [
        {
            "token": f"c{n}-{car}", "sensor_token": f"s{n}", "translation": [0, 0, 0], "rotation": [1, 0, 0, 0],
            "camera_intrinsic": (np.diag([1 + car / 10, 1 + car / 10, 1]) @ matrix).tolist()
            if (matrix := matrices.get(channel)) is not None else [],
        }
        for car in (0, 1) for n, channel in enumerate(channels)
    ]  # fmt: skip
    used = [
        {"filename": str(path.relative_to(root)), "calibrated_sensor_token": f"c{channels.index(path.parent.name)}-1"}
        for path in sorted((root / "samples").rglob("*.jpg"))
    ]
    for name, rows in (("sensor", sensors), ("calibrated_sensor", calibrated), ("sample_data", used)):
        (tables / f"{name}.json").write_text(json.dumps(rows))
    return root


def test_nuscenes_opens_at_its_front_with_the_camera_of_its_car(tmp_path) -> None:
    with open_recording(nuscenes(tmp_path / "nuscenes")) as recording:
        camera = recording.camera()
        assert (recording.radar_topic, recording.image_topic) == ("/RADAR_FRONT/radar", "/CAM_FRONT/image")
        assert recording.image_times[0] == 1_533_151_603_512_404_000
        assert {topic.name for topic in recording.topics} == {
            "/CAM_BACK/image",
            "/CAM_FRONT/image",
            "/RADAR_FRONT/radar",
        }
        text = describe(recording)
    assert camera is not None
    np.testing.assert_allclose(np.diag(camera.matrix_px), [126.6 * 1.1, 126.6 * 1.1, 1.0])
    assert "LIDAR_TOP (3 lidar clouds" in text
    assert "sweeps (frames between the annotated ones" in text
    assert "its pose: records of CAM_FRONT and of the radar in" in text


def test_a_damaged_calibration_is_no_camera_and_no_crash(tmp_path) -> None:
    root = nuscenes(tmp_path / "nuscenes")
    (root / "v1.0-mini" / "calibrated_sensor.json").write_text('[{"token": 1}]')
    with open_recording(root) as recording:
        assert recording.camera() is None


# -- nothing vanishes


def test_many_files_of_one_kind_that_nobody_reads_are_one_entry(tmp_path) -> None:
    picture(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    (tmp_path / "label_2").mkdir()
    for number in range(30):
        (tmp_path / "label_2" / f"{number:06}.txt").write_text("Car 0.00 0 1.85 387.63 181.54 423.81 203.12 1.67\n")
    with inspect_recording(tmp_path) as recording:
        (warning,) = recording.warnings
    assert "1 file or folder was looked at and not used: 000000.txt (and 29 like it: no header" in warning.message


def test_numbers_beside_real_times_are_an_assumption(tmp_path) -> None:
    for number in range(3):
        picture(tmp_path / "camera" / f"{number}.png", (8, 8))
    (tmp_path / "radar.csv").write_text("time_s,x_m,y_m\n1.0,3,1\n1.2,3,1\n")
    with open_recording(tmp_path) as recording:
        (assumption,) = recording.assumptions
    assert (assumption.key, assumption.topic) == ("frame-interval", "/camera/image")


def test_what_a_folder_holds_and_nobody_reads_is_named(tmp_path) -> None:
    for number in range(3):
        picture(tmp_path / "camera" / f"{START_NS + number}.png", (8, 8))
        picture(tmp_path / "thumbnails" / f"{'abc'[number]}.png", (8, 8))
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    (tmp_path / "imu.csv").write_text("time_ns,gyro_x,gyro_y\n1,2,3\n")
    (tmp_path / "objects.json").write_text('{"boxes": "none"}')
    clicks = '{"id": "c1", "image_time": {"sec": 1, "nanosec": 2}, "pixel_px": [3, 4]}'
    (tmp_path / "clicks.json").write_text(f'{{"schema": "cocalib/clicks-1", "clicks": [{clicks}]}}')
    mixed = tmp_path / "mixed"
    picture(mixed / f"{START_NS}.png", (8, 8))
    (mixed / "a.pcd").write_bytes(b"")
    (tmp_path / "sub" / "bag").mkdir(parents=True)
    (tmp_path / "sub" / "bag" / "a.bag").write_bytes(b"")
    with open_recording(tmp_path) as recording:
        assert (recording.radar_topic, recording.image_topic) == ("/radar/radar", "/camera/image")
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
    assert warning.message.startswith("6 files and folders were looked at and not used: ")
    for words in (
        "thumbnails (no times in the file names",
        "imu.csv (no position columns",
        "objects.json (no position columns",
        "clicks.json (a cocalib/clicks-1 file, no recording)",
        "mixed (the folder contains",
        "bag (a ROS recording; open it by its own path)",
    ):
        assert words in warning.message


def test_a_long_list_of_unused_files_is_cut(tmp_path) -> None:
    picture(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    for number in range(20):
        (tmp_path / f"log{'abcdefghijklmnopqrst'[number]}.csv").write_text("a,b\n1,2\n")
    with inspect_recording(tmp_path) as recording:
        (warning,) = recording.warnings
    assert "20 files and folders were looked at and not used" in warning.message
    assert warning.message.endswith("; and 14 more")


def test_a_missing_radar_is_explained_by_the_file_that_could_not_be_used(tmp_path) -> None:
    picture(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    (tmp_path / "radar.csv").write_text("time_ns,links,rechts\n1,2,3\n")
    with pytest.raises(RecordingError) as caught:
        open_recording(tmp_path)
    assert "no readable radar topic" in str(caught.value)
    assert "radar.csv (no position columns" in str(caught.value)


def test_a_radar_table_beside_the_pictures_is_found(tmp_path) -> None:
    for number in range(2):
        picture(tmp_path / f"{START_NS + number * NS_PER_S}.png", (8, 8))
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    with open_recording(tmp_path) as recording:
        assert recording.radar_topic == "/radar/radar"
