"""Reopening a file uses its cached index, and never that of another file."""

import os
import shutil
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from calib_core.recordings import open_recording
from calib_core.recordings.containers import chunks, index_cache
from calib_core.recordings.containers.index_cache import FileCache, cache_folder
from calib_core.recordings.containers.sqlite import SqliteSource
from tests.unit.recordings.conftest import Ros, plain_rows, write_rows
from tests.unit.recordings.containers.malformed import Kit, without_index

START_NS = 1_700_000_000 * NS_PER_S


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Enable the cache for files of any size, in the test's folder."""
    monkeypatch.setenv("COCALIB_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(index_cache, "SMALLEST_FILE_BYTES", 0)
    return tmp_path / "cache"


@pytest.fixture(scope="module")
def written(tmp_path_factory, jpeg):
    """Return a function that writes a container, once."""

    @cache
    def write_once(container):
        ros, folder = Ros(1 if container.startswith("bag") else 2), tmp_path_factory.mktemp("written")
        path = folder / ("recording.bag" if container.startswith("bag") else "recording")
        return folder, write_rows(path, ros, plain_rows(ros, jpeg, n=600), container)

    return write_once


@pytest.fixture
def path(container, written, tmp_path):
    """Return a copy that a test may change."""
    folder, path = written(container)
    return shutil.copytree(folder, tmp_path / "copy") / path.relative_to(folder)


def contents(path):
    with open_recording(path) as recording:
        scans = recording.radar_scans()
        frames = [recording.image_bytes(index).data for index in (0, 17, len(recording.image_times) - 1)]
        return (
            scans.times_ns.tolist(),
            scans.points_radar_m.tolist(),
            frames,
            recording.image_times.tolist(),
            recording.topics,
        )


@pytest.mark.slow
def test_reopening_gives_the_same_and_reads_neither_index_nor_stamps_again(path, folder, monkeypatch):
    first = contents(path)
    assert any(folder.glob("*.index.npz"))

    def never(*_, **__):
        raise AssertionError("read again")

    monkeypatch.setattr("calib_core.recordings.containers.rosbag1.reader.Rosbag1Source._read_tail", never)
    monkeypatch.setattr("calib_core.recordings.containers.mcap.reader.McapSource._open", never)
    monkeypatch.setattr("calib_core.recordings.containers.sqlite.scan_rows", never)
    gather, read = chunks.gather_heads, SqliteSource._read_heads
    few = lambda index: index if len(index) < 500 else never()  # noqa: E731
    monkeypatch.setattr(chunks, "gather_heads", lambda source, index, size: gather(source, few(index), size))
    monkeypatch.setattr(SqliteSource, "_read_heads", lambda self, index, size: read(self, few(index), size))
    assert contents(path) == first


def test_a_changed_file_is_read_again(path, folder):
    contents(path)
    before = set(folder.iterdir())
    os.utime(path, ns=(1, path.stat().st_mtime_ns + 1))
    contents(path)
    assert len(set(folder.iterdir()) - before) >= 2


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage", [lambda raw: b"", lambda raw: raw[:-100], lambda raw: raw[:300] + bytes(200) + raw[500:], lambda _: b"{}"]
)
def test_a_damaged_cache_is_ignored(path, folder, damage):
    first = contents(path)
    for entry in folder.iterdir():
        entry.write_bytes(damage(entry.read_bytes()))
    assert contents(path) == first


def test_an_entry_with_inconsistent_numbers_is_ignored(path, folder):
    first = contents(path)
    for entry in folder.iterdir():
        with np.load(entry, allow_pickle=False) as kept:
            arrays = {name: kept[name] for name in kept.files}
        if "columns" in arrays and "ids" in arrays:
            arrays["columns"][1] += 10**6
        elif "rows" in arrays:
            arrays["rows"] = arrays["rows"][:3]
        np.savez(entry, **arrays)
    assert contents(path) == first


def test_an_entry_of_python_objects_is_never_unpickled(folder):
    folder.mkdir()
    np.savez(folder / "k-x.index.npz", columns=np.array([{"a": 1}], dtype=object))
    assert FileCache(folder, "k").get("x") is None


def test_damaged_files_are_not_kept(folder, tmp_path, jpeg):
    path = Kit(tmp_path, jpeg).bag()
    path.write_bytes(without_index(bytearray(path.read_bytes())))
    for _ in range(2):
        with open_recording(path) as recording:
            assert [warning.code for warning in recording.warnings] == ["not-closed"]
    assert not list(folder.glob("*-index.index.npz"))


def test_the_cache_stays_small_by_dropping_the_least_recently_used_entries(folder, monkeypatch):
    monkeypatch.setattr(index_cache, "_MAX_TOTAL_BYTES", 30_000)
    cache = FileCache(folder, "key")
    for number in range(5):
        cache.put(f"n{number}", {"a": np.zeros(1000)})
        os.utime(folder / f"key-n{number}.index.npz", ns=(number, number))
    assert sorted(path.name for path in folder.iterdir()) == [f"key-n{number}.index.npz" for number in (2, 3, 4)]
    monkeypatch.setattr(index_cache, "_MAX_ENTRY_BYTES", 20_000)
    cache.put("large", {"a": np.zeros(5000)})
    assert cache.get("large") is None


def test_a_read_only_cache_folder_is_not_an_error(tmp_path, path, monkeypatch):
    monkeypatch.setattr(index_cache, "SMALLEST_FILE_BYTES", 0)
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("COCALIB_CACHE", str(tmp_path / "file" / "below"))
    assert contents(path) == contents(path)


def test_the_cache_is_where_the_user_and_the_system_want_it(monkeypatch, tmp_path):
    monkeypatch.setenv("COCALIB_CACHE", "off")
    assert cache_folder() is None
    monkeypatch.delenv("COCALIB_CACHE")
    for platform, variable, expected in (
        ("linux", "XDG_CACHE_HOME", tmp_path),
        ("win32", "LOCALAPPDATA", tmp_path),
        ("darwin", "HOME", tmp_path / "Library" / "Caches"),
    ):
        monkeypatch.setattr(sys, "platform", platform)
        monkeypatch.setattr(Path, "home", lambda: tmp_path)
        monkeypatch.setenv(variable, str(tmp_path))
        assert cache_folder() == expected / "cocalib" / "indexes"
