"""A session is found by its recording's content: renamed, moved, grown, or without images."""

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cocalib.session.file.finding import FoundFolder, find_session_folder
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.journal import COPY, JOURNAL
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from tests.unit.app.session.drive import FACTS as DRIVE
from tests.unit.app.session.drive import START_NS, clicks_in, kept, place, refused

RADAR_TIMES = START_NS + 50_000_000 * np.arange(90)
NO_TIMES = np.zeros(0, dtype=np.int64)
IMAGE_TIMES = DRIVE.image_times
FACTS = replace(DRIVE, name="drive.bag", radar_times=RADAR_TIMES)


@pytest.fixture
def state_folder(state: Path) -> Path:
    (state / "sessions").mkdir(parents=True)
    return state / "sessions"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    folder = tmp_path / "recordings"
    folder.mkdir()
    return folder


def clicked(folder: Path, facts: RecordingFacts = FACTS, *, changed_at_s: float | None = None) -> Path:
    """Make a session with one click."""
    kept(folder, place(3, facts), facts=facts)
    if changed_at_s is not None:
        for name in (JOURNAL, COPY):
            os.utime(folder / name, (changed_at_s, changed_at_s))
    return folder


def test_the_session_of_the_same_name_is_started_and_continued_without_a_word(home):
    folder = home / "drive.bag.cocalib-session"
    assert find_session_folder([home / "drive.bag"], FACTS) == FoundFolder(folder)
    clicked(home / "other.bag.cocalib-session")
    clicked(folder)
    assert find_session_folder([home / "drive.bag"], FACTS) == FoundFolder(folder)


@pytest.mark.parametrize("moved", [False, True])
def test_a_renamed_or_moved_recording_continues_its_session_and_says_so(home, state_folder, moved):
    name, place = ("drive.bag", state_folder) if moved else ("renamed.bag", home)
    folder, facts = clicked(place / "drive.bag.cocalib-session"), replace(FACTS, name=name)
    found = find_session_folder([home / name], facts)
    assert found.path == folder
    (warning,) = found.warnings
    assert warning.code == "session-of-other-name"
    assert str(folder) in warning.facts["message"]
    session_file = open_session_file(found.path, facts, found.warnings)
    assert session_file.restored.warnings == found.warnings
    assert len(session_file.restored.history.present.clicks) == 1
    session_file.close()


def test_of_two_sessions_the_newest_is_continued_and_the_other_named(home, state_folder):
    old = clicked(home / "old.bag.cocalib-session", changed_at_s=1e9)
    new = clicked(state_folder / "new.bag.cocalib-session", changed_at_s=1.1e9)
    found = find_session_folder([home / "drive.bag"], FACTS)
    assert found.path == new
    assert [warning.code for warning in found.warnings] == ["session-of-other-name", "session-not-used"]
    assert str(old) in found.warnings[1].facts["message"]
    assert f"--session {old}" in found.warnings[1].facts["hint"]


@pytest.mark.parametrize(
    "other",
    [
        replace(FACTS, image_times=IMAGE_TIMES + 1),
        replace(FACTS, width_px=320),
        replace(FACTS, image_times=IMAGE_TIMES[:40]),
    ],
    ids=["other stamps", "other size", "shorter"],
)
def test_a_session_of_another_recording_is_not_taken(home, other):
    clicked(home / "drive.bag.cocalib-session")
    found = find_session_folder([home / "other.bag"], other)
    assert (found.path, found.warnings) == (home / "other.bag.cocalib-session", ())


def test_a_new_recording_of_an_old_name_finds_its_own_session_elsewhere(home, state_folder):
    other = replace(FACTS, image_times=IMAGE_TIMES + 10**12)
    clicked(home / "drive.bag.cocalib-session", other)
    mine = clicked(state_folder / "drive.bag.cocalib-session")
    assert find_session_folder([home / "drive.bag"], FACTS).path == mine


def test_a_recording_that_has_grown_keeps_its_session(home):
    clicked(home / "drive.bag.cocalib-session", replace(FACTS, image_times=IMAGE_TIMES[:10]))
    assert find_session_folder([home / "renamed.bag"], FACTS).warnings
    kept(home / "drive.bag.cocalib-session", place(40), facts=FACTS)
    assert clicks_in(home / "drive.bag.cocalib-session", FACTS) == [3.0, 40.0]


def test_a_recording_without_images_is_known_by_its_scans(home):
    facts = RecordingFacts("radar.bag", NO_TIMES, 0, 0, radar_times=RADAR_TIMES[:30])
    kept(home / "radar.bag.cocalib-session", facts=facts)
    grown = replace(facts, radar_times=RADAR_TIMES)
    kept(home / "radar.bag.cocalib-session", facts=grown)
    assert find_session_folder([home / "renamed.bag"], grown).path == home / "radar.bag.cocalib-session"
    for other in (replace(facts, radar_times=RADAR_TIMES + 1), replace(facts, radar_times=NO_TIMES)):
        refused(home / "radar.bag.cocalib-session", r"'radar.bag' \(30 radar scans, no frames from", other)


def test_stamps_that_count_from_zero_prove_nothing_and_the_session_is_only_named(home):
    video = replace(FACTS, image_times=33_333_333 * np.arange(50))
    folder = clicked(home / "drive.bag.cocalib-session", video)
    found = find_session_folder([home / "renamed.bag"], video)
    assert found.path == home / "renamed.bag.cocalib-session"
    (warning,) = found.warnings
    assert warning.code == "session-not-used"
    assert f"--session {folder}" in warning.facts["hint"]


def test_a_session_that_cannot_be_written_is_named_with_the_way_to_its_clicks(home, state_folder, monkeypatch):
    folder = clicked(home / "drive.bag.cocalib-session")
    monkeypatch.setattr("cocalib.session.file.finding.is_writable", lambda place: False)
    found = find_session_folder([home / "drive.bag"], FACTS)
    assert found.path.parent == state_folder
    (warning,) = found.warnings
    assert f"cocalib session export {folder} --out clicks.json" in warning.facts["hint"]


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a folder to another user"
)
def test_another_users_session_next_to_the_recording_is_named(home, state_folder, monkeypatch):
    folder = clicked(home / "drive.bag.cocalib-session")
    os.chown(folder, 12345, -1)
    monkeypatch.setattr("cocalib.session.file.finding.is_writable", lambda place: state_folder in (place, place.parent))
    found = find_session_folder([home / "drive.bag"], FACTS)
    assert found.path.parent == state_folder
    (warning,) = found.warnings
    assert f"{folder}: belongs to user" in warning.facts["message"]


@pytest.mark.skipif(os.name == "nt", reason="Windows needs a right to make links")
def test_a_link_is_not_followed_while_searching(home, tmp_path):
    real = clicked(tmp_path / "elsewhere")
    (home / "drive.bag.cocalib-session").symlink_to(real)
    assert find_session_folder([home / "renamed.bag"], FACTS).path == home / "renamed.bag.cocalib-session"
    found = find_session_folder([home / "drive.bag"], FACTS)
    with pytest.raises(SessionFileError, match="is a symbolic link"):
        open_session_file(found.path, FACTS)


def test_a_session_whose_journal_lost_its_first_line_is_found_by_its_copy(home):
    folder = clicked(home / "drive.bag.cocalib-session")
    (folder / "journal.jsonl").write_bytes(b"no\n")
    assert find_session_folder([home / "renamed.bag"], FACTS).path == folder
    shutil.rmtree(folder)
    assert find_session_folder([home / "renamed.bag"], FACTS).path == home / "renamed.bag.cocalib-session"
