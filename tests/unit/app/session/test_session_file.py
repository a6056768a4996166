"""A session on disk: what is stored, what is restored, and what is refused without being changed."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from calib_core.json_forms import from_json, to_json
from calib_core.measurements import ChosenReturn, ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from cocalib.session import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    History,
    OptionsChanged,
    PlacementDismissed,
    RecordingFacts,
    Redo,
    ReturnChosen,
    Solved,
    Undo,
    WarningsAcknowledged,
    advance,
)
from cocalib.session.file import (
    SessionFileError,
    open_session_file,
    recording_session_folder,
    set_aside,
    user_session_folder,
)
from cocalib.session.file.journal import Line, bytes_of, sealed, taken_apart
from tests.unit.app.session.drive import FACTS, START_NS, TIMES, files, keep, kept

EARLIER_STEPS = (
    ClickPlaced(TIMES[3], (100.1, 200.2), None),
    ClickPlaced(TIMES[1], (0.1 + 0.2, 1e-17), None),
    ClickMoved("c1", (101.0, 201.0)),
    OptionsChanged.of(CalibrationOptions(method="paper", solving=SolvingOptions(CameraPositionPrior((0.1, 0.2, 0.3))))),
    ClickExcluded("c2", True),
    Undo(),
    Redo(),
    ClicksImported.of((ReflectorClick(TIMES[9], "p1", 5.0, 6.0, 0.5, True),)),
    ClickRemoved("c1"),
    Cleared(),
    Undo(),
)
"""Those of tests/golden/session-1, of a version that kept one click per frame."""
STEPS = (
    *EARLIER_STEPS,
    Undo(),
    ClickPlaced(TIMES[3], (300.5, 20.25), "snapped", 0.3),
    ClickPlaced(TIMES[4], (30.5, 20.25), "untouched"),
    ReturnChosen("p1", ChosenReturn((20.0, 0.1 + 0.2, -0.5), TIMES[9], "/radar")),
    PlacementDismissed(TIMES[7], (5.0, 1.0, 0.1 + 0.2)),
    WarningsAcknowledged(("few-pairs", "weak-geometry")),
    ClickRemoved("c1"),
    Cleared(),
    Undo(),
)


@pytest.mark.parametrize("step", STEPS, ids=lambda step: type(step).__name__)
def test_a_step_comes_back_from_its_json_form_bit_for_bit(step) -> None:
    text = msgspec.json.encode(Line(1, step), enc_hook=to_json)
    assert msgspec.json.decode(text, type=Line, dec_hook=from_json).step == step


def test_answers_are_not_journalled(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    with pytest.raises(TypeError, match="Solved is not journalled"):
        session_file.append(Solved(1, Unsolvable("a", "b", "c")), History())
    session_file.close()


def test_a_session_comes_back_with_everything_that_can_be_undone_and_redone(tmp_path: Path) -> None:
    history = kept(tmp_path / "s", *STEPS)
    session_file = open_session_file(tmp_path / "s", FACTS)
    assert session_file.restored.history == history
    assert session_file.restored.steps == len(STEPS)
    assert session_file.restored.note == ""
    session_file.close()


def test_a_session_continues_where_it_stopped(tmp_path: Path) -> None:
    kept(tmp_path, ClickPlaced(TIMES[1], (1.0, 1.0), "clicked"))
    kept(tmp_path, ClickPlaced(TIMES[2], (2.0, 2.0), "clicked"))
    history = kept(tmp_path, Undo())
    assert [click.id for click in history.present.clicks] == ["c1"]
    assert (tmp_path / "journal.jsonl").read_text().count("\n") == 4


def test_the_journal_is_only_ever_appended_to(tmp_path: Path) -> None:
    kept(tmp_path, *STEPS[:4])
    before = (tmp_path / "journal.jsonl").read_bytes()
    kept(tmp_path, *STEPS[4:])
    assert (tmp_path / "journal.jsonl").read_bytes().startswith(before)


def test_a_step_is_in_the_journal_before_append_returns(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    keep(session_file, STEPS[0])
    assert b'"click_placed"' in (tmp_path / "journal.jsonl").read_bytes()
    session_file.close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
@pytest.mark.parametrize("confirmed", [0, 1, 9, 23])
def test_a_process_killed_outright_loses_nothing_that_was_confirmed(tmp_path: Path, confirmed: int) -> None:
    script = textwrap.dedent(
        f"""
        import numpy as np
        from calib_core.measurements import TimeNs
        from pathlib import Path
        from cocalib.session import ClickPlaced, RecordingFacts, advance
        from cocalib.session.file import open_session_file
        facts = RecordingFacts("drive", {START_NS} + 100_000_000 * np.arange(50), 640, 480)
        session_file = open_session_file(Path({str(tmp_path)!r}), facts)
        history = session_file.restored.history
        print("open", flush=True)
        for number in range(1_000_000):
            step = ClickPlaced(TimeNs(facts.image_times[number % 50]), (float(number % 640), 1.0), "clicked")
            history = advance(history, step, facts)
            session_file.append(step, history)
            print(number, flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(1 + confirmed):
            assert process.stdout.readline()
        process.kill()  # at whatever it is doing
        confirmed += len(process.stdout.readlines())
    assert process.returncode == -signal.SIGKILL
    session_file = open_session_file(tmp_path, FACTS)
    clicks = session_file.restored.history.present.clicks
    assert confirmed <= session_file.restored.steps <= confirmed + 1
    assert {click.u_px for click in clicks} >= {float(number % 640) for number in range(confirmed)}
    assert session_file.restored.warnings == ()
    session_file.close()
    assert (tmp_path / "journal.jsonl").read_bytes() == (tmp_path / "journal-copy.jsonl").read_bytes()


def test_a_half_written_last_line_is_dropped_and_reported(tmp_path: Path) -> None:
    history = kept(tmp_path, *STEPS[:3])
    journal = tmp_path / "journal.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(whole + b'{"n":4,"step":{"type":"cle')
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert session_file.restored.torn_bytes == 26
    assert "not in the session" in session_file.restored.note
    keep(session_file, STEPS[3])
    session_file.close()
    assert journal.read_bytes().startswith(whole + b'{"n":4,"step":{"type":"options_changed"')


def damaged(line: int, text: bytes, whole: bytes) -> bytes:
    lines = whole.split(b"\n")
    lines[line] = text
    return b"\n".join(lines)


def reseal(line: int, content: bytes, whole: bytes) -> bytes:
    """Exchange the content of a line, with a right checksum as another version of the program would write it."""
    lines = [taken_apart(each) for each in whole.split(b"\n")[:-1]]
    lines[line] = sealed(content, lines[line - 1].sum if line else "")
    return bytes_of(lines)


DAMAGE = [
    (2, b'{"n":2,"step":{"type":"click_placed","image', "line 3 is damaged"),
    (2, b"\x00\x00\xff\xfe", "line 3 is damaged"),
    (2, b"", "line 3 is damaged"),
    (2, b'{"n":2,"step":{"type":"cleared"}}', "line 3 is damaged (it has no checksum)"),
    (0, b"{}", "line 1 is damaged"),
    (0, b'{"schema":"cocalib/session-2"', "line 1 is damaged"),
    (0, b"", "line 1 is damaged"),
]


@pytest.mark.parametrize(("line", "text", "words"), DAMAGE)
def test_a_damaged_journal_without_a_copy_is_refused_and_left_alone(
    tmp_path: Path, line: int, text: bytes, words: str
) -> None:
    kept(tmp_path, *STEPS[:4])
    (tmp_path / "journal-copy.jsonl").unlink()
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(damaged(line, text, journal.read_bytes()))
    before = files(tmp_path)
    with pytest.raises(SessionFileError) as refused:
        open_session_file(tmp_path, FACTS)
    assert words in str(refused.value)
    assert "cocalib session repair" in str(refused.value) or "nothing of the session can be proven" in str(
        refused.value
    )
    assert files(tmp_path) == before


@pytest.mark.parametrize(("line", "text", "words"), DAMAGE)
def test_a_damaged_journal_whose_copy_is_whole_continues_with_both_kept(
    tmp_path: Path, line: int, text: bytes, words: str
) -> None:
    history = kept(tmp_path, *STEPS[:4])
    journal, copy = tmp_path / "journal.jsonl", tmp_path / "journal-copy.jsonl"
    journal.write_bytes(damaged(line, text, journal.read_bytes()))
    before = files(tmp_path)
    session_file = open_session_file(tmp_path, FACTS)
    (warning,) = session_file.restored.warnings
    assert warning.code == "session-damaged"
    assert words in warning.message
    assert session_file.restored.history == history
    assert (tmp_path / "journal.jsonl.backup-1").read_bytes() == before["journal.jsonl"]
    assert (tmp_path / "journal-copy.jsonl.backup-1").read_bytes() == before["journal-copy.jsonl"]
    session_file.close()
    again = open_session_file(tmp_path, FACTS)
    assert again.restored.warnings == ()
    assert again.restored.history == history
    again.close()
    assert copy.read_bytes() == journal.read_bytes() == before["journal-copy.jsonl"]


def test_what_one_file_has_lost_comes_from_the_other(tmp_path: Path) -> None:
    history = kept(tmp_path, *STEPS[:6])
    for name, line in (("journal.jsonl", 2), ("journal-copy.jsonl", 5)):
        (tmp_path / name).write_bytes(damaged(line, b"", (tmp_path / name).read_bytes()))
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert "line 3 is damaged" in session_file.restored.warnings[0].message
    assert "in the copy, line 6 is damaged" in session_file.restored.warnings[0].message
    session_file.close()


def test_a_damaged_line_that_no_file_has_is_refused(tmp_path: Path) -> None:
    kept(tmp_path, *STEPS[:2])
    copy = (tmp_path / "journal-copy.jsonl").read_bytes()
    kept(tmp_path, *STEPS[2:5])
    (tmp_path / "journal-copy.jsonl").write_bytes(copy)  # as a power failure may leave it
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(damaged(4, b"", journal.read_bytes()))
    before = files(tmp_path)
    with pytest.raises(SessionFileError, match=r"line 5 is damaged .*cocalib session repair"):
        open_session_file(tmp_path, FACTS)
    assert files(tmp_path) == before


def test_a_copy_that_is_behind_is_brought_up_to_date_without_a_word(tmp_path: Path) -> None:
    history = kept(tmp_path, *STEPS[:5])
    journal, copy = tmp_path / "journal.jsonl", tmp_path / "journal-copy.jsonl"
    for length in range(len(copy.read_bytes())):
        if length:
            copy.write_bytes(journal.read_bytes()[:length])
        else:
            copy.unlink()
        if 0 < length <= journal.read_bytes().index(b"\n"):
            continue  # a copy without a first line is damaged
        session_file = open_session_file(tmp_path, FACTS)
        assert session_file.restored.history == history
        assert session_file.restored.warnings == ()
        session_file.close()
        assert copy.read_bytes() == journal.read_bytes()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'{"n":2,"step":{"type":"click_removed","id":"c9"}}', "there is no click 'c9'"),
        (b'{"n":2,"step":{"type":"options_changed","options":{"nois":{}}}}', "unknown option 'nois'"),
        (b'{"n":2,"step":{"type":"juggled"}}', "Invalid value 'juggled'"),
    ],
)
def test_a_step_that_this_version_does_not_understand_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    kept(tmp_path, *STEPS[:2])
    (tmp_path / "journal-copy.jsonl").unlink()
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(reseal(2, content, journal.read_bytes()))
    with pytest.raises(SessionFileError) as refused:
        open_session_file(tmp_path, FACTS)
    assert words in str(refused.value)


def test_a_journal_of_another_version_is_refused_with_that_version_named(tmp_path: Path) -> None:
    kept(tmp_path)
    journal = tmp_path / "journal.jsonl"
    head = taken_apart(journal.read_bytes().removesuffix(b"\n")).content
    journal.write_bytes(reseal(0, head.replace(b"cocalib/session-2", b"cocalib/session-9"), journal.read_bytes()))
    with pytest.raises(SessionFileError, match=r"cocalib/session-9.*with that version"):
        open_session_file(tmp_path, FACTS)


def test_a_journal_cut_to_its_first_line_gives_the_steps_of_the_copy(tmp_path: Path) -> None:
    history = kept(tmp_path, *(ClickPlaced(time, (1.0, 1.0), "clicked") for time in TIMES[:20]))
    journal = tmp_path / "journal.jsonl"
    cut = journal.read_bytes().partition(b"\n")[0] + b"\n"
    journal.write_bytes(cut)
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert "the journal holds 0 steps, its copy 20" in session_file.restored.warnings[0].message
    session_file.close()
    assert (tmp_path / "journal.jsonl.backup-1").read_bytes() == cut


@pytest.mark.parametrize("fork", [False, True])
def test_a_copy_of_another_journal_is_refused_until_a_person_decides(tmp_path: Path, fork: bool) -> None:
    kept(tmp_path / "a", *STEPS[:2])
    if fork:
        shutil.copytree(tmp_path / "a", tmp_path / "b")
    kept(tmp_path / "a", *STEPS[2:4])
    kept(tmp_path / "b", *reversed(STEPS[:2]))
    shutil.copy(tmp_path / "b" / "journal-copy.jsonl", tmp_path / "a" / "journal-copy.jsonl")
    before = files(tmp_path / "a")
    with pytest.raises(SessionFileError, match=r"do not belong together.*cocalib session repair"):
        open_session_file(tmp_path / "a", FACTS)
    assert files(tmp_path / "a") == before


WITH_SNAPSHOT = {
    "whole": (33, "", ""),
    "killed": (33, "", ""),
    "killed-early": (4, "", ""),
    "repaired": (8, "", ""),
    "torn": (33, "not in the session", ""),
    "cut": (8, "from the last snapshot", "the journal holds 6 steps, its snapshot 33"),
    "damaged": (10, "from the last snapshot", "line 6 is damaged"),
    "snapshot-only": (8, "from the last snapshot", ""),
}
"""Steps, note and warning of the sessions in tests/golden/session-2, of a version that kept a snapshot."""


@pytest.mark.parametrize("case", WITH_SNAPSHOT)
def test_a_session_of_a_version_with_snapshots_is_opened(tmp_path: Path, project_root: Path, case: str) -> None:
    steps, note, warning = WITH_SNAPSHOT[case]
    shutil.copytree(project_root / "tests" / "golden" / "session-2" / case, tmp_path, dirs_exist_ok=True)
    before = files(tmp_path)
    session_file = open_session_file(tmp_path, FACTS)
    restored = session_file.restored
    present = restored.history.present
    expected = ["p1"] if case == "killed-early" else ["p1", "c3", "c4", "c5", "c6", "c7"]
    assert len(present.clicks) == (2 if case == "killed-early" else len(expected))
    if case != "killed-early":
        assert (present.column_map, present.confirmed, len(present.boxes)) == (("x=a",), ("metres",), 1)
        assert present.intrinsics is not None
    assert restored.steps == steps
    assert note in restored.note
    assert [warning in one.message for one in restored.warnings] == [True] * bool(warning)
    session_file.close()
    for name, content in files(tmp_path).items():
        assert before.get(name.removesuffix(".backup-1"), content) == content or not name.endswith(".backup-1")
    if not restored.from_snapshot and case != "torn":
        assert {name: content for name, content in files(tmp_path).items() if "copy" not in name} == before
    again = open_session_file(tmp_path, FACTS)
    assert again.restored.history == restored.history
    assert again.restored.warnings == ()
    again.close()


def test_a_session_of_a_version_with_snapshots_that_lost_a_confirmed_step_is_refused(
    tmp_path: Path, project_root: Path
) -> None:
    shutil.copytree(
        project_root / "tests" / "golden" / "session-2" / "damaged-at-the-end", tmp_path, dirs_exist_ok=True
    )
    before = files(tmp_path)
    with pytest.raises(SessionFileError, match="line 34 is damaged"):
        open_session_file(tmp_path, FACTS)
    assert files(tmp_path) == before


def test_a_session_of_the_earlier_version_is_opened_and_written_again_with_checksums(
    tmp_path: Path, project_root: Path
) -> None:
    shutil.copytree(project_root / "tests" / "golden" / "session-1", tmp_path, dirs_exist_ok=True)
    before = files(tmp_path)
    history = History()
    for step in EARLIER_STEPS:
        history = advance(history, step, FACTS)
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert session_file.restored.warnings == ()
    session_file.close()
    assert (tmp_path / "journal.jsonl.backup-1").read_bytes() == before["journal.jsonl"]
    assert (tmp_path / "session.json.backup-1").read_bytes() == before["session.json"]
    assert b"cocalib/session-2" in (tmp_path / "journal.jsonl").read_bytes()
    again = open_session_file(tmp_path, FACTS)
    assert again.restored.history == history
    again.close()


def test_a_session_of_the_earlier_version_cut_to_its_first_line_gives_the_clicks_of_the_snapshot(
    tmp_path: Path, project_root: Path
) -> None:
    shutil.copytree(project_root / "tests" / "golden" / "session-1", tmp_path, dirs_exist_ok=True)
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().partition(b"\n")[0] + b"\n")
    session_file = open_session_file(tmp_path, FACTS)
    assert [click.id for click in session_file.restored.history.present.clicks] == ["c2", "p1"]
    assert session_file.restored.warnings[0].code == "session-damaged"
    session_file.close()


def test_after_the_journal_is_lost_the_copy_brings_the_session_back(tmp_path: Path) -> None:
    history = kept(tmp_path, *STEPS[:5])
    (tmp_path / "journal.jsonl").rename(tmp_path / "journal.damaged")
    session_file = open_session_file(tmp_path, FACTS)
    assert session_file.restored.history == history
    assert "the journal is missing" in session_file.restored.warnings[0].message
    session_file.close()
    again = open_session_file(tmp_path, FACTS)
    assert again.restored.history == history
    assert again.restored.warnings == ()
    again.close()


def test_a_damaged_copy_is_refused_only_when_it_is_needed(tmp_path: Path) -> None:
    kept(tmp_path, *STEPS[:2])
    copy = tmp_path / "journal-copy.jsonl"
    copy.write_text("{")
    session_file = open_session_file(tmp_path, FACTS)
    assert "in the copy, line 1 is damaged" in session_file.restored.warnings[0].message
    assert (tmp_path / "journal-copy.jsonl.backup-1").read_text() == "{"
    session_file.close()
    copy.write_text("{")
    (tmp_path / "journal.jsonl").unlink()
    with pytest.raises(SessionFileError, match="nothing of the session can be proven: line 1 is damaged"):
        open_session_file(tmp_path, FACTS)
    assert not (tmp_path / "journal.jsonl").exists()


def test_the_copy_has_every_step_when_it_is_confirmed(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    history = History()
    for time in TIMES[:14]:
        step = ClickPlaced(time, (1.0, 1.0), "clicked")
        history = advance(history, step, FACTS)
        session_file.append(step, history)
        assert (tmp_path / "journal-copy.jsonl").read_bytes() == (tmp_path / "journal.jsonl").read_bytes()
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
def test_a_session_of_another_recording_is_refused_with_a_clear_error(tmp_path: Path, other: RecordingFacts) -> None:
    kept(tmp_path, STEPS[0])
    with pytest.raises(
        SessionFileError,
        match=r"the session belongs to 'drive' \(50 frames of 640 x 480 px from 1700000000\.123456789 s\)",
    ):
        open_session_file(tmp_path, other)


def test_a_recording_that_was_renamed_is_still_the_same(tmp_path: Path) -> None:
    history = kept(tmp_path, STEPS[0])
    session_file = open_session_file(tmp_path, RecordingFacts("renamed", FACTS.image_times, 640, 480))
    assert session_file.restored.history == history
    session_file.close()


def test_radar_axes_that_changed_since_last_time_give_a_warning_and_harm_no_click(tmp_path: Path) -> None:
    kept(tmp_path, STEPS[0])
    turned = replace(FACTS, radar_axes="forward,right,up")
    killed = open_session_file(tmp_path, turned)
    (warning,) = killed.restored.warnings
    assert warning.code == "other-axes"
    assert "last opened without --radar-axes, now with --radar-axes forward,right,up" in warning.message
    assert len(killed.restored.history.present.clicks) == 1
    killed._journal.close()  # as a kill leaves it: nothing is written on the way out
    killed._lock.close()
    again = open_session_file(tmp_path, turned)
    assert again.restored.warnings == ()
    again.close()
    forgotten = open_session_file(tmp_path, FACTS)
    assert "start again with --radar-axes forward,right,up" in forgotten.restored.warnings[0].hint
    forgotten.close()


def test_a_session_without_clicks_gives_no_warning_about_axes(tmp_path: Path) -> None:
    kept(tmp_path)
    opened = open_session_file(tmp_path, replace(FACTS, radar_axes="degrees"))
    assert opened.restored.warnings == ()
    opened.close()


def test_a_session_that_is_open_elsewhere_is_refused_with_the_process_named(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    with pytest.raises(SessionFileError, match=rf"is already open in process {os.getpid()} on "):
        open_session_file(tmp_path, FACTS)
    session_file.close()
    open_session_file(tmp_path, FACTS).close()


def test_a_refused_session_is_not_left_locked(tmp_path: Path) -> None:
    kept(tmp_path, STEPS[0])
    journal = tmp_path / "journal.jsonl"
    good = journal.read_bytes()
    journal.write_bytes(b"no\n")
    (tmp_path / "journal-copy.jsonl").unlink()
    with pytest.raises(SessionFileError):
        open_session_file(tmp_path, FACTS)
    journal.write_bytes(good)
    open_session_file(tmp_path, FACTS).close()


def test_a_full_disk_refuses_the_step_and_leaves_the_journal_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    history = keep(session_file, STEPS[0])
    before = (tmp_path / "journal.jsonl").read_bytes()
    real_write = os.write

    def full(descriptor: int, data: bytes) -> int:
        if len(data) <= 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real_write(descriptor, data[:20])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(SessionFileError, match="could not be saved and was not made: No space left on device"):
            session_file.append(STEPS[1], history)
    assert (tmp_path / "journal.jsonl").read_bytes() == before
    history = advance(history, STEPS[1], FACTS)
    session_file.append(STEPS[1], history)
    session_file.close()
    again = open_session_file(tmp_path, FACTS)
    assert again.restored.history == history
    again.close()


def test_a_disk_that_cannot_even_truncate_stops_the_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    history = keep(session_file, STEPS[0])

    def broken(*_: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", broken)
        patch.setattr(os, "ftruncate", broken)
        with pytest.raises(SessionFileError, match="Input/output error"):
            session_file.append(STEPS[1], history)
    with pytest.raises(SessionFileError, match="the session is closed"):
        session_file.append(STEPS[1], history)
    session_file.close()


def test_a_closed_session_writes_into_no_other_file(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path / "s", FACTS)
    session_file.close()
    with (tmp_path / "other").open("w+b") as other:
        with pytest.raises(SessionFileError, match="the session is closed"):
            keep(session_file, STEPS[0])
        assert other.read() == b""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not delete open files")
def test_a_folder_deleted_under_an_open_session_is_noticed(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    (tmp_path / "journal.jsonl").unlink()
    with pytest.raises(SessionFileError, match="was deleted, moved or replaced while the session was open"):
        keep(session_file, STEPS[0])
    session_file.close()


def test_a_path_that_is_no_folder_is_refused_with_a_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SessionFileError, match=r"cannot be created: .*; give another --session folder"):
        open_session_file(tmp_path / "file" / "s", FACTS)


def test_a_session_set_aside_is_renamed_with_the_next_free_number(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    assert set_aside(folder) is None
    for number in (1, 2):
        kept(folder, STEPS[0])
        assert set_aside(folder) == tmp_path / f"s.{number}"
    assert (tmp_path / "s.1" / "journal.jsonl").exists()
    assert not folder.exists()


def test_a_session_that_is_open_is_not_set_aside(tmp_path: Path) -> None:
    session_file = open_session_file(tmp_path / "s", FACTS)
    with pytest.raises(SessionFileError, match="is already open"):
        set_aside(tmp_path / "s")
    session_file.close()
    assert (tmp_path / "s" / "journal.jsonl").exists()


def test_the_session_is_stored_next_to_its_recording(tmp_path: Path) -> None:
    assert (
        recording_session_folder([tmp_path / "drive.bag", tmp_path / "b.bag"]) == tmp_path / "drive.bag.cocalib-session"
    )


def test_if_the_folder_cannot_be_written_the_session_is_stored_in_the_state_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    folder = recording_session_folder([tmp_path / "missing" / "drive.bag"])
    assert folder.parent == tmp_path / "state" / "cocalib" / "sessions"
    assert folder.name.startswith("drive.bag-")
    assert folder.name.endswith(".cocalib-session")
    assert folder != recording_session_folder([tmp_path / "absent" / "drive.bag"])


def test_a_session_that_exists_in_the_state_folder_is_found_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    recording = tmp_path / "drive.bag"
    in_state_folder = user_session_folder("drive.bag", key=str(recording.resolve()))
    in_state_folder.mkdir(parents=True)
    assert recording_session_folder([recording]) == in_state_folder


@pytest.mark.parametrize(
    ("platform", "variable", "value", "start"),
    [
        ("linux", "XDG_STATE_HOME", "", "home/.local/state/cocalib"),
        ("linux", "XDG_STATE_HOME", "relative", "home/.local/state/cocalib"),
        ("darwin", "XDG_STATE_HOME", "", "home/Library/Application Support/cocalib"),
        ("win32", "LOCALAPPDATA", "", "home/AppData/Local/cocalib"),
    ],
)
def test_the_state_folder_is_the_one_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, platform: str, variable: str, value: str, start: str
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    monkeypatch.setenv(variable, value)
    assert user_session_folder("demo") == tmp_path / start / "sessions" / "demo.cocalib-session"


def test_a_restored_session_asks_for_an_answer(tmp_path: Path) -> None:
    history = kept(tmp_path, STEPS[0])
    session_file = open_session_file(tmp_path, FACTS)
    session_file.close()
    assert session_file.restored.history.present.needs_solving
    assert replace(history.present, outcome=None) == session_file.restored.history.present
