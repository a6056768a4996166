"""The folder that a page may look into: nothing outside it is named, listed or opened."""

import os
import sys
from pathlib import Path

import pytest

from calib_core.errors import InputError
from cocalib.opening.root_folder import RootFolder

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="links and pipes need POSIX")


@pytest.fixture
def root(tmp_path: Path) -> RootFolder:
    inside = tmp_path / "root"
    (inside / "day one" / "empty").mkdir(parents=True)
    (inside / "day one" / "radar.bag").write_bytes(b"12345")
    (inside / "notes.pdf").write_bytes(b"")
    (inside / ".hidden.bag").write_bytes(b"")
    (inside / "day one" / "radar.bag.cocalib-session").mkdir()
    bag_folder = inside / "drive"
    bag_folder.mkdir()
    (bag_folder / "drive_0.mcap").write_bytes(b"123")
    (tmp_path / "secret.bag").write_bytes(b"secret")
    return RootFolder(inside)


def test_folders_and_recordings_are_listed_with_their_sizes(root):
    listing = root.listing("")
    assert [(entry.name, entry.kind, entry.size_bytes) for entry in listing.entries] == [
        ("day one", "recording folder", 5),
        ("drive", "recording folder", 3),
    ]
    assert (listing.path, listing.parent) == ("", None)
    below = root.listing("day one")
    assert [(entry.path, entry.kind) for entry in below.entries] == [
        ("day one/empty", "folder"),
        ("day one/radar.bag", "recording"),
    ]
    assert (below.path, below.parent) == ("day one", "")


OUTSIDE = (
    "..",
    "../secret.bag",
    "day one/../../secret.bag",
    "/etc/passwd",
    "~/secret.bag",
    "day one\\..\\..",
    "a\0b",
    "//x",
)


@pytest.mark.parametrize("path", OUTSIDE)
def test_a_path_that_leads_outside_is_refused_in_words(root, path):
    for use in (root.listing, root.resolve, lambda given: root.recordings([given])):
        with pytest.raises(InputError, match="only folders below"):
            use(path)


@POSIX
def test_links_are_followed_inside_and_refused_outside(root, tmp_path):
    (root.path / "also").symlink_to(root.path / "day one")
    (root.path / "out").symlink_to(tmp_path)
    (root.path / "out.bag").symlink_to(tmp_path / "secret.bag")
    (root.path / "circle").symlink_to(root.path / "circle")
    listing = root.listing("")
    assert [entry.name for entry in listing.entries] == ["also", "day one", "drive"]
    assert listing.note.startswith("3 links ")
    assert root.recordings(["also/radar.bag"]) == (root.path / "day one" / "radar.bag",)
    for path in ("out.bag", "out/secret.bag", "out"):
        with pytest.raises(InputError, match="is a link that leads out of"):
            root.recordings([path])
    with pytest.raises(InputError, match="circle"):
        root.recordings(["circle"])


def test_a_folder_that_may_not_be_read_has_vanished_or_is_none_is_named(root, monkeypatch):
    assert root.listing("day one/empty").note.startswith("No recording")
    with pytest.raises(InputError, match=r"gone\.bag: is not there any more"):
        root.recordings(["gone.bag"])
    with pytest.raises(InputError, match="is not a folder; choose it as a recording"):
        root.listing("day one/radar.bag")

    def denied(_path: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "scandir", denied)
    with pytest.raises(InputError, match=r"day one: you may not look into it \(permission denied\)"):
        root.listing("day one")


@POSIX
def test_a_pipe_is_no_recording(root):
    os.mkfifo(root.path / "pipe.bag")
    assert "pipe.bag" not in [entry.name for entry in root.listing("").entries]
    with pytest.raises(InputError, match="named pipe"):
        root.recordings(["pipe.bag"])


def test_a_root_must_be_a_folder_and_one_that_is_a_link_is_resolved_first(root, tmp_path):
    (tmp_path / "file").write_bytes(b"")
    for name in ("absent", "file"):
        with pytest.raises(InputError, match="--root"):
            RootFolder(tmp_path / name)
    (tmp_path / "link").symlink_to(root.path)
    assert RootFolder(tmp_path / "link").path == root.path
