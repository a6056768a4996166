"""Truncated, damaged, unclosed and malicious files."""

import os
import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from calib_core.errors import RecordingError
from calib_core.recordings import open_recording
from calib_core.recordings.containers.compression import unpack, unpack_message
from tests.unit.recordings.containers.damage import KINDS, outcomes
from tests.unit.recordings.containers.malformed import FRAMES, Kit, db3_with_a_log_left_over


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


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="rights of folders are those of POSIX")
def test_a_write_ahead_log_is_read_from_a_read_only_folder(jpeg):
    with TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        (Path(name) / "crashed").mkdir()
        path = db3_with_a_log_left_over(Kit(Path(name) / "crashed", jpeg))
        before = {file.name: file.read_bytes() for file in path.parent.glob("left*")}
        with open_recording(path):
            pass  # loads every module, which the user nobody may not be allowed to read
        for file in set(path.parent.glob("left*")) - {path.parent / each for each in before}:
            file.unlink()
        with only_readable(path.parent):
            with pytest.raises(PermissionError):
                (path.parent / "new").touch()
            with open_recording(path) as recording:
                assert len(recording.image_times) == len(recording.radar_times) == FRAMES
                assert recording.image_bytes(19).data == jpeg
                (file,) = recording.fingerprint()
                assert file.name == "left.db3"
        assert {file.name: file.read_bytes() for file in path.parent.glob("left*")} == before


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


# No damaged recording loses a message that can be read, by brute force or by rosbags, without a word.


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_messages_that_can_be_read_are_given_or_their_loss_is_told(kind, tmp_path):
    found = list(outcomes(kind, tmp_path, random.Random(kind), 80))
    assert len(found) > 70
    assert [one for one in found if one.silent] == []
    assert any(not one.told for one in found) or "no-summary" in kind
    assert sum(one.lost == 0 for one in found) > 0.4 * len(found)


def test_the_oracles_find_what_is_there(tmp_path):
    """An oracle that finds nothing would agree with everything."""
    from tests.unit.recordings.containers.damage import read_by_rosbags, read_by_us, sound

    for kind in KINDS:
        file = sound(kind, tmp_path)
        path = tmp_path / f"copy.{kind.partition('-')[0]}"
        path.write_bytes(file.data)
        assert file.readable(file.data) == file.messages.keys()
        found, told = read_by_us(path)
        assert (found, told) == (file.messages.keys(), [])
        if kind in ("bag", "bag-bz2", "mcap", "mcap-lz4"):
            assert read_by_rosbags(path) == file.messages.keys(), kind
