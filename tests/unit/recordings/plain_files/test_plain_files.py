"""Folders of images and radar files, radar CSV and videos as recordings."""

import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.radar import cartesian_from_polar
from calib_core.recordings import RecordingOptions, describe, inspect_recording, open_recording, recording_summary
from calib_core.recordings.time.written_times import epoch_in_name, read_time

START_NS = 1_700_000_000 * NS_PER_S


def pixels(number: int = 0) -> np.ndarray:
    v, u = np.mgrid[:48, :64]
    return np.stack([u * 3, v * 4, np.full_like(u, 40 + 20 * number)], axis=2).astype(np.uint8)


def images(folder: Path, names: list[str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names):
        assert cv2.imwrite(str(folder / name), pixels(number))
    return folder


def radar_csv(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def refusal(*paths: Path, **options: str) -> str:
    with pytest.raises(RecordingError) as caught:
        inspect_recording(paths, RecordingOptions(**options))
    text = str(caught.value)
    assert "\n" not in text
    return text


# -- times
@pytest.mark.parametrize(
    ("stem", "expected"),
    [
        ("1700000000123456789", 1_700_000_000_123_456_789),
        ("1700000000123456", 1_700_000_000_123_456_000),
        ("1700000000123", 1_700_000_000_123_000_000),
        ("1700000000", 1_700_000_000_000_000_000),
        ("1700000000.25", 1_700_000_000_250_000_000),
        ("frame_1700000000_000000042", 1_700_000_000_000_000_042),
        ("n015-2018-07-24-11-22-45+0800__RADAR_FRONT__1532402927664178", 1_532_402_927_664_178_000),
        ("00544", None),
        ("9999999999", None),
        ("image-12345678901234", None),
    ],
)
def test_times_are_found_in_names(stem, expected):
    moment = epoch_in_name(stem)
    assert (moment and moment.time) == expected


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("1700000000.000000001", None, START_NS + 1),
        ("2023-11-14T22:13:20Z", None, START_NS),
        ("2023-11-14T23:13:20.5+01:00", None, START_NS + NS_PER_S // 2),
        ("2023-11-14 22:13:20.000000007", None, START_NS + 7),
        ("12.5", "ms", 12_500_000),
        ("-1.5", "s", -1_500_000_000),
    ],
)
def test_written_times_are_read_exactly(text, unit, expected):
    assert read_time(text, unit) == expected


@pytest.mark.parametrize(("text", "words"), [("yesterday", "'yesterday' is not a time"), ("12345", "has 5 digits")])
def test_invalid_times_are_refused(text, words):
    with pytest.raises(RecordingError, match=words):
        read_time(text)


# -- images
def test_a_folder_of_images_is_a_camera(tmp_path):
    names = [f"{START_NS + i * 10**8}.{suffix}" for i, suffix in enumerate(["jpg", "png", "bmp", "jpg"])]
    folder = images(tmp_path / "front", names)
    with open_recording(folder, require=("image",)) as recording:
        assert recording.image_topic == "/front/image"
        assert recording.camera_frame == "camera"
        np.testing.assert_array_equal(recording.image_times, START_NS + 10**8 * np.arange(4))
        assert recording.image_bytes(0).data == (folder / names[0]).read_bytes()
        assert recording.image_bytes(1).data == (folder / names[1]).read_bytes()
        assert [recording.image_bytes(i).format for i in range(4)] == ["jpeg", "png", "png", "jpeg"]
        np.testing.assert_array_equal(recording.image(2), pixels(2))
        assert recording.warnings == ()
        assert "images, 4 files" in describe(recording)
        assert "in the file names\n" in describe(recording)
        (file,) = recording.fingerprint()
        assert file.size_bytes == sum(path.stat().st_size for path in folder.iterdir())


def test_the_fingerprint_of_a_folder_follows_its_contents(tmp_path):
    import hashlib

    folder = images(tmp_path / "front", [f"{START_NS + i}.png" for i in range(3)])
    whole = b"".join(path.read_bytes() for path in sorted(folder.iterdir()))
    with open_recording(folder, require=("image",)) as recording:
        assert recording.fingerprint()[0].sha256 == hashlib.sha256(whole).hexdigest()


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ("front/times.csv", "file,time_ns\na.png,1700000000000000000\nb.png,1700000001000000000\n"),
        ("front/data.csv", "#timestamp [ns],filename\n1700000000000000000,a.png\n1700000001000000000,b.png\n"),
        ("front.csv", "name,time_s\nimages/a,1700000000.0\nimages/b,1700000001.000000000\n"),
        ("timestamps.txt", "2023-11-14 22:13:20\n2023-11-14 22:13:21.000000000\n"),
        ("front/times.txt", "1700000000.0\n1700000001.0\n"),
        ("front.txt", "Frame: a Time: 1700000000.000000000\nFrame: b Time: 1700000001.000000000\n"),
        ("front.txt", "# color images\n# timestamp filename\n1700000000.0 front/a.png\n1700000001.0 front/b.png\n"),
    ],
)  # fmt: skip
def test_a_table_next_to_the_files_gives_the_times(tmp_path, table, text):
    folder = images(tmp_path / "front", ["b.png", "a.png"])
    radar_csv(tmp_path / table, text)
    with open_recording(folder, require=("image",)) as recording:
        assert recording.image_times.tolist() == [START_NS, START_NS + NS_PER_S]
        np.testing.assert_array_equal(recording.image(1), pixels(0))


def test_the_times_beside_numbered_stills_are_found_and_told(tmp_path):
    """As in RADIATE: five stills minutes apart, and their times beside the folder."""
    folder = images(tmp_path / "zed_left", [f"{number:06}.png" for number in (1, 40, 92, 137, 201)])
    seconds = {number: 1_574_859_772 + 19 * number for number in range(1, 205)}
    lines = [f"Frame: {number:06} Time: {second}.427742418\n" for number, second in seconds.items()]
    (tmp_path / "zed_left.txt").write_text("".join(lines))
    with open_recording(folder, require=("image",)) as recording:
        text = describe(recording)
        wanted = [seconds[number] * NS_PER_S + 427_742_418 for number in (1, 40, 92, 137, 201)]
        assert recording.image_times.tolist() == wanted
        assert recording.warnings == ()
    assert "those in zed_left.txt" in text
    assert "950 s apart" in text
    assert "Hz" not in text
    assert "sound" not in text


def test_an_assumed_time_is_never_called_sound_and_has_no_rate(tmp_path):
    """Neither those of the camera in use, nor of the other one, nor the radar's."""
    numbers = (1, 15, 29, 43, 570)
    for folder in ("zed_left", "zed_right"):
        images(tmp_path / folder, [f"{number:06}.png" for number in numbers])
    for folder, seed in (("front", 4), ("rear", 5)):
        bin_folder(tmp_path / folder, [bin_rows("delft", 40, seed) for _ in numbers])
    with open_recording(tmp_path) as recording:
        text = describe(recording)
        topics = recording_summary(recording).topics
        assert {warning.code for warning in recording.warnings} == {"numbered-files", "several-radars"}
    assert [(topic.rate_hz, topic.jitter_s) for topic in topics] == [(None, None)] * 4
    assert "times are assumed" in text
    assert "stamps count" not in text
    assert "Hz" not in text
    assert "sound" not in text


def test_part_of_a_kitti_drive_has_the_lines_of_its_numbers(tmp_path):
    folder = images(tmp_path / "image_02" / "data", ["0000000003.png", "0000000007.png"])
    (tmp_path / "image_02" / "timestamps.txt").write_text(
        "".join(f"2011-09-26 13:02:{second:02}.964389445\n" for second in range(9))
    )
    with open_recording(folder, require=("image",)) as recording:
        assert (recording.image_times % (60 * NS_PER_S)).tolist() == [3_964_389_445, 7_964_389_445]


@pytest.mark.parametrize("stamped", ["images", "radar"])
@pytest.mark.parametrize(("spelling", "what"), [("{:06}", "names"), ("frame{:03}", "numbers")])
def test_files_without_times_have_those_of_the_other_sensor(tmp_path, stamped, spelling, what):
    images(tmp_path / "image_2", [f"{number:06}.png" for number in (4, 5, 9)])
    radar = bin_folder(tmp_path / "radar", [bin_rows("delft", 5) for _ in range(3)])
    for path, number in zip(sorted(radar.iterdir()), (4, 5, 9), strict=True):
        path.rename(radar / f"{spelling.format(number)}.new")
    for path in radar.iterdir():
        path.rename(path.with_suffix(".bin"))
    names = {"images": "{:06}", "radar": spelling}[stamped]
    folder = {"images": tmp_path / "image_2", "radar": radar}[stamped]
    rows = "".join(f"{names.format(number)},{START_NS + number * 10**9}\n" for number in (4, 5, 9))
    folder.with_suffix(".csv").write_text(f"file,time_ns\n{rows}")
    with open_recording(tmp_path) as recording:
        warning = next(one for one in recording.warnings if one.code == "numbered-files")
        wanted = [START_NS + number * 10**9 for number in (4, 5, 9)]
        assert recording.image_times.tolist() == recording.radar_times.tolist() == wanted
    assert f"with the same {what}" in warning.facts["message"]


def test_times_that_do_not_tell_files_apart_are_given_to_no_other(tmp_path):
    """A lidar's tables with one and the same time in all of them, beside images and a radar's without any."""
    images(tmp_path / "camera_front", [f"{number:06}.png" for number in range(4)])
    for folder, head, row in (
        ("lidar", "x_m y_m z_m time_s", "1 2 3 6"),
        ("radar", "x_m y_m z_m doppler_mps", "9 2 3 1"),
    ):
        (tmp_path / folder).mkdir()
        for number in range(4):
            (tmp_path / folder / f"{number:06}.txt").write_text(f"{head}\n{row}\n{row}\n")
    with open_recording(tmp_path) as recording:
        assert recording.radar_topic == "/radar/radar"
        assert recording.image_times.tolist() == recording.radar_times.tolist()
        assert len(set(recording.image_times.tolist())) == 4


def test_images_without_a_time_are_skipped_with_a_warning(tmp_path):
    folder = images(tmp_path / "front", [f"{START_NS}.png", "notes.png", "zebra.png"])
    with open_recording(folder, require=("image",)) as recording:
        assert len(recording.image_times) == 1
        (warning,) = recording.warnings
    assert warning.code == "unstamped-files"
    assert "the first is notes.png" in warning.facts["message"]


def test_images_without_any_times_are_refused_with_a_clear_error(tmp_path):
    text = refusal(images(tmp_path / "front", ["a.png", "b.png"]))
    assert "file names (a.png)" in text
    assert "columns file,time_ns" in text


def test_a_image_of_another_size_in_a_folder_is_skipped_and_told(tmp_path):
    folder = images(tmp_path / "front", [f"{START_NS + i}.png" for i in range(4)])
    cv2.imwrite(str(folder / f"{START_NS + 1}.png"), np.zeros((200, 300, 3), dtype=np.uint8))
    with open_recording(folder, require=("image",)) as recording:
        assert recording.image_times.tolist() == [START_NS, START_NS + 2, START_NS + 3]
        (warning,) = recording.warnings
    assert warning.code == "picture-sizes"
    assert "300 x 200 (" in warning.facts["message"]


# -- radar files


def test_an_ascii_pcd_is_read_and_a_compressed_one_is_explained(tmp_path):
    folder = tmp_path / "radar"
    folder.mkdir()
    head = "VERSION .7\nFIELDS x y z velocity snr\nSIZE 4 4 4 4 4\nTYPE F F F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA "
    (folder / f"{START_NS}.pcd").write_text(head + "ascii\n1 2 3 0.5 9\n4 5 6 0.25 8\n")
    (folder / f"{START_NS + 10**8}.pcd").write_text(head + "binary_compressed\n")
    (folder / f"{START_NS + 2 * 10**8}.pcd").write_text(head + "binary\nshort")
    (folder / f"{START_NS + 3 * 10**8}.pcd").write_text("FIELDS x y z velocity\nSIZE 4\nDATA binary\n")
    (folder / f"{START_NS + 4 * 10**8}.pcd").write_bytes((head + "binary\n").encode() + bytes(60))  # of three points
    with open_recording(folder, require=("radar",)) as recording:
        scans = recording.radar_scans()
        (warning,) = recording.warnings
    np.testing.assert_array_equal(scans.points_radar_m, [[1, 2, 3], [4, 5, 6]])
    assert np.diff(scans.first_return).tolist() == [2, 0, 0, 0, 0]
    assert "4 radar messages " in warning.facts["message"]
    assert "'binary_compressed' data" in warning.facts["message"]


def bin_rows(layout: str, count: int, seed: int = 4) -> np.ndarray:
    """Return (count, k) float32 returns ahead of a radar as View-of-Delft or TJ4DRadSet store them."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(4, 60, count), rng.uniform(-20, 20, count), rng.uniform(-1, 3, count)])
    speed, power = rng.normal(0, 4, count), rng.uniform(-20, 30, count)
    if layout == "delft":
        return np.column_stack([points, power, speed, speed / 2, np.zeros(count)]).astype(np.float32)
    range_m, across = np.linalg.norm(points, axis=1), np.hypot(points[:, 0], points[:, 1])
    angles = np.degrees([np.arctan2(points[:, 1], points[:, 0]), np.arctan2(points[:, 2], across)])
    return np.column_stack([points, speed, range_m, power, *angles]).astype(np.float32)


def bin_folder(folder: Path, scans: Sequence[np.ndarray]) -> Path:
    folder.mkdir(parents=True)
    for number, rows in enumerate(scans):
        (folder / f"{number:06}.bin").write_bytes(rows.tobytes())
    return folder


@pytest.mark.parametrize("above", [False, True], ids=["the folder", "the data set"])
@pytest.mark.parametrize(("layout", "name", "speed"), [("delft", "View-of-Delft", 4), ("tj4d", "TJ4DRadSet", 3)])
def test_bin_files_are_read_by_the_layout_that_fits_all_of_them(tmp_path, layout, name, speed, above):
    scans = [bin_rows(layout, 28 + 4 * number, number) for number in range(9)]
    folder = bin_folder(tmp_path / "training" / "velodyne", scans)
    with open_recording(tmp_path if above else folder, require=("radar",)) as recording:
        found = recording.radar_scans()
        assert f"folder of {name} .bin" in describe(recording)
    assert np.diff(found.first_return).tolist() == [len(rows) for rows in scans]
    np.testing.assert_array_equal(found.points_radar_m, np.concatenate(scans)[:, :3])
    np.testing.assert_array_equal(found.doppler_mps, np.concatenate(scans)[:, speed])


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda scans: [*scans, np.zeros((5, 5), np.float32)], "1 of 5 files have another size"),
        (lambda scans: [rows[:, [1, 0, 2, 3, 4, 5, 6, 7]] for rows in scans], "of the returns could be a radar's"),
        (lambda scans: [1000 * rows for rows in scans], "only 0 % of the returns could be a radar's"),
        (lambda scans: [rows[:0] for rows in scans], "the files are empty"),
    ],
    ids=["another size", "beside the radar", "millimetres", "empty"],
)
def test_bin_files_that_fit_no_layout_are_refused_with_the_way_out(tmp_path, change, reason):
    folder = bin_folder(tmp_path / "radar", change([bin_rows("tj4d", 21, number) for number in range(4)]))
    with pytest.raises(RecordingError, match="fit no layout of radar returns") as caught:
        inspect_recording(folder)
    assert reason in str(caught.value)
    assert "--map x=1:m" in str(caught.value)


# -- radar CSV
def test_a_radar_csv_is_a_radar(tmp_path):
    path = radar_csv(
        tmp_path / "scan.csv",
        "time_ns,x_m,y_m,z_m,doppler_mps,snr_db,track_id\n"
        "1700000000100000000,3,1,0.5,-0.25,12,1\n1700000000000000001,5,-2,0.25,,9,2\n1700000000100000000,4,1,0.5,0.5,11,3\n\n",
    )
    with open_recording(path, require=("radar",)) as recording:
        scans = recording.radar_scans()
        assert "radar CSV, without track_id" in describe(recording)
    assert scans.times_ns.tolist() == [START_NS + 1, START_NS + 10**8]
    np.testing.assert_array_equal(scans.points_radar_m, [[5, -2, 0.25], [3, 1, 0.5], [4, 1, 0.5]])
    np.testing.assert_array_equal(scans.doppler_mps, [np.nan, -0.25, 0.5])
    np.testing.assert_array_equal(scans.snr_db, [9, 12, 11])


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("time_s,range_m,azimuth_deg,elevation_deg,sigma_range_m,sigma_azimuth_deg", "1700000000,5,30,10,0.1,2"),
        ("Timestamp [us],Range [cm],Azimuth [rad],Elevation (rad),sigma_range_mm,sigma_azimuth_rad",
         f"1700000000000000,500,{np.radians(30)},{np.radians(10)},100,{np.radians(2)}"),
    ],
)  # fmt: skip
def test_units_in_the_header_are_followed(tmp_path, header, row):
    with open_recording(radar_csv(tmp_path / "a.csv", f"{header}\n{row}\n"), require=("radar",)) as recording:
        scans = recording.radar_scans()
    assert scans.times_ns.tolist() == [START_NS]
    np.testing.assert_allclose(
        scans.points_radar_m, cartesian_from_polar(np.array([[5, np.radians(30), np.radians(10)]]))
    )
    np.testing.assert_allclose(scans.sigma_polar, [[0.1, np.radians(2), np.nan]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_ns,x_ft,y_m\n1,2,3\n", "column 'x_ft' has the unknown unit 'ft'; known units: m, cm, mm, km"),
        ("time_fortnights,x_m,y_m\n1,2,3\n", "column 'time_fortnights' has the unknown unit 'fortnights'"),
        ("x_m,y_m\n1,2\n", "no time column; the first line must name columns and units, such as time_ns,x_m"),
        ("time_ns,x_m,snr_db\n1,2,3\n", "no position columns; x_m and y_m, or range_m and azimuth_deg, are required"),
        ("time_ns,x_m,y_m\n", "the file has a header but no rows"),
        ("time_ns,x_m,y_m\n1,2,3\n2,two,3\n", "line 3: could not convert string to float: 'two'"),
        ("time_ns,x_m,y_m\n1,2\n", "line 2: too few columns"),
        (f"time_ns,x_m,y_m\n{START_NS},1,5,2,25\n", "line 2: 5 values in 3 columns"),
        ("", "the file is empty"),
    ],
)
def test_an_ambiguous_csv_is_refused_with_a_clear_error(tmp_path, text, words):
    assert words in refusal(radar_csv(tmp_path / "a.csv", text))


# -- videos
def striped(number: int) -> np.ndarray:
    """Write a number into an image: eight stripes, one per bit."""
    bits = [255 if number >> bit & 1 else 0 for bit in range(8)]
    return np.repeat(np.repeat(np.array(bits, dtype=np.uint8), 8)[None, :, None], 48, axis=0).repeat(3, axis=2)


def number_in(image: np.ndarray) -> int:
    bits = image.mean(axis=(0, 2)).reshape(8, 8).mean(axis=1) > 127
    return int(sum(1 << bit for bit in range(8) if bits[bit]))


def video(path: Path, count: int = 90, rate: float = 20.0) -> Path:
    codec = "MJPG" if path.suffix == ".avi" else "mp4v"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), rate, (64, 48))
    for number in range(count):
        writer.write(striped(number))
    writer.release()
    return path


@pytest.mark.parametrize("start", ["1700000000.25", "2023-11-14T22:13:20.25Z"])
@pytest.mark.parametrize("suffix", [".avi", ".mp4"])
def test_a_video_with_its_start_is_a_camera(tmp_path, suffix, start):
    path = video(tmp_path / f"cam{suffix}")
    with open_recording(path, RecordingOptions(video_start=start), require=("image",)) as recording:
        assert recording.image_topic == "/cam/image"
        assert recording.video_start == start
        times = recording.image_times - START_NS
        np.testing.assert_allclose(times, 250_000_000 + 50_000_000 * np.arange(90), atol=1000)
        for index in (11, 0, 5, 6, 3, 89, 70, 1, 88, 44, 45):
            assert number_in(recording.image(index)) == index
        frame = recording.image_bytes(2)
        assert (frame.format, frame.width_px, frame.height_px) == ("jpeg", 64, 48)


def test_a_video_without_its_start_or_without_frames_is_refused_with_a_clear_error(tmp_path):
    assert "with --video-start" in refusal(video(tmp_path / "cam.avi"))
    assert "--video-start: 'noon'" in refusal(tmp_path / "cam.avi", video_start="noon")
    (tmp_path / "b.mp4").write_bytes(b"nothing of the kind")
    assert "not a readable video" in refusal(tmp_path / "b.mp4", video_start="1700000000")


def test_a_start_without_a_video_is_refused_rather_than_ignored(project_root):
    words = refusal(project_root / "sample_data" / "rooftop" / "camera.bag", video_start="1700000000")
    assert "no video among camera.bag" in words


# -- together
def test_plain_files_join_a_bag_as_one_recording(ros1, write, plain, jpeg, tmp_path):
    bag = write(ros1, [row for row in plain(ros1, jpeg) if "radar" not in row[0]])
    text = "time_ns,x_m,y_m,z_m,doppler_mps\n" + "".join(f"{START_NS + i * 10**8},{i},1,{i % 3},0\n" for i in range(20))
    with open_recording([bag, radar_csv(tmp_path / "radar.csv", text)]) as recording:
        assert (recording.radar_topic, recording.image_topic) == ("/radar/radar", "/camera/image/compressed")
        assert (recording.radar_clock, recording.image_clock) == ("header", "header")
        assert recording.camera() is not None
        assert len(recording.fingerprint()) == 2


def test_folders_with_the_same_name_stay_separate_topics(tmp_path):
    folders = [images(tmp_path / side / "images", [f"{START_NS}.png"]) for side in ("left", "right")]
    with open_recording(folders, require=("image",)) as recording:
        assert [topic.name for topic in recording.topics] == ["/images/image", "/right/images/image"]


def test_mixed_folders_and_single_files_are_explained(tmp_path):
    mixed = images(tmp_path / "mixed", [f"{START_NS}.png"])
    (mixed / "a.pcd").write_bytes(b"")
    assert "into separate folders" in refusal(mixed)
    assert "open the folder" in refusal(mixed / f"{START_NS}.png")


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ("-5", "outside the years 1970 to 2106"),
        ("99999999999999999999999", "too many for a time"),
        ("9200000000000000000", "outside the years 1970 to 2106"),
    ],
)
def test_times_that_no_message_can_represent_are_refused_with_a_clear_error(tmp_path, time, words):
    assert words in refusal(radar_csv(tmp_path / "a.csv", f"time_ns,x_m,y_m\n{time},1,2\n"))


def test_the_folder_of_a_data_set_opens_its_contents(tmp_path, ros1, write, plain, jpeg):
    root = tmp_path / "drive"
    root.mkdir()
    images(root / "camera", ["a.png", "b.png"])
    radar_csv(root / "camera.csv", f"file,time_ns\na.png,{START_NS}\nb.png,{START_NS + 10**8}\n")
    radar_csv(root / "radar.csv", f"time_ns,x_m,y_m,z_m,doppler_mps\n{START_NS},1,2,3,0\n{START_NS},2,2,2,0\n")
    (root / "empty").mkdir()
    with open_recording(root) as recording:
        assert (recording.radar_topic, recording.image_topic) == ("/radar/radar", "/camera/image")
        assert recording.image_times.tolist() == [START_NS, START_NS + 10**8]
    write(ros1, plain(ros1, jpeg), name="drive/all")
    with open_recording(root) as recording:
        assert recording.radar_topic == "/radar/points"  # ROS recordings take precedence


# Folders of data sets: their images, radar and intrinsics are found, and what is not used is named.

K = np.array([[1495.47, 0, 961.27], [0, 1495.47, 624.9], [0, 0, 1]])
SIZE = (1936, 1216)


def image(path: Path, size_px: tuple[int, int] = SIZE) -> None:
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
    rows = np.random.default_rng(count).uniform(1, 9, (count, columns)).astype(np.float32)
    path.write_bytes((bin_rows("delft", count) if columns == 7 else rows).tobytes())


def view_of_delft(root: Path, count: int = 3) -> Path:
    for number in range(count):
        image(root / "radar" / "training" / "image_2" / f"{number:05}.jpg")
        floats_bin(root / "radar" / "training" / "velodyne" / f"{number:05}.bin", 5 + number, 7)
        floats_bin(root / "lidar" / "training" / "velodyne" / f"{number:05}.bin", 101 + number, 4)
        calib = root / "radar" / "training" / "calib" / f"{number:05}.txt"
        calib.parent.mkdir(exist_ok=True)
        calib.write_text(calib_text())
    return root


@pytest.mark.parametrize("inner", [".", "radar", "radar/training"])
def test_view_of_delft_brings_its_camera_and_names_its_pose(tmp_path, inner):
    root = view_of_delft(tmp_path / "view_of_delft")
    with open_recording(root / inner) as recording:
        camera = recording.camera()
        assert (recording.radar_topic, recording.image_topic) == ("/velodyne/radar", "/image_2/image")
        text = describe(recording)
        codes = {warning.code for warning in recording.warnings}
    np.testing.assert_allclose(camera.matrix_px, K)
    assert (camera.model, camera.width_px, camera.height_px) == ("pinhole", *SIZE)
    calib = root / inner / Path("radar/training" if inner == "." else "training" if inner == "radar" else ".") / "calib"
    assert f"its pose: --calibration {calib / '00000.txt'}" in text
    assert ("unused-files" in codes) == (inner == ".")
    assert "numbered-files" in codes
    if inner == ".":
        assert "velodyne (3 lidar clouds," in text


def test_intrinsics_that_differ_between_frames_are_told(tmp_path):
    root = view_of_delft(tmp_path / "drive")
    (root / "radar" / "training" / "calib" / "00002.txt").write_text(calib_text(K * [[1.1], [1.1], [1]]))
    with open_recording(root) as recording:
        warning = next(one for one in recording.warnings if one.code == "camera-changes")
    assert "have other intrinsics" in warning.facts["message"]


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
        image(drive / "image_02" / "data" / f"{number:010}.png", rect_size if rectified else size)
        floats_bin(drive / "velodyne_points" / "data" / f"{number:010}.bin", 99 + number, 4)
    stamps = "".join(f"2011-09-26 13:02:2{number}.964389445\n" for number in range(3))
    (drive / "image_02" / "timestamps.txt").write_text(stamps)
    (drive / "oxts").mkdir()
    (drive / "oxts" / "dataformat.txt").write_text("lat: latitude\n")
    return drive, rect if rectified else raw


@pytest.mark.parametrize("rectified", [True, False])
def test_raw_kitti_brings_its_camera_and_its_stamps(tmp_path, rectified):
    drive, matrix_px = kitti_raw(tmp_path, rectified=rectified)
    with open_recording(drive, require=("image",)) as recording:
        camera = recording.camera()
        assert recording.image_topic == "/image_02/image"
        assert recording.image_times[0] == 1_317_042_140_964_389_445
        assert "data (3 lidar clouds," in describe(recording)
    np.testing.assert_allclose(camera.matrix_px, matrix_px)
    assert camera.model == ("pinhole" if rectified else "plumb_bob")


def nuscenes_data_set(root: Path) -> Path:
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
                image(path.with_suffix(".jpg"), (160, 90))
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


def test_nuscenes_opens_at_its_front_with_the_camera_of_its_car(tmp_path):
    with open_recording(nuscenes_data_set(tmp_path / "nuscenes")) as recording:
        camera = recording.camera()
        assert (recording.radar_topic, recording.image_topic) == ("/RADAR_FRONT/radar", "/CAM_FRONT/image")
        assert recording.image_times[0] == 1_533_151_603_512_404_000
        assert {topic.name for topic in recording.topics} == {
            "/CAM_BACK/image",
            "/CAM_FRONT/image",
            "/RADAR_FRONT/radar",
        }
        text = describe(recording)
    np.testing.assert_allclose(np.diag(camera.matrix_px), [126.6 * 1.1, 126.6 * 1.1, 1.0])
    assert "LIDAR_TOP (3 lidar clouds" in text
    assert "sweeps (frames between" in text
    assert "records of CAM_FRONT" in text


def test_a_damaged_calibration_is_no_camera_and_no_crash(tmp_path):
    root = nuscenes_data_set(tmp_path / "nuscenes")
    (root / "v1.0-mini" / "calibrated_sensor.json").write_text('[{"token": 1}]')
    with open_recording(root) as recording:
        assert recording.camera() is None


# -- nothing vanishes
def test_many_files_of_one_kind_that_nobody_reads_are_one_entry(tmp_path):
    image(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    (tmp_path / "label_2").mkdir()
    for number in range(30):
        (tmp_path / "label_2" / f"{number:06}.txt").write_text("Car 0.00 0 1.85 387.63 181.54 423.81 203.12 1.67\n")
    with inspect_recording(tmp_path) as recording:
        (warning,) = recording.warnings
    assert "000000.txt (and 29" in warning.facts["message"]


def test_numbers_beside_real_times_are_an_assumption(tmp_path):
    for number in range(3):
        image(tmp_path / "camera" / f"{number}.png", (8, 8))
    (tmp_path / "radar.csv").write_text("time_s,x_m,y_m\n1.0,3,1\n1.2,3,1\n")
    with open_recording(tmp_path) as recording:
        (assumption,) = recording.assumptions
    assert (assumption.key, assumption.topic) == ("frame-interval", "/camera/image")


def test_what_a_folder_holds_and_nobody_reads_is_named(tmp_path):
    for number in range(3):
        image(tmp_path / "camera" / f"{START_NS + number}.png", (8, 8))
        image(tmp_path / "thumbnails" / f"{'abc'[number]}.png", (8, 8))
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    (tmp_path / "imu.csv").write_text("time_ns,gyro_x,gyro_y\n1,2,3\n")
    (tmp_path / "objects.json").write_text('{"boxes": "none"}')
    clicks = '{"id": "c1", "image_time": {"sec": 1, "nanosec": 2}, "pixel_px": [3, 4]}'
    (tmp_path / "clicks.json").write_text(f'{{"schema": "cocalib/clicks-1", "clicks": [{clicks}]}}')
    mixed = tmp_path / "mixed"
    image(mixed / f"{START_NS}.png", (8, 8))
    (mixed / "a.pcd").write_bytes(b"")
    (tmp_path / "sub" / "bag").mkdir(parents=True)
    (tmp_path / "sub" / "bag" / "a.bag").write_bytes(b"")
    with open_recording(tmp_path) as recording:
        assert (recording.radar_topic, recording.image_topic) == ("/radar/radar", "/camera/image")
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
    assert warning.facts["message"].startswith("6 files and folders ")
    for words in (
        "thumbnails (no times in the file names",
        "imu.csv (no position columns",
        "objects.json (no position columns",
        "clicks.json (this is a cocalib/clicks-1 file, not a recording; ",
        "mixed (the folder contains",
        "bag (a ROS recording; open it by its own path)",
    ):
        assert words in warning.facts["message"]


def test_images_with_wrong_checksums_are_named(tmp_path):
    for number in range(3):
        image(tmp_path / "camera" / f"{START_NS + number}.png", (8, 8))
    damaged = tmp_path / "camera" / f"{START_NS + 2}.png"
    data = damaged.read_bytes()
    damaged.write_bytes(data[:45] + bytes([data[45] ^ 1]) + data[46:])
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    with open_recording(tmp_path) as recording:
        assert len(recording.image_times) == 2
        (warning,) = (one for one in recording.warnings if one.code == "unreadable-pictures")
    assert f"{START_NS + 2}.png is a PNG " in warning.facts["message"]


@pytest.mark.parametrize(
    ("end", "words"),
    [(b"3,1\0\0\0\n", "has zero bytes between its characters"), (b"3,1\n14.5", "its last row is cut off")],
)
def test_a_damaged_scan_of_a_folder_of_tables_is_refused_and_not_shortened_in_silence(tmp_path, end, words):
    for number in range(3):
        image(tmp_path / "camera" / f"{START_NS + number}.png", (8, 8))
        (tmp_path / "radar").mkdir(exist_ok=True)
        (tmp_path / "radar" / f"{START_NS + number}.csv").write_bytes(b"x_m,y_m\n" + (end if number == 1 else b"3,1\n"))
    with pytest.raises(RecordingError, match=words), open_recording(tmp_path) as recording:
        recording.radar_scans()


def test_ranges_and_angles_that_are_none_are_lost_and_counted(tmp_path):
    rows = [f"{START_NS + place * 10**8},{range_m},{azimuth}" for place, (range_m, azimuth) in
            enumerate([(5, 10), (-5, 10), (5, 900), (6, -30)])]  # fmt: skip
    path = radar_csv(tmp_path / "a.csv", "\n".join(["time_ns,range_m,azimuth_deg", *rows]) + "\n")
    with open_recording(path, require=("radar",)) as recording:
        recording.radar_scans()
        assert (2, 4) in [
            (one.facts["lost"], one.facts["read"]) for one in recording.warnings if one.code == "lost-returns"
        ]


def test_what_holds_no_returns_is_named_for_what_it_is(tmp_path):
    """As in Oxford Radar RobotCar, RadarScenes, CARRADA and Dual Radar: echoes, arrays, other floats, times of no known unit."""
    rng = np.random.default_rng(3)
    for number in range(4):
        image(tmp_path / "stereo" / f"{START_NS // 1000 + number * 62_500}.png", (8, 8))
        image(tmp_path / "radar" / f"{START_NS // 1000 + number * 250_000}.png", (8, 8))
        image(tmp_path / "documentary" / f"{156_862_647_501 + number * 100_000}.jpg", (8, 8))
        rows = np.column_stack([*rng.uniform(3, 30, (3, 90)), rng.normal(0, 2, (5, 90)).T]).astype("<f4")
        (tmp_path / "ars548").mkdir(exist_ok=True)
        (tmp_path / "ars548" / f"{number:06}.bin").write_bytes(rows.tobytes())
    (tmp_path / "maps").mkdir()
    np.save(tmp_path / "maps" / "000000.npy", np.zeros((4, 4)))
    (tmp_path / "calib").mkdir()
    (tmp_path / "calib" / "000000.txt").write_text("P2: 1 2 3\n")
    with inspect_recording(tmp_path) as recording:
        assert (recording.image_topic, recording.radar_topic) == ("/stereo/image", None)
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
    for words in (
        "radar (4 images of a radar's echoes by its name",
        "documentary (no times in the file names",
        "ars548 (its 4 .bin files fit no layout of radar returns",
        "maps (1 .npy files, which are not read",
        "calib (calibrations of no images found; ",
    ):
        assert words in warning.facts["message"]


def test_a_link_to_a_folder_above_is_named_and_not_followed(tmp_path):
    image(tmp_path / "drive" / "camera" / f"{START_NS}.png", (8, 8))
    radar_csv(tmp_path / "drive" / "radar.csv", f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    (tmp_path / "drive" / "again").symlink_to(tmp_path / "drive")
    with open_recording(tmp_path / "drive") as recording:
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
        assert len(recording.sources) == 2
    assert "again (a link " in warning.facts["message"]


def test_a_image_that_is_no_file_is_named(tmp_path):
    for number in range(3):
        image(tmp_path / "camera" / f"{START_NS + number}.png", (8, 8))
    (tmp_path / "camera" / f"{START_NS + 9}.png").mkdir()
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    with open_recording(tmp_path) as recording:
        assert len(recording.image_times) == 3
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
    assert f"{START_NS + 9}.png (a broken link" in warning.facts["message"]


def test_a_table_that_is_a_broken_link_is_named_and_one_that_cannot_be_read_is_an_error_of_ours(tmp_path, monkeypatch):
    for number in range(3):
        (tmp_path / f"{START_NS + number}.csv").write_text("x_m,y_m\n3,1\n")
    (tmp_path / f"{START_NS + 9}.csv").symlink_to(tmp_path / "nowhere")
    with inspect_recording(tmp_path) as recording:
        assert len(recording.radar_scans()) == 3
        (warning,) = (one for one in recording.warnings if one.code == "unused-files")
    assert f"{START_NS + 9}.csv (a broken link" in warning.facts["message"]

    def refused(path: Path, *_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "open", refused)
    with pytest.raises(RecordingError, match="cannot be read: Permission denied"):
        inspect_recording(tmp_path)


def test_a_cut_off_jpeg_is_told_and_shown(tmp_path):
    for number in range(3):
        image(tmp_path / "camera" / f"{START_NS + number}.jpg", (64, 64))
    cut = tmp_path / "camera" / f"{START_NS + 1}.jpg"
    cut.write_bytes(cut.read_bytes()[:-20])
    with inspect_recording(tmp_path / "camera") as recording:
        assert len(recording.image_times) == 3
        (warning,) = (one for one in recording.warnings if one.code == "unreadable-pictures")
    assert f"the first: {cut.name}" in warning.facts["message"]


def test_a_long_list_of_unused_files_is_cut(tmp_path):
    image(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    for number in range(20):
        (tmp_path / f"log{'abcdefghijklmnopqrst'[number]}.csv").write_text("a,b\n1,2\n")
    with inspect_recording(tmp_path) as recording:
        (warning,) = recording.warnings
    assert "20 files and folders " in warning.facts["message"]
    assert warning.facts["message"].endswith("; and 14 more")


def test_a_missing_radar_is_explained_by_the_file_that_could_not_be_used(tmp_path):
    image(tmp_path / "camera" / f"{START_NS}.png", (8, 8))
    (tmp_path / "radar.csv").write_text("time_ns,links,rechts\n1,2,3\n")
    with pytest.raises(RecordingError) as caught:
        open_recording(tmp_path)
    assert "no readable radar topic" in str(caught.value)
    assert "radar.csv (no position columns" in str(caught.value)


def test_a_radar_table_beside_the_images_is_found(tmp_path):
    for number in range(2):
        image(tmp_path / f"{START_NS + number * NS_PER_S}.png", (8, 8))
    (tmp_path / "radar.csv").write_text(f"time_ns,x_m,y_m\n{START_NS},3,1\n")
    with open_recording(tmp_path) as recording:
        assert recording.radar_topic == "/radar/radar"
