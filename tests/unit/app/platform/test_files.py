"""A file is written whole or not at all; links are followed, devices and pipes are written to."""

import os
import stat
import threading

import pytest

from calib_core.errors import InputError
from calib_core.file_tag import TAG
from cocalib.platform.files import keeping, write_whole


def test_a_link_is_followed_and_stays(tmp_path):
    (tmp_path / "target").write_text(f"old, {TAG}")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_whole(tmp_path / "link", f"new, {TAG}")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == f"new, {TAG}"


@pytest.mark.parametrize("there", ["another's", f'{{"schema": "cocalib/clicks-1"}} {TAG}'])
@pytest.mark.parametrize("new", ["no tag", TAG, '{"schema": "cocalib/calibration-1"}'])
def test_a_file_of_another_kind_or_program_is_replaced_only_if_forced(tmp_path, there, new):
    path = tmp_path / "file"
    path.write_text(there)
    with pytest.raises(InputError):
        write_whole(path, new)
    assert path.read_text() == there
    with keeping([tmp_path], force=True), pytest.raises(InputError):
        write_whole(path, new)
    with keeping([], force=True):
        write_whole(path, new)
    assert path.read_text() == new


def test_a_device_that_holds_files_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "disk"
    path.touch()
    monkeypatch.setattr(stat, "S_ISBLK", lambda _mode: True)
    with keeping([], force=True), pytest.raises(InputError):
        write_whole(path, TAG)


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
    with pytest.raises(InputError, match=words):
        write_whole(tmp_path / name, b"x")
    assert list(tmp_path.iterdir()) == []
