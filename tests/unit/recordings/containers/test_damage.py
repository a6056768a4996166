"""Truncated, damaged, unclosed and malicious files."""

import os
import random
import shutil
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import describe, first_picture, inspect_recording, open_recording
from calib_core.recordings.containers.compression import unpack, unpack_message

START_NS = 1_700_000_000 * NS_PER_S


def contents(path):
    with open_recording(path) as recording:
        scans = recording.radar_scans()
        frames = [recording.image_bytes(i).data for i in range(len(recording.image_times))]
        return scans, frames, {warning.code: warning.message for warning in recording.warnings}


@pytest.mark.parametrize("container", ["bag", "bag-lz4", "bag-bz2"])
def test_a_bag_that_was_never_closed_gives_all_its_messages_with_a_warning(container, ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg, n=60), container)
    scans, frames, warnings = contents(path)
    assert warnings == {}
    raw = bytearray(path.read_bytes())
    place = raw.index(b"index_pos=") + len(b"index_pos=")
    end = struct.unpack_from("<Q", raw, place)[0]
    raw[place : place + 8] = bytes(8)
    path.write_bytes(raw[:end])
    recovered, same_frames, warnings = contents(path)
    np.testing.assert_array_equal(recovered.points_radar_m, scans.points_radar_m)
    np.testing.assert_array_equal(recovered.times_ns, scans.times_ns)
    assert same_frames == frames
    assert list(warnings) == ["not-closed"]
    assert "180 complete messages were recovered" in warnings["not-closed"]


@pytest.mark.parametrize("container", ["bag", "bag-lz4", "bag-bz2", "mcap", "mcap-zstd"])
@pytest.mark.parametrize("share", [0.5, 0.9, 0.999])
def test_a_copy_cut_short_gives_a_part_of_the_messages_or_refuses_but_never_silently(
    container, share, ros1, ros2, write, plain, jpeg
):
    ros = ros1 if container.startswith("bag") else ros2
    path = write(ros, plain(ros, jpeg, n=60), container)
    scans, frames, _ = contents(path)
    raw = path.read_bytes()
    path.write_bytes(raw[: int(len(raw) * share)])
    try:
        part, some_frames, warnings = contents(path)
    except RecordingError as error:
        assert "repair it first" in str(error) or "no readable radar topic" in str(error)  # noqa: PT017
        return
    assert "not-closed" in warnings
    assert 0 < len(part) <= len(scans)
    np.testing.assert_array_equal(part.points_radar_m, scans.points_radar_m[: len(part.points_radar_m)])
    assert some_frames == frames[: len(some_frames)]


def test_a_cut_uncompressed_bag_loses_only_what_was_cut(ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg, n=60))
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) // 2])
    scans, frames, warnings = contents(path)
    per_message = raw.index(b"index_pos=") and len(raw) / 180
    assert 3 * len(frames) > len(raw) / 2 / per_message * 0.8
    assert len(scans) >= len(frames)
    assert "not-closed" in warnings


@pytest.mark.parametrize("container", ["bag-bz2", "mcap-zstd"])
def test_a_damaged_chunk_loses_only_its_own_messages_with_a_warning(container, ros1, ros2, write, plain, jpeg):
    ros = ros1 if container.startswith("bag") else ros2
    rows = plain(ros, jpeg, n=900)
    path = write(ros, rows, container)
    with open_recording(path) as recording:
        chunks = recording.sources[0].chunks  # type: ignore[attr-defined]
        assert len(chunks) > 2
        middle = chunks[1]
        whole = recording.radar_scans()
    raw = bytearray(path.read_bytes())
    raw[middle.position + 40 : middle.position + 200] = b"\xa5" * 160
    path.write_bytes(raw)
    with open_recording(path) as recording:
        codes = [warning.code for warning in recording.warnings]
        assert set(codes) == {"unreadable-messages", "islands"}
        assert "of 900 messages of /radar/points cannot be read and are skipped" in recording.warnings[0].message
        scans = recording.radar_scans()
        assert 100 < len(scans) < 900
        kept = np.isin(whole.times_ns, scans.times_ns)
        np.testing.assert_array_equal(whole.times_ns[kept], scans.times_ns)
        assert recording.image_bytes(0).data == jpeg
        assert recording.image_bytes(len(recording.image_times) - 1).data == jpeg


def crashed(write, ros2, rows, folder) -> Path:
    """Leave what a killed recorder leaves: a database whose rows are still in the -wal file."""
    path = write(ros2, rows, "db3")
    with sqlite3.connect(path) as database:
        found = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
        database.execute("DELETE FROM messages")
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("PRAGMA wal_autocheckpoint=0")
    with database:
        database.executemany("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", found)
    folder.mkdir()
    for suffix in ("", "-wal"):
        shutil.copy(f"{path}{suffix}", folder / f"left.db3{suffix}")
    database.close()
    assert (folder / "left.db3-wal").stat().st_size > 1000
    return folder / "left.db3"


@contextmanager
def only_readable(folder: Path) -> Iterator[None]:
    """Remove the permission to write into a folder, even for root, by temporarily becoming the user nobody."""
    root = os.geteuid() == 0
    folder.chmod(0o555)
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)
        folder.chmod(0o755)


def test_messages_in_a_write_ahead_log_are_read(ros2, write, plain, jpeg, tmp_path):
    with open_recording(crashed(write, ros2, plain(ros2, jpeg), tmp_path / "crashed")) as recording:
        assert len(recording.image_times) == len(recording.radar_times) == 20


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="rights of folders are those of POSIX")
def test_a_write_ahead_log_is_read_from_a_read_only_folder(ros2, write, plain, jpeg):
    with TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        path = crashed(write, ros2, plain(ros2, jpeg), Path(name) / "crashed")
        before = {file.name: file.read_bytes() for file in path.parent.iterdir()}
        with open_recording(path):
            pass  # loads every module, which the user nobody may not be allowed to read
        for file in set(path.parent.iterdir()) - {path.parent / each for each in before}:
            file.unlink()
        with only_readable(path.parent):
            with pytest.raises(PermissionError):
                (path.parent / "new").touch()
            with open_recording(path) as recording:
                assert len(recording.image_times) == len(recording.radar_times) == 20
                assert len(recording.image_bytes(19).data) == len(jpeg)
                (file,) = recording.fingerprint()
                assert file.name == "left.db3"
        assert {file.name: file.read_bytes() for file in path.parent.iterdir()} == before


def test_a_database_that_is_not_a_bag_is_refused(tmp_path):
    path = tmp_path / "other.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE people (name TEXT)")
    database.close()
    with pytest.raises(RecordingError, match=r"without the tables of a ROS 2 bag \(messages, topics\)"):
        inspect_recording(path)


def test_a_chunk_that_declares_gigabytes_is_refused_before_it_is_unpacked(ros1, write, plain, jpeg):
    path = write(ros1, plain(ros1, jpeg), "bag-bz2")
    raw = bytearray(path.read_bytes())
    place = raw.index(b"size=", raw.index(b"compression=bz2") - 40)
    raw[place + 5 : place + 9] = struct.pack("<I", 3 * 2**30)
    path.write_bytes(raw)
    with pytest.raises(RecordingError, match=r"declares 3072 MiB; compressed chunks over 256 MiB are refused"):
        open_recording(path)


@pytest.mark.parametrize("kind", ["bz2", "lz4", "zstd"])
def test_a_chunk_is_never_unpacked_to_more_than_it_declares(kind):
    import bz2

    import lz4.frame
    from rosbags.rosbag2.storage_mcap import zstd

    bomb = {"bz2": bz2.compress, "lz4": lz4.frame.compress, "zstd": zstd.compress}[kind](bytes(5_000_000))
    assert unpack(bomb, kind, 1000, where="x") == bytes(1000)
    with pytest.raises(RecordingError, match="decompresses to 5000000 bytes, but 6000000 are declared"):
        unpack(bomb, kind, 6_000_000, where="x")
    with pytest.raises(RecordingError, match="damaged"):
        unpack(b"\0" * 50, kind, 100, where="x")


def test_a_message_of_its_own_frame_is_unpacked_whole_or_refused():
    from rosbags.rosbag2.storage_mcap import zstd

    data = zstd.compress(b"hello" * 100)
    assert unpack_message(data, where="x") == b"hello" * 100
    with pytest.raises(RecordingError, match="truncated"):
        unpack_message(data[:-3], where="x")


def test_random_damage_is_answered_with_values_or_one_clear_error(
    container, container_ros, write, plain, jpeg, tmp_path
):
    """Flipped bits, removed bytes and inflated lengths raise nothing but RecordingError, and nothing hangs."""
    path = write(container_ros, plain(container_ros, jpeg, n=6), container)
    raw = path.read_bytes()
    rng = random.Random(container)
    refused = 0
    for number in range(25):
        data = bytearray(raw)
        place = rng.randrange(len(data))
        kind = number % 4
        if kind == 0:
            data[place] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[place:]
        elif kind == 2:
            data[place : place + 4] = b"\xff\xff\xff\x7f"
        else:
            del data[place : place + rng.randrange(1, 200)]
        damaged = tmp_path / f"damaged{number}{path.suffix}"
        damaged.write_bytes(data)
        first_picture([damaged])
        try:
            with inspect_recording(damaged) as recording:
                recording.radar_scans()
                describe(recording)
                for index in range(len(recording.image_times)):
                    recording.image_bytes(index)
        except RecordingError as error:
            refused += 1
            assert len(str(error)) > 40  # noqa: PT017
    assert refused < 25
