"""Recordings that are still being written: opened once there is enough, grown without renumbering, judged at the end."""

import random
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.recordings import AwaitedRecording, FollowedRecording, open_recording
from tests.unit.recordings.containers.growing_files import LoggedDatabase, Replay, write_in_chunks

DEADLINE_S = 60.0


def contents(recording):
    frames = [recording.image_bytes(index).data for index in range(len(recording.image_times))]
    return recording.image_times.tolist(), frames, recording.radar_scans()


def is_the_same(recording, path) -> bool:
    with open_recording(path) as whole:
        (times, frames, scans), (other_times, other_frames, other_scans) = contents(recording), contents(whole)
        assert times == other_times
        assert frames == other_frames
        assert np.array_equal(scans.times_ns, other_scans.times_ns)
        assert np.array_equal(scans.points_radar_m, other_scans.points_radar_m, equal_nan=True)
        assert recording.camera() == whole.camera() or recording.camera().matrix_px.tolist() == (
            whole.camera().matrix_px.tolist()
        )
        return recording.fingerprint()[0].sha256 == whole.fingerprint()[0].sha256


def opened(path: Path) -> FollowedRecording:
    recording = AwaitedRecording([path]).look()
    assert recording is not None
    return recording


@pytest.fixture
def follow(tmp_path, ros2):
    """Return the function that opens a recording of rows when a share of it is written, and its writer."""
    growing, followed = tmp_path / "drive.mcap", []

    def begin(rows, share):
        finished = write_in_chunks(tmp_path / "whole", ros2, rows, "mcap", per_chunk=3)
        replay = Replay(finished, growing)
        replay.write_up_to(round(len(replay) * share))
        followed.append(opened(growing))
        return followed[0], replay, finished

    yield begin
    for one in followed:
        one.close()


@pytest.mark.parametrize("container", ["bag", "bag-bz2", "mcap", "mcap-zstd"])
def test_the_followed_recording_equals_the_finished_one(tmp_path, container_ros, container, plain, jpeg):
    finished = write_in_chunks(
        tmp_path / "whole", container_ros, plain(container_ros, jpeg, n=50), container, per_chunk=7
    )
    growing, sizes = tmp_path / f"drive{finished.suffix}", random.Random(1)
    awaited, replay, recording = AwaitedRecording([growing]), Replay(finished, growing), None
    given: list[int] = []
    while replay.place < len(replay) - 1:
        replay.write_up_to(min(replay.place + sizes.randint(1, 12_000), len(replay) - 1))
        if recording is None:
            recording = awaited.look()
            continue
        before = len(given)
        growth = recording.grow()
        assert recording.image_times[:before].tolist() == given
        given = recording.image_times.tolist()
        assert len(given) - before == growth.frames or not before
    replay.finish()
    assert not recording.is_complete
    assert recording.grow().completed
    assert recording.is_complete
    assert not recording.grow().completed
    assert is_the_same(recording, finished)
    assert recording.warnings == ()
    recording.close()


def test_a_database_is_followed_by_its_log(tmp_path, ros2, plain, jpeg):
    path = tmp_path / "drive.db3"
    database, rows = LoggedDatabase(path, ros2), plain(ros2, jpeg, n=50)
    database.write(rows[:90])
    recording = opened(path)
    recording.fingerprint()  # of what is there so far
    for first in range(90, 150, 9):
        database.write(rows[first : first + 9])
        assert recording.grow().messages == len(rows[first : first + 9])
    database.close()
    assert recording.grow().completed
    assert is_the_same(recording, path)
    recording.close()


@pytest.mark.parametrize("container", ["mcap"])
def test_a_recording_is_waited_for_until_there_is_enough_of_it(tmp_path, container_ros, plain, jpeg):
    rows = plain(container_ros, jpeg, n=40)
    finished = write_in_chunks(tmp_path / "whole", container_ros, rows, "mcap", per_chunk=3)
    growing = tmp_path / "drive.mcap"
    awaited = AwaitedRecording([growing])
    assert awaited.look() is None
    assert awaited.missing.startswith("drive.mcap has not")
    replay = Replay(finished, growing)
    replay.write_up_to(20_000)
    assert awaited.look() is None
    assert awaited.missing.startswith("less than 3 s")
    replay.finish()
    recording = awaited.look()
    assert recording.is_complete
    recording.close()


@pytest.mark.parametrize("container", ["mcap"])
def test_a_sensor_that_never_comes_is_waited_for_and_told_at_the_end(tmp_path, container_ros, plain, jpeg):
    rows = [row for row in plain(container_ros, jpeg, n=40) if row[0] != "/radar/points"]
    finished = write_in_chunks(tmp_path / "whole", container_ros, rows, "mcap", per_chunk=3)
    growing = tmp_path / "drive.mcap"
    awaited, replay = AwaitedRecording([growing]), Replay(finished, growing)
    replay.write_up_to(len(replay) // 2)
    assert awaited.look() is None
    assert re.match("no radar messages .*/camera/camera_info", awaited.missing)
    replay.finish()
    with pytest.raises(RecordingError, match="no readable radar topic"):
        awaited.look()
    awaited.close()


def test_a_frame_that_comes_late_does_not_move_the_others(follow, ros2, plain, jpeg):
    rows = plain(ros2, jpeg, n=40)
    early, late = 31, 94  # the same frame, at its place and three seconds later
    rows.insert(late, rows.pop(early))
    rows[late - 1] = (rows[late - 1][0], rows[late - 2][1] + 1, rows[late - 1][2])
    recording, replay, finished = follow(rows, 3 / 4)
    given = recording.image_times.tolist()
    replay.finish()
    recording.grow()
    assert recording.image_times[: len(given)].tolist() == given
    assert recording.late == 1
    (warning,) = [one for one in recording.warnings if one.code == "late-frames"]
    assert "1 frame" in warning.facts["message"]
    with open_recording(finished) as whole:
        assert len(whole.image_times) == len(recording.image_times) + 1


def test_the_camera_that_was_chosen_stays_although_another_gets_more_frames(follow, ros2, plain, jpeg):
    rows = [row for row in plain(ros2, jpeg, n=60) if row[0] != "/camera/camera_info"]
    stamps = [rows[90][1] + 15_000_000 * number for number in range(80)]
    rows += [("/aside/image/compressed", stamp, ros2.compressed(stamp, jpeg)) for stamp in stamps]
    rows.sort(key=lambda row: row[1])
    recording, replay, finished = follow(rows, 1 / 3)
    replay.finish()
    recording.grow()
    with open_recording(finished) as whole:
        assert whole.image_topic == "/aside/image/compressed"
    assert recording.image_topic == "/camera/image/compressed"
    assert len(recording.image_times) == 60


@pytest.mark.parametrize("container", ["mcap"])
def test_what_recording_toml_states_is_followed(tmp_path, container_ros, plain, jpeg):
    rows = plain(container_ros, jpeg, n=50)
    path = write_in_chunks(tmp_path / "drive", container_ros, rows, "mcap", per_chunk=7)
    path.with_name("recording.toml").write_text('clock = "receive"\n')
    recording = opened(path)
    assert (recording.image_clock, recording.radar_clock) == ("receive", "receive")
    assert recording.recording_file.endswith('recording.toml: clock = "receive"')
    assert "recording.toml" in [file.name for file in recording.fingerprint()]
    recording.close()


def test_a_clock_that_would_be_chosen_otherwise_is_told_at_the_end(follow, ros2, plain, jpeg):
    rows = plain(ros2, jpeg, n=60)
    lost = [number for number, row in enumerate(rows) if row[0] == "/camera/image/compressed"][40:]
    for number in lost:
        rows[number] = (*rows[number][:2], ros2.compressed(0, jpeg))
    recording, replay, _ = follow(rows, 1 / 2)
    given = recording.image_times.tolist()
    replay.finish()
    recording.grow()
    assert recording.image_times[: len(given)].tolist() == given
    assert recording.image_clock == "header"
    (warning,) = [one for one in recording.warnings if one.code == "clock-chosen-early"]
    assert "/camera/image/compressed (receive" in warning.facts["message"]


@pytest.mark.parametrize("container", ["mcap"])
def test_frames_of_a_split_file_follow_those_of_the_first(tmp_path, container_ros, plain, jpeg):
    folder = tmp_path / "drive"
    folder.mkdir()
    rows = plain(container_ros, jpeg, n=60)
    parts = [
        write_in_chunks(tmp_path / f"drive_{n}", container_ros, part, "mcap", per_chunk=4)
        for n, part in enumerate((rows[:90], rows[90:]))
    ]
    shutil.copyfile(parts[0], folder / "drive_0.mcap")
    recording = opened(folder)
    assert len(recording.image_times) == 30
    shutil.copyfile(parts[1], folder / "drive_1.mcap")
    growth = recording.grow()
    assert (growth.frames, growth.scans) == (30, 30)
    assert not recording.is_complete
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert recording.grow().completed
    assert len(contents(recording)[1]) == 60
    recording.close()


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, "it never came"


@pytest.mark.slow
def test_what_a_killed_writer_has_written_stays(tmp_path, project_root):
    path = tmp_path / "drive.mcap"
    writing = subprocess.Popen([sys.executable, "-m", "tests.growing_recording", path, "40", "0.7"], cwd=project_root)
    try:
        awaited = AwaitedRecording([path])
        found: list[FollowedRecording] = []
        until(lambda: bool(found or ((one := awaited.look()) and not found.append(one))))
        recording = found[0]
        until(lambda: recording.grow().frames >= 0 and len(recording.image_times) > 60)
    finally:
        writing.kill()
        writing.wait()
    recording.grow()
    assert not recording.is_complete
    assert recording.grow().messages == 0
    with path.open("ab") as file:
        file.write(b"\x06\xff\xff\x00\x00\x00\x00\x00\x00 the head of a chunk that was never finished")
    assert recording.grow().messages == 0
    with open_recording(path) as again:
        assert again.image_times.tolist() == recording.image_times.tolist()
        assert again.radar_times.tolist() == recording.radar_times.tolist()
    recording.close()
