"""A session on disk: what is stored, what is restored, and what is refused without being changed."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib_core.measurements import ChosenReturn, ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from cocalib.platform.resources import user_session_folder
from cocalib.session.applying import History, advance
from cocalib.session.events import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    IntrinsicsChosen,
    OptionsChanged,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    Solved,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.file.finding import recording_session_folder
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.journal import COPY, JOURNAL, bytes_of, sealed, taken_apart
from cocalib.session.file.session_file import open_session_file, set_aside
from cocalib.session.state import RecordingFacts
from tests.unit.app.session.drive import (
    FACTS,
    TIMES,
    clicks_in,
    damage,
    files,
    keep,
    kept,
    lines_of,
    place,
    refused,
    restored,
)
from tests.unit.app.session.test_session import CHOSEN

STEPS = (
    ClickPlaced(TIMES[3], (100.1, 200.2)),
    ClickPlaced(TIMES[1], (0.1 + 0.2, 1e-17)),
    ClickMoved("c1", (101.0, 201.0)),
    OptionsChanged.of(
        CalibrationOptions(method="paper", solving=SolvingOptions(CameraPositionPrior((0.1, 0.2, 0.3), 0.01)))
    ),
    ClickExcluded("c2", True),
    Undo(),
    Redo(),
    ClicksImported.of((ReflectorClick(TIMES[9], "p1", 5.0, 6.0, 0.5, True),)),
    ClickRemoved("c1"),
    Cleared(),
    Undo(),
    Undo(),
    ClickPlaced(TIMES[3], (300.5, 20.25), "snapped", 0.3),
    ClickPlaced(TIMES[4], (30.5, 20.25), "untouched"),
    ReturnChosen("p1", ChosenReturn((20.0, 0.1 + 0.2, -0.5), TIMES[9], "/radar")),
    PlacementDismissed(TIMES[7], (5.0, 1.0, 0.1 + 0.2)),
    WarningsAcknowledged(("few-pairs", "weak-geometry")),
    IntrinsicsChosen(CHOSEN),
    ClickRemoved("c1"),
    Cleared(),
    Undo(),
)


def test_answers_are_not_journalled(tmp_path):
    session_file = open_session_file(tmp_path, FACTS)
    with pytest.raises(TypeError, match="Solved is not journalled"):
        session_file.append(Solved(1, Unsolvable.reported("a", "b", "c")), History())
    session_file.close()


def test_a_session_comes_back_bit_for_bit_with_everything_that_can_be_undone_and_redone(tmp_path):
    history = kept(tmp_path / "s", *STEPS)
    found = restored(tmp_path / "s")
    assert (found.history, found.steps, found.note) == (history, len(STEPS), "")
    assert found.history.present.needs_solving


def test_a_session_continues_where_it_stopped_and_its_journal_is_only_ever_appended_to(tmp_path):
    kept(tmp_path, place(1))
    before = files(tmp_path)[JOURNAL]
    kept(tmp_path, place(2))
    assert [click.id for click in kept(tmp_path, Undo()).present.clicks] == ["c1"]
    assert files(tmp_path)[JOURNAL].startswith(before)
    assert len(lines_of(tmp_path)) == 4


KILLED = """
import os, sys
from pathlib import Path
from msgspec.structs import replace
from cocalib.session.applying import advance
from cocalib.session.file.session_file import open_session_file
from tests.unit.app.session.drive import FACTS, place
session_file = open_session_file(Path(sys.argv[1]), FACTS)
history = session_file.restored.history
os.write(1, b"open\\n")
for number in range(1_000_000):
    step = replace(place(number % 50), pixel_px=(float(number % 640), 1.0))
    history = advance(history, step, FACTS)
    session_file.append(step, history)
    os.write(1, b"%d\\n" % number)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
@pytest.mark.parametrize("confirmed", [0, 9])
def test_a_process_killed_outright_loses_nothing_that_was_confirmed(tmp_path, project_root, confirmed):
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    with subprocess.Popen(command, cwd=project_root, stdout=subprocess.PIPE, text=True) as process:
        for _ in range(1 + confirmed):
            assert process.stdout.readline()
        process.kill()  # at whatever it is doing
        confirmed += len(process.stdout.readlines())
    assert process.returncode == -signal.SIGKILL
    found = restored(tmp_path)
    assert confirmed <= found.steps <= confirmed + 1
    kept = Counter((click.image_time, click.u_px) for click in found.history.present.clicks)  # a frame may have several
    wanted = Counter((place(number % 50).image_time, float(number % 640)) for number in range(confirmed))
    assert wanted <= kept
    assert (kept - wanted).total() <= 1
    assert found.warnings == ()
    assert files(tmp_path)[JOURNAL] == files(tmp_path)[COPY]


def test_a_half_written_last_line_is_dropped_and_reported(tmp_path):
    history = kept(tmp_path, *STEPS[:3])
    whole = files(tmp_path)[JOURNAL]
    (tmp_path / JOURNAL).write_bytes(whole + b'{"n":4,"step":{"type":"cle')
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert session_file.restored.torn_bytes == 26
    assert "not in the session" in session_file.restored.note
    keep(session_file, STEPS[3])
    session_file.close()
    assert files(tmp_path)[JOURNAL].startswith(whole + b'{"n":4,"step":{"type":"options_changed"')


@pytest.mark.parametrize(
    ("line", "text", "words"),
    [
        (2, b'{"n":2,"step":{"type":"click_placed","image', "line 3 is damaged"),
        (2, b"\x00\x00\xff\xfe", "line 3 is damaged"),
        (2, b"", "line 3 is damaged"),
        (2, b'{"n":2,"step":{"type":"cleared"}}', "line 3 is damaged (it has no checksum)"),
        (0, b"{}", "line 1 is damaged"),
        (0, b'{"schema":"cocalib/session-2"', "line 1 is damaged"),
        (0, b"", "line 1 is damaged"),
    ],
)
def test_a_damaged_journal_is_refused_without_its_copy_and_continued_with_it(tmp_path, line, text, words):
    history = kept(tmp_path, *STEPS[:4])
    whole = files(tmp_path)[COPY]
    damage(tmp_path, line, text)
    (tmp_path / COPY).unlink()
    reason = refused(tmp_path)
    assert words in reason
    assert "cocalib session repair" in reason or "nothing of the session" in reason
    (tmp_path / COPY).write_bytes(whole)
    assert words in continued(tmp_path, history)


def continued(folder: Path, history: History) -> str:
    """Open a session that the copy brings back, with the old files kept; return what was wrong."""
    before = files(folder)
    found = restored(folder)
    (warning,) = found.warnings
    assert (warning.code, found.history) == ("session-damaged", history)
    assert {name: files(folder)[f"{name}.backup-1"] for name in before} == before
    again = restored(folder)
    assert (again.history, again.warnings) == (history, ())
    assert files(folder)[JOURNAL] == files(folder)[COPY]
    return warning.facts["message"]


def test_a_journal_that_is_cut_or_missing_and_a_copy_that_is_damaged_are_told(tmp_path):
    history = kept(tmp_path / "cut", *map(place, range(20)))
    (tmp_path / "cut" / JOURNAL).write_bytes(lines_of(tmp_path / "cut")[0] + b"\n")
    assert "0 steps, its copy" in continued(tmp_path / "cut", history)
    history = kept(tmp_path / "lost", *STEPS[:5])
    (tmp_path / "lost" / JOURNAL).unlink()
    assert "the journal is missing" in continued(tmp_path / "lost", history)
    history = kept(tmp_path / "copy", *STEPS[:2])
    (tmp_path / "copy" / COPY).write_text("{")
    found = restored(tmp_path / "copy")
    assert "line 1 is damaged" in found.warnings[0].facts["message"]
    assert (found.history, files(tmp_path / "copy")[f"{COPY}.backup-1"]) == (history, b"{")
    (tmp_path / "copy" / COPY).write_text("{")
    (tmp_path / "copy" / JOURNAL).unlink()
    refused(tmp_path / "copy", "nothing of the session can be proven: line 1 is damaged")


def test_what_one_file_has_lost_comes_from_the_other(tmp_path):
    history = kept(tmp_path, *STEPS[:6])
    damage(tmp_path, 2, b"")
    damage(tmp_path, 5, b"", COPY)
    message = continued(tmp_path, history)
    assert "line 3 is damaged" in message
    assert "copy, line 6" in message


def test_a_damaged_line_that_no_file_has_is_refused(tmp_path):
    kept(tmp_path, *STEPS[:2])
    copy = files(tmp_path)[COPY]
    kept(tmp_path, *STEPS[2:5])
    (tmp_path / COPY).write_bytes(copy)  # as a power failure may leave it
    damage(tmp_path, 4, b"")
    refused(tmp_path, r"line 5 is damaged .*cocalib session repair")


def test_a_copy_that_is_behind_is_brought_up_to_date_without_a_word(tmp_path):
    history = kept(tmp_path, *STEPS[:5])
    whole = files(tmp_path)[JOURNAL]
    for length in (None, *range(whole.index(b"\n") + 1, len(whole), 97)):  # a copy without a first line is damaged
        (tmp_path / COPY).unlink() if length is None else (tmp_path / COPY).write_bytes(whole[:length])
        found = restored(tmp_path)
        assert (found.history, found.warnings) == (history, ())
        assert files(tmp_path)[COPY] == whole


def reseal(folder: Path, line: int, content: bytes) -> None:
    """Exchange the content of a line, with a right checksum as another version of the program would write it."""
    lines = [taken_apart(each) for each in lines_of(folder)]
    lines[line] = sealed(content, lines[line - 1].sum if line else "")
    (folder / JOURNAL).write_bytes(bytes_of(lines))
    (folder / COPY).unlink()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'{"n":2,"step":{"type":"click_removed","id":"c9"}}', "there is no click 'c9'"),
        (b'{"n":2,"step":{"type":"options_changed","options":{"nois":{}}}}', "unknown option 'nois'"),
        (b'{"n":2,"step":{"type":"juggled"}}', "Invalid value 'juggled'"),
        (b'{"n":2,"step":{"type":"box_removed","id":"b1"}}', "'box_removed'.*cocalib session repair"),
    ],
)
def test_a_step_that_this_version_does_not_understand_is_refused(tmp_path, content, words):
    kept(tmp_path, *STEPS[:2])
    reseal(tmp_path, 2, content)
    refused(tmp_path, words)


def test_a_journal_of_another_version_is_refused_with_that_version_named(tmp_path):
    kept(tmp_path)
    head = taken_apart(lines_of(tmp_path)[0]).content
    reseal(tmp_path, 0, head.replace(b"cocalib/session-2", b"cocalib/session-9"))
    refused(tmp_path, r"cocalib/session-9.*with that version")


@pytest.mark.parametrize("fork", [False, True])
def test_a_copy_of_another_journal_is_refused_until_a_person_decides(tmp_path, fork):
    kept(tmp_path / "a", *STEPS[:2])
    if fork:
        shutil.copytree(tmp_path / "a", tmp_path / "b")
    kept(tmp_path / "a", *STEPS[2:4])
    kept(tmp_path / "b", *reversed(STEPS[:2]))
    shutil.copy(tmp_path / "b" / COPY, tmp_path / "a" / COPY)
    refused(tmp_path / "a", r"do not belong together.*cocalib session repair")


def test_a_session_that_was_written_once_is_opened_as_it_is(tmp_path, project_root):
    history = kept(tmp_path / "new", *STEPS)
    golden = project_root / "tests" / "golden" / "session-2" / JOURNAL
    shutil.copytree(golden.parent, tmp_path / "old")
    found = restored(tmp_path / "old")
    assert (found.history, found.steps, found.note, found.warnings) == (history, len(STEPS), "", ())
    assert files(tmp_path / "old")[JOURNAL] == golden.read_bytes()


def test_a_journal_without_checksums_is_damaged(tmp_path):
    kept(tmp_path, place(1))
    (tmp_path / JOURNAL).write_bytes(b"".join(taken_apart(line).content + b"\n" for line in lines_of(tmp_path)))
    (tmp_path / COPY).unlink()
    refused(tmp_path, "its checksum is missing")


def test_the_copy_has_every_step_when_it_is_confirmed(tmp_path):
    session_file = open_session_file(tmp_path, FACTS)
    history = History()
    for step in map(place, range(14)):
        history = advance(history, step, FACTS)
        session_file.append(step, history)
        assert files(tmp_path)[COPY] == files(tmp_path)[JOURNAL]
    session_file.close()


@pytest.mark.parametrize(
    "other",
    [
        RecordingFacts("other", FACTS.image_times[:-1], 640, 480),
        RecordingFacts("other", FACTS.image_times + 1, 640, 480),
        RecordingFacts("other", FACTS.image_times, 320, 240),
        RecordingFacts("other", np.zeros(0, dtype=np.int64), 640, 480),
    ],
)
def test_a_session_of_another_recording_is_refused_with_a_clear_error(tmp_path, other):
    kept(tmp_path, STEPS[0])
    words = r"the session belongs to 'drive' \(50 frames of 640 x 480 px from 1700000000\.123456789 s\)"
    refused(tmp_path, words, other)


def test_radar_axes_that_changed_since_last_time_give_a_warning_and_harm_no_click(tmp_path):
    kept(tmp_path / "without clicks")
    kept(tmp_path / "s", STEPS[0])
    turned = replace(FACTS, radar_axes="forward,right,up")
    assert restored(tmp_path / "without clicks", turned).warnings == ()
    killed = open_session_file(tmp_path / "s", turned)
    (warning,) = killed.restored.warnings
    assert warning.code == "other-axes"
    assert "now with --radar-axes forward,right,up" in warning.facts["message"]
    assert len(killed.restored.history.present.clicks) == 1
    killed._journal.close()  # as a kill leaves it: nothing is written on the way out
    killed._lock.close()
    assert restored(tmp_path / "s", turned).warnings == ()
    assert "with --radar-axes forward,right,up" in restored(tmp_path / "s").warnings[0].facts["hint"]


def test_a_session_that_is_open_elsewhere_is_refused_until_it_is_closed_for_good(tmp_path):
    session_file = open_session_file(tmp_path / "s", FACTS)
    refused(tmp_path / "s", rf"is already open in process {os.getpid()} on ")
    with pytest.raises(SessionFileError, match="is already open"):
        set_aside(tmp_path / "s")
    session_file.close()
    with pytest.raises(SessionFileError, match="the session is closed"):
        keep(session_file, STEPS[0])
    assert clicks_in(tmp_path / "s") == []
    good = files(tmp_path / "s")[JOURNAL]
    (tmp_path / "s" / JOURNAL).write_bytes(b"no\n")
    (tmp_path / "s" / COPY).unlink()
    refused(tmp_path / "s")
    (tmp_path / "s" / JOURNAL).write_bytes(good)
    restored(tmp_path / "s")  # a refused session is not left locked
    (tmp_path / "file").write_text("")
    refused(tmp_path / "file" / "s", r"cannot be created: .*; give another --session folder")


def test_a_full_disk_refuses_the_step_and_leaves_the_journal_as_it_was(tmp_path, monkeypatch):
    session_file = open_session_file(tmp_path, FACTS)
    history = keep(session_file, STEPS[0])
    before = files(tmp_path)[JOURNAL]
    real_write = os.write

    def full(descriptor: int, data: bytes) -> int:
        if len(data) <= 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real_write(descriptor, data[:20])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(SessionFileError, match="could not be saved and was not made: No space left on device"):
            session_file.append(STEPS[1], history)
    assert files(tmp_path)[JOURNAL] == before
    history = advance(history, STEPS[1], FACTS)
    session_file.append(STEPS[1], history)
    session_file.close()
    assert restored(tmp_path).history == history


def test_a_session_set_aside_is_renamed_with_the_next_free_number(tmp_path):
    folder = tmp_path / "s"
    assert set_aside(folder) is None
    for number in (1, 2):
        kept(folder, STEPS[0])
        assert set_aside(folder) == tmp_path / f"s.{number}"
    assert (tmp_path / "s.1" / JOURNAL).exists()
    assert not folder.exists()


def test_a_session_is_next_to_its_recording_or_in_the_state_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    recording = tmp_path / "drive.bag"
    assert recording_session_folder([recording, tmp_path / "b.bag"]) == tmp_path / "drive.bag.cocalib-session"
    folder = recording_session_folder([tmp_path / "missing" / "drive.bag"])  # which cannot be written
    assert folder.parent == tmp_path / "state" / "cocalib" / "sessions"
    assert re.fullmatch(r"drive\.bag-.*\.cocalib-session", folder.name)
    assert folder != recording_session_folder([tmp_path / "absent" / "drive.bag"])
    there_already = user_session_folder("drive.bag", key=str(recording.resolve()))
    there_already.mkdir(parents=True)
    assert recording_session_folder([recording]) == there_already


@pytest.mark.parametrize(
    ("platform", "variable", "value", "start"),
    [
        ("linux", "XDG_STATE_HOME", "", "home/.local/state/cocalib"),
        ("linux", "XDG_STATE_HOME", "relative", "home/.local/state/cocalib"),
        ("darwin", "XDG_STATE_HOME", "", "home/Library/Application Support/cocalib"),
        ("win32", "LOCALAPPDATA", "", "home/AppData/Local/cocalib"),
    ],
)
def test_the_state_folder_is_the_one_of_the_system(tmp_path, monkeypatch, platform, variable, value, start):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    monkeypatch.setenv(variable, value)
    assert user_session_folder("demo") == tmp_path / start / "sessions" / "demo.cocalib-session"
