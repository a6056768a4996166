"""Files that are still being written: every complete message is found once, and nothing else."""

import os
import random
import shutil
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from calib_core.errors import RecordingError
from calib_core.recordings.containers.following import FollowedFiles
from calib_core.recordings.containers.mcap.records import DATA_END, MAGIC, MESSAGE, walk
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.containers.positioned_reads import MemoryStretch
from tests.unit.recordings.containers.growing_files import LoggedDatabase, Replay, messages_of, write_in_chunks
from tests.unit.recordings.containers.mcap_writing import mcap

CONTAINERS = ("bag", "bag-lz4", "bag-bz2", "mcap", "mcap-zstd", "mcap-lz4", "mcap-unchunked")


@pytest.fixture(params=CONTAINERS)
def container(request) -> str:
    return str(request.param)


@pytest.fixture
def finished(tmp_path, container_ros, container, plain, jpeg) -> Path:
    """Return a finished file of about a dozen chunks."""
    rows = plain(container_ros, jpeg[:400], n=8)
    if container in ("mcap-lz4", "mcap-unchunked"):
        path = tmp_path / "whole.mcap"
        unchunked = container == "mcap-unchunked"
        path.write_bytes(
            mcap(container_ros, rows, chunked=not unchunked, compression="" if unchunked else "lz4", chunk_rows=2)
        )
        return path
    return write_in_chunks(tmp_path / "whole", container_ros, rows, container, per_chunk=2)


def opened(path: Path):
    (source,) = open_sources([path])
    try:
        return messages_of((source,))
    finally:
        source.close()


def is_beginning(part, whole) -> bool:
    return all(rows == whole[topic][: len(rows)] for topic, rows in part.items())


def test_a_file_cut_anywhere_gives_its_complete_messages(finished, tmp_path):
    """Record boundaries, and positions inside records: every 61st byte, and the last hundred one by one."""
    whole = opened(finished)
    growing = tmp_path / f"growing{finished.suffix}"
    files, replay = FollowedFiles([growing]), Replay(finished, growing)
    count = 0
    cuts = [*range(1, len(replay) - 100, 61), *range(len(replay) - 100, len(replay))]
    for number, cut in enumerate(cuts):
        replay.write_up_to(cut)
        count += files.grow()
        assert not files.is_complete
        if number % 50 == 0:
            assert is_beginning(messages_of(files.sources), whole)
    replay.finish()
    count += files.grow()
    assert files.is_complete
    assert messages_of(files.sources) == whole
    assert count == sum(map(len, whole.values()))
    assert files.grow() == 0
    files.close()


@pytest.mark.slow
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**31), largest=st.sampled_from([50, 700, 4000, 50_000]))
def test_pieces_of_any_size_give_the_index_of_the_finished_file(finished, tmp_path, seed, largest):
    sizes = random.Random(seed)
    growing = tmp_path / f"piecewise{finished.suffix}"
    growing.unlink(missing_ok=True)
    files, replay = FollowedFiles([growing]), Replay(finished, growing)
    while replay.place < len(replay):
        replay.write_up_to(min(len(replay), replay.place + sizes.randint(1, largest)))
        files.grow()
    replay.finish()
    files.grow()
    assert messages_of(files.sources) == opened(finished)
    files.close()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda path: os.truncate(path, path.stat().st_size // 2), "truncated to"),
        (lambda path: path.write_bytes(bytes(2 * path.stat().st_size)), "overwritten"),
        (lambda path: shutil.copyfile(path, path.with_name("other")).replace(path), "replaced by another file"),
        (lambda path: path.rename(path.with_name("elsewhere")), "no longer there"),
    ],
    ids=["truncated", "overwritten", "replaced", "moved away"],
)
def test_a_file_that_does_not_grow_as_it_should_is_refused_and_what_was_read_stays(finished, tmp_path, change, words):
    growing = tmp_path / f"growing{finished.suffix}"
    files, replay = FollowedFiles([growing]), Replay(finished, growing)
    replay.write_up_to(len(replay) // 2)
    files.grow()
    replay.kill()
    change(growing)
    with pytest.raises(RecordingError, match=words):
        files.grow()
    assert any(len(source.index(channel.id)) for source in files.sources for channel in source.channels)
    files.close()


@pytest.mark.parametrize("container", ["bag"])
def test_a_bag_renamed_when_it_is_closed_stays_the_same_file(finished, tmp_path):
    bag, active = tmp_path / "drive.bag", tmp_path / "drive.bag.active"
    for path in (bag, active):
        files, replay = FollowedFiles([path]), Replay(finished, active)
        replay.write_up_to(len(replay) // 2)
        files.grow()
        replay.finish()
        active.rename(bag)
        files.grow()
        assert files.is_complete
        assert files.sources[0].path == bag
        assert messages_of(files.sources) == opened(finished)
        files.close()
        bag.unlink()


@pytest.mark.parametrize("container", ["bag"])
def test_an_open_chunk_of_the_ros_recorder_is_waited_for(finished, tmp_path):
    """rosbag record writes a chunk's header with sizes of 0, and the messages after it, and replaces the header at the end."""
    whole = finished.read_bytes()
    start = whole.index(b"op=\x05") - 8
    length = int.from_bytes(whole[start : start + 4], "little")
    header = whole[start + 4 : start + 4 + length]
    empty = header[: header.index(b"size=") + 5] + bytes(4) + header[header.index(b"size=") + 9 :]
    growing = tmp_path / "open.bag"
    growing.write_bytes(
        whole[:start] + whole[start : start + 4] + empty + bytes(4) + whole[start + 8 + length : start + 900]
    )
    files = FollowedFiles([growing])
    assert files.grow() == 0
    growing.write_bytes(whole)
    files.grow()
    assert messages_of(files.sources) == opened(finished)
    files.close()


@pytest.mark.parametrize("container", ["mcap-unchunked"])
def test_a_message_is_found_as_soon_as_its_last_byte_is_written(finished, tmp_path):
    growing = tmp_path / "growing.mcap"
    files, replay = FollowedFiles([growing]), Replay(finished, growing)
    for kind, start, size in walk(MemoryStretch(finished.read_bytes()), len(MAGIC)):
        if kind == DATA_END:
            break
        replay.write_up_to(start + size)
        assert files.grow() == (kind == MESSAGE)
    replay.kill()
    files.close()


@pytest.mark.parametrize("container", ["mcap"])
def test_space_that_is_not_filled_yet_is_waited_for(finished, tmp_path):
    growing = tmp_path / "zeros.mcap"
    whole = finished.read_bytes()
    growing.write_bytes(whole[:8] + bytes(500))
    files = FollowedFiles([growing])
    assert files.grow() == 0
    growing.write_bytes(whole)
    files.grow()
    assert messages_of(files.sources) == opened(finished)
    files.close()


@pytest.mark.parametrize("container", ["mcap", "bag"])
def test_damage_in_the_middle_ends_the_following_in_words(finished, tmp_path):
    growing = tmp_path / f"damaged{finished.suffix}"
    whole = finished.read_bytes()
    half = len(whole) // 2
    files, replay = FollowedFiles([growing]), Replay(finished, growing)
    replay.write_up_to(half)
    files.grow()
    replay.kill()
    with growing.open("ab") as file:
        file.write(b"\xaa" * 5_000_000)
    with pytest.raises(RecordingError, match="no record at byte"):
        files.grow()
    files.close()


def test_uncommitted_rows_are_waited_for(tmp_path, ros2, plain, jpeg):
    path = tmp_path / "drive.db3"
    database = LoggedDatabase(path, ros2)
    rows = plain(ros2, jpeg, n=4)
    database.write(rows[:6])
    files = FollowedFiles([path])
    assert files.grow() == 6
    database._database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 5, x'00')")
    assert files.grow() == 0
    database._database.rollback()
    database.write(rows[6:])
    assert files.grow() == 6
    database.close()
    files.close()


def test_a_database_without_a_log_is_refused_because_reading_could_hold_the_recorder_up(
    tmp_path, ros2, plain, jpeg, write
):
    path = write(ros2, plain(ros2, jpeg), "db3")
    files = FollowedFiles([path])
    with pytest.raises(RecordingError, match=r"without a write-ahead log.*resilient"):
        files.grow()


def test_other_files_cannot_be_followed(tmp_path):
    with pytest.raises(RecordingError, match=r"radar\.csv: cannot be followed"):
        FollowedFiles([tmp_path / "radar.csv"])
    path = tmp_path / "text.mcap"
    path.write_text("no recording, " * 20)
    with pytest.raises(RecordingError, match="begins as neither"):
        FollowedFiles([path]).grow()
