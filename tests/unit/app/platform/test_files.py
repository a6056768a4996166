"""A file is written whole or not at all; links are followed, devices and pipes are written to."""

import os
import threading

import pytest

from cocalib.platform.files import write_whole


def test_a_link_is_followed_and_stays(tmp_path):
    (tmp_path / "target").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_whole(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"


@pytest.mark.skipif(os.name == "nt", reason="no named pipes in the file system")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    pipe, got = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"through")
    reader.join(60)
    assert got == [b"through"]
    assert pipe.is_fifo()


@pytest.mark.parametrize(("name", "words"), [(".", "is a folder"), ("nowhere/x.json", "does not exist; create it")])
def test_a_path_that_cannot_be_a_file_is_refused(tmp_path, name, words):
    with pytest.raises(OSError, match=words):
        write_whole(tmp_path / name, b"x")
    assert list(tmp_path.iterdir()) == []
