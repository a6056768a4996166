"""The recordings that were opened last."""

import stat
from pathlib import Path

import pytest

from cocalib.opening.recent import RecentRecordings


@pytest.fixture
def recent(tmp_path: Path) -> RecentRecordings:
    return RecentRecordings(tmp_path / "state")


def recording(tmp_path: Path, name: str) -> Path:
    path = tmp_path / name
    path.write_bytes(b"")
    return path


def test_the_newest_is_first_and_each_is_listed_once(recent, tmp_path):
    one, two = recording(tmp_path, "one.bag"), recording(tmp_path, "two.bag")
    recent.add([one], "one.bag", 3)
    recent.add([two, one], "two.bag", 0)
    recent.add([one], "one.bag", 7)
    rows = recent.rows()
    assert [(row.name, row.clicks, row.folder) for row in rows] == [
        ("one.bag", 7, str(tmp_path)),
        ("two.bag", 0, str(tmp_path)),
    ]
    assert recent.paths_of(rows[1].id) == (two, one)


def test_what_does_not_exist_any_more_is_not_listed_and_cannot_be_chosen(recent, tmp_path):
    gone = recording(tmp_path, "gone.bag")
    recent.add([gone], "gone.bag", 1)
    (row,) = recent.rows()
    gone.unlink()
    assert recent.rows() == ()
    assert recent.paths_of(row.id) == ()


def test_the_list_is_short_private_and_can_be_emptied(recent, tmp_path):
    for number in range(25):
        recent.add([recording(tmp_path, f"{number}.bag")], f"{number}.bag", 0)
    assert len(recent.rows()) == 20
    file = tmp_path / "state" / "recent.json"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    recent.forget()
    recent.forget()
    assert recent.rows() == ()
    assert not file.exists()


@pytest.mark.parametrize("content", [b"", b"[", b'[{"paths":[]}]', b"\xff\xfe", b"[" * 100_000, b'{"paths":1}'])
def test_a_damaged_list_counts_as_empty_and_one_that_cannot_be_written_is_logged(recent, tmp_path, content, caplog):
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "recent.json").write_bytes(content)
    assert recent.rows() == ()
    assert "cannot be read" in caplog.text
    recent.add([recording(tmp_path, "a.bag")], "a.bag", 0)
    assert [row.name for row in recent.rows()] == ["a.bag"]
    RecentRecordings(tmp_path / "a.bag").add([tmp_path / "a.bag"], "a.bag", 0)
    assert "cannot be written" in caplog.text
