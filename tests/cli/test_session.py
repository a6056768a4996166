"""`cocalib session`: list, repair and export."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from calib_core.interchange.own.clicks_json import read_clicks
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from tests.unit.app.session.drive import files, kept, place, restored

FACTS = RecordingFacts("drive.bag", 1_700_000_000_123_456_789 + 100_000_000 * np.arange(50), 640, 480)


@pytest.fixture(autouse=True)
def state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "cocalib" / "sessions"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "drive.bag").write_bytes(b"")
    return folder


def clicked(folder: Path, clicks: int = 12, facts: RecordingFacts = FACTS) -> Path:
    kept(folder, *(replace(place(frame, facts), pixel_px=(float(frame), 2.0)) for frame in range(clicks)), facts=facts)
    return folder


def damaged(folder: Path, line: int, *, with_copy: bool = False) -> Path:
    """Damage a line of the journal, and remove the copy unless it is to stay."""
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().split(b"\n")
    lines[line - 1] = lines[line - 1].replace(b"2.0", b"3.0")
    journal.write_bytes(b"\n".join(lines))
    if not with_copy:
        (folder / "journal-copy.jsonl").unlink()
    return folder


def test_the_list_names_every_session_here_and_in_the_users_folder(cocalib, home, state_folder):
    clicked(home / "drive.bag.cocalib-session", 3)
    shutil.copytree(clicked(home / "a.bag.cocalib-session", 4), home / "a.bag.cocalib-session.1")
    damaged(clicked(home / "b.bag.cocalib-session", 5), 4)
    clicked(state_folder / "c.bag-1.cocalib-session", 6)
    answer = cocalib("session", "list", home, "--json")
    assert answer.code == 0
    found = {Path(each["folder"]).name: each for each in json.loads(answer.out)}
    assert {name: (each["state"], each["clicks"], each["steps"]) for name, each in found.items()} == {
        "a.bag.cocalib-session": ("sound", 4, 4),
        "a.bag.cocalib-session.1": ("sound", 4, 4),
        "b.bag.cocalib-session": ("damaged", 2, 2),
        "c.bag-1.cocalib-session": ("sound", 6, 6),
        "drive.bag.cocalib-session": ("sound", 3, 3),
    }
    assert found["drive.bag.cocalib-session"]["recording"] == "drive.bag"
    assert "line 4 is damaged" in found["b.bag.cocalib-session"]["about"]
    lines = cocalib("session", "list", home).out.splitlines()
    assert lines[0].split() == ["state", "clicks", "steps", "last", "change", "recording", "folder"]
    assert len(lines) == 1 + 5 + 1


def test_the_list_takes_recordings_and_shows_which_process_has_a_session_open(cocalib, home):
    folder = clicked(home / "drive.bag.cocalib-session", 3)
    session_file = open_session_file(folder, FACTS)
    (found,) = json.loads(cocalib("session", "list", home / "drive.bag", "--json").out)
    assert (found["state"], found["clicks"]) == ("open", 3)
    assert f"process {os.getpid()}" in found["about"]
    assert cocalib("session", "repair", folder, "--yes").code == 2
    session_file.close()


@pytest.mark.skipif(os.name == "nt", reason="Windows needs a right to make links")
def test_the_list_follows_no_link_and_prints_no_control_characters(cocalib, home, tmp_path):
    target = tmp_path / "target"
    target.write_bytes(b"precious")
    folder = home / "drive.bag.cocalib-session"
    folder.mkdir()
    (folder / "journal.jsonl").symlink_to(target)
    hostile = RecordingFacts("\x1b]0;owned\x07", FACTS.image_times, 640, 480)
    clicked(home / "x.cocalib-session", 2, hostile)
    answer = cocalib("session", "list", home)
    assert answer.code == 0
    assert "unreadable" in answer.out
    assert "is a symbolic link" in answer.out
    assert "\x1b" not in answer.out
    assert target.read_bytes() == b"precious"


def test_a_sound_session_needs_no_repair_and_its_clicks_are_exported(cocalib, home, tmp_path):
    folder = clicked(home / "drive.bag.cocalib-session")
    before = files(folder)
    for arguments in ([folder], [home / "drive.bag"], [folder, "--yes"]):
        answer = cocalib("session", "repair", *arguments)
        assert (answer.code, answer.err) == (0, "")
        assert "Sound; nothing to repair." in answer.out
    answer = cocalib("session", "export", home / "drive.bag", "--out", tmp_path / "clicks.json")
    assert (answer.code, answer.err) == (0, "")
    assert len(read_clicks((tmp_path / "clicks.json").read_text())) == 12
    assert files(folder) == before


def test_a_repair_and_an_export_keep_what_is_proven_and_only_with_yes_a_repair_changes_files(cocalib, home, tmp_path):
    folder = damaged(clicked(home / "drive.bag.cocalib-session"), 9)
    before = files(folder)
    shown = cocalib("session", "repair", folder)
    exported = cocalib("session", "export", folder, "--out", tmp_path / "clicks.json")
    assert (shown.code, exported.code) == (1, 3)
    for said in ("line 9 is damaged", "not proven, and left out: 5 lines"):
        assert said in shown.out
        assert said in exported.err
    assert "proven: 7 clicks" in shown.out
    assert f"cocalib session repair {folder} --yes" in shown.out
    assert len(read_clicks((tmp_path / "clicks.json").read_text())) == 7
    assert files(folder) == before
    repaired = cocalib("session", "repair", folder, "--yes")
    assert repaired.code == 0
    assert "kept as journal.jsonl.backup-1." in repaired.out
    assert (folder / "journal.jsonl.backup-1").read_bytes() == before["journal.jsonl"]
    assert (len(restored(folder, FACTS).history.present.clicks), restored(folder, FACTS).warnings) == (7, ())
    assert cocalib("session", "repair", folder).code == 0


def test_two_files_that_do_not_belong_together_are_told_apart_by_hand(cocalib, home):
    folder, other = clicked(home / "drive.bag.cocalib-session", 3), clicked(home / "other.cocalib-session", 9)
    shutil.copy(damaged(other, 5, with_copy=True) / "journal-copy.jsonl", folder)
    lines = (folder / "journal.jsonl").read_bytes().split(b"\n")
    (folder / "journal.jsonl").write_bytes(b"\n".join([lines[0], lines[2], *lines[1:2], b""]))
    before = files(folder)
    shown = cocalib("session", "repair", folder)
    assert shown.code == 1
    assert files(folder) == before
    assert cocalib("session", "repair", folder, "--yes").code == 0
    assert {name: files(folder)[f"{name}.backup-1"] for name in before} == before


def test_a_last_step_that_is_not_whole_is_listed_and_told_and_needs_no_repair(cocalib, home, tmp_path):
    folder = clicked(home / "drive.bag.cocalib-session", 1)
    for path in folder.glob("journal*.jsonl"):
        path.write_bytes(path.read_bytes() + b'{"type":"click_pl')
    (found,) = json.loads(cocalib("session", "list", folder, "--json").out)
    assert (found["state"], found["clicks"]) == ("torn", 1)
    assert "17 bytes" in found["about"]
    exported = cocalib("session", "export", folder, "--out", tmp_path / "clicks.json")
    assert exported.code == 0
    assert "a last step of" in exported.err
    assert len(read_clicks((tmp_path / "clicks.json").read_text())) == 1
    repaired = cocalib("session", "repair", folder)
    assert repaired.code == 0
    assert "proven: 1 click, from" in repaired.out
    assert "Sound" not in repaired.out


def test_what_proves_nothing_is_not_exported(cocalib, home, tmp_path):
    folder = clicked(home / "drive.bag.cocalib-session")
    (folder / "journal-copy.jsonl").unlink()
    (folder / "journal.jsonl").write_bytes(b"no\n")
    for arguments in (["export", folder, "--out", tmp_path / "clicks.json"], ["repair", folder, "--yes"]):
        answer = cocalib("session", *arguments)
        assert answer.code == 2
        assert "nothing of the session" in answer.err
    assert not (tmp_path / "clicks.json").exists()
