"""Session files damaged, cut, exchanged or replaced by links: nothing is changed silently, and no target is touched."""

import errno
import os
import re
import shutil
import stat
from pathlib import Path

import pytest

from benchmarks.reliability.sessions import Made, every_bit, every_kill, every_length, made_session
from calib_core.options import CalibrationOptions
from cocalib.session.applying import advance
from cocalib.session.events import OptionsChanged
from cocalib.session.file.contents import inspect_session, repair_session
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError
from cocalib.session.file.journal import COPY, JOURNAL, bytes_of, sealed, taken_apart
from cocalib.session.file.session_file import open_session_file, set_aside
from tests.unit.app.session.drive import FACTS, clicks_in, files, keep, kept, lines_of, place, refused, restored

POSIX = pytest.mark.skipif(os.name == "nt", reason="Windows needs a right to make links, and has no pipes in folders")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "s"


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made_session(2, tmp_path_factory.mktemp("made") / "short")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "with_other"), [(JOURNAL, True), (JOURNAL, False), (COPY, True)])
def test_no_single_bit_changes_a_session_silently(short, folder, name, with_other):
    counts = every_bit(short, folder, name=name, with_other=with_other)
    assert counts["silently changed"] == counts["continued"] == 0
    assert counts.total() == 8 * len(short.journal)


@pytest.mark.slow
def test_a_kill_at_any_byte_of_a_step_loses_nothing_that_was_confirmed(tmp_path, folder):
    counts = every_kill(made_session(12, tmp_path / "made"), folder)
    assert counts == {"continued": counts.total()}
    assert counts.total() > 2000


@pytest.mark.slow
def test_a_journal_cut_anywhere_is_told_and_a_copy_cut_anywhere_changes_nothing(short, folder):
    counts = every_length(short, folder, name=JOURNAL)
    assert counts == {"continued and told": counts.total()}
    counts = every_length(short, folder, name=COPY)
    assert counts["silently changed"] == counts["refused"] == 0


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: [lines[0], *lines[2:]],
        lambda lines: [lines[0], lines[2], lines[1], *lines[3:]],
        lambda lines: [*lines[:3], lines[2], *lines[3:]],
        lambda lines: [*lines[:3], b"", *lines[3:]],
        lambda lines: [*lines[:3], b"{}", *lines[3:]],
    ],
    ids=["removed", "exchanged", "repeated", "empty line", "inserted"],
)
@pytest.mark.parametrize("with_copy", [True, False])
def test_lines_that_were_moved_are_noticed(folder, change, with_copy):
    kept(folder, *map(place, range(1, 6)))
    (folder / JOURNAL).write_bytes(b"".join(line + b"\n" for line in change(lines_of(folder))))
    if not with_copy:
        (folder / COPY).unlink()
    if not with_copy and len(lines_of(folder)) == 5:
        refused(folder, "the session is damaged: line")
        return
    assert restored(folder).warnings[0].code == "session-damaged"
    assert clicks_in(folder) == [1.0, 2.0, 3.0, 4.0, 5.0]


@POSIX
@pytest.mark.parametrize("name", ["lock", JOURNAL, COPY])
@pytest.mark.parametrize("kind", ["link", "link in an empty folder", "pipe", "folder", "hard link", "dangling link"])
def test_what_is_no_plain_file_is_refused_without_waiting_and_what_it_leads_to_is_untouched(
    tmp_path, folder, name, kind
):
    other = tmp_path / "other"
    if kind == "link in an empty folder":
        folder.mkdir()
    else:
        kept(folder, place(1))
        (folder / name).unlink()
    if "dangling" not in kind:
        other.write_bytes(b"precious\n")
    match kind:
        case "pipe":
            os.mkfifo(folder / name)
        case "folder":
            (folder / name).mkdir()
        case "hard link":
            (folder / name).hardlink_to(other)
        case _:
            (folder / name).symlink_to(other)
    reason = refused(folder, rf"{name}: (is a|has 2 names)")
    if "link" in kind and kind != "hard link":
        assert "is a symbolic link" in reason
        with pytest.raises(SessionFileError):
            repair_session(folder)
    assert not other.exists() if kind == "dangling link" else other.read_bytes() == b"precious\n"


@POSIX
def test_a_session_folder_that_is_a_link_is_refused(tmp_path, folder):
    kept(tmp_path / "real", place(1))
    before = files(tmp_path / "real")
    folder.symlink_to(tmp_path / "real")
    for attempt in (lambda: open_session_file(folder, FACTS), lambda: set_aside(folder)):
        with pytest.raises(SessionFileError, match="is a symbolic link, which is not followed"):
            attempt()
    assert files(tmp_path / "real") == before
    folder.unlink()
    folder.symlink_to(tmp_path / "nowhere")
    refused(folder, "is a symbolic link")
    assert not (tmp_path / "nowhere").exists()


@POSIX
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a file to another user")
@pytest.mark.parametrize("name", ["", "lock", JOURNAL, COPY])
def test_what_belongs_to_another_user_is_refused(folder, name):
    kept(folder, place(1))
    os.chown(folder / name, 12345, -1)
    refused(folder, r"belongs to user 12345, not to you \(user 0\)")


@POSIX
def test_a_link_put_in_place_of_the_copy_while_the_session_is_open_is_not_followed(tmp_path, folder):
    target = tmp_path / "target"
    session_file = open_session_file(folder, FACTS)
    history = keep(session_file, *map(place, range(10)))
    target.write_bytes(b"precious\n")
    (folder / COPY).unlink()
    (folder / COPY).symlink_to(target)
    session_file.append(place(20), advance(history, place(20), FACTS))
    assert session_file.close().note.startswith("all clicks are saved")
    assert target.read_bytes() == b"precious\n"


@pytest.mark.parametrize("change", ["cut", "longer", "replaced", "in place"])
def test_a_step_is_refused_when_another_program_changed_the_journal(folder, change):
    session_file = open_session_file(folder, FACTS)
    history, journal = keep(session_file, *map(place, (1, 2, 3))), folder / JOURNAL
    if change == "replaced":
        shutil.copy(journal, folder / "copy")
        (folder / "copy").replace(journal)
    elif change == "in place":
        journal.write_bytes(journal.read_bytes()[:-40] + b"X" + journal.read_bytes()[-39:])
    else:
        os.truncate(journal, journal.stat().st_size + (1 if change == "longer" else -5))
    before = journal.read_bytes()
    if change != "in place":
        words = "deleted, moved or replaced" if change == "replaced" else "another program changed its length"
        with pytest.raises(SessionFileError, match=rf"was not made: .*{words}"):
            session_file.append(place(4), advance(history, place(4), FACTS))
    assert journal.read_bytes() == before
    left = session_file.close()
    assert "All clicks (3)" in left.note
    assert left.kept_in == folder / COPY
    assert clicks_in(folder) == [1.0, 2.0, 3.0]


@POSIX
@pytest.mark.parametrize("how", ["deleted", "moved", "replaced"])
def test_a_folder_that_went_away_is_written_to_the_users_folder_and_found_again(tmp_path, folder, state, how):
    session_file = open_session_file(folder, FACTS)
    history = keep(session_file, *map(place, (1, 2, 3)))
    if how == "deleted":
        shutil.rmtree(folder)
    else:
        folder.rename(tmp_path / "moved")
    if how == "replaced":
        folder.mkdir()
    with pytest.raises(SessionFileError, match="was not made"):
        session_file.append(place(4), advance(history, place(4), FACTS))
    left = session_file.close()
    assert left is session_file.close()
    assert left.kept_in == state / "sessions" / "drive-rescued-1.cocalib-session"
    assert "deleted, moved or replaced" in left.note
    assert clicks_in(left.kept_in) == [1.0, 2.0, 3.0]
    assert how == "replaced" or not folder.exists()


def refuse(monkeypatch: pytest.MonkeyPatch, error: OSError, *names: str) -> None:
    """Let calls of the system fail from now on."""

    def fail(*_: object, **__: object) -> None:
        raise error

    for name in names:
        monkeypatch.setattr(os, name, fail)


FULL = OSError(errno.ENOSPC, "No space left on device")


@POSIX
@pytest.mark.parametrize("is_there", [True, False], ids=["full disk", "no folder, too"])
def test_without_any_place_to_write_the_end_says_whether_the_clicks_are_lost(folder, monkeypatch, is_there):
    session_file = open_session_file(folder, FACTS)
    keep(session_file, place(1), place(2))
    if not is_there:
        shutil.rmtree(folder)
    with monkeypatch.context() as patch:
        refuse(patch, FULL, "write")
        left = session_file.close()
    if is_there:
        assert left.note.startswith("all clicks are saved")
        assert set(files(folder)) == {JOURNAL, COPY}
        assert clicks_in(folder) == [1.0, 2.0]
    else:
        assert left.kept_in is None
        assert re.match(r"the clicks \(2\) could", left.note)
        assert FULL.strerror in left.note


def test_a_disk_that_cannot_even_truncate_stops_the_session(folder, monkeypatch):
    session_file = open_session_file(folder, FACTS)
    history = keep(session_file, place(1))
    with monkeypatch.context() as patch:
        refuse(patch, OSError(errno.EIO, "Input/output error"), "fsync", "ftruncate")
        with pytest.raises(SessionFileError, match="Input/output error"):
            session_file.append(place(2), history)
    with pytest.raises(SessionFileError, match="the session is closed"):
        session_file.append(place(2), history)
    session_file.close()


DEEP = b"[" * 100_000 + b"]" * 100_000


@pytest.mark.parametrize(
    "value", [DEEP, b'"\\ud800"', b"1e308", b"-1", b"NaN", b"9" * 400, b"null", b"{}"], ids=lambda value: value[:9]
)
@pytest.mark.parametrize("key", [b'"options":', b'"name":', b'"steps":', b'"pixel_px":', b'"recording":', b'"sec":'])
def test_odd_content_with_right_checksums_is_refused_or_read_but_never_crashes(folder, key, value):
    kept(folder, place(1), OptionsChanged.of(CalibrationOptions(method="paper")))
    with_value = re.compile(re.escape(key) + rb"[^,\]}]*")
    lines, previous = [], ""
    for line in lines_of(folder):
        lines.append(sealed(with_value.sub(lambda _: key + value, taken_apart(line).content), previous))
        previous = lines[-1].sum
    for name in (JOURNAL, COPY):
        (folder / name).write_bytes(bytes_of(lines))
        before = files(folder)
        try:
            inspect_session(folder)
            restored(folder)
        except SessionFileError:
            assert files(folder) == before


class Killed(BaseException):
    """The process ends here."""


@pytest.mark.parametrize("survived", range(4))
def test_a_kill_between_the_writes_of_a_repair_loses_nothing(folder, monkeypatch, survived):
    kept(folder, *map(place, (1, 2, 3)))
    (folder / JOURNAL).write_bytes(lines_of(folder)[0] + b"\n")
    real, calls = GuardedFolder.create, []

    def create(self: GuardedFolder, name: str, data: bytes) -> None:
        if len(calls) == survived:
            raise Killed
        calls.append(name)
        real(self, name, data)

    with monkeypatch.context() as patch:
        patch.setattr(GuardedFolder, "create", create)
        with pytest.raises(Killed):
            open_session_file(folder, FACTS)
    assert clicks_in(folder) == [1.0, 2.0, 3.0]


@POSIX
def test_session_files_are_as_open_to_others_as_the_user_wants(folder):
    before = os.umask(0o077)
    try:
        kept(folder, *map(place, range(10)))
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()}
    assert modes == {"lock": 0o600, JOURNAL: 0o600, COPY: 0o600}


@pytest.mark.parametrize(
    ("content", "why"),
    [(b"", "the file is empty"), (b"\0" * 5000, "it holds only zeros"), (b"[" * 5000, "it has no end")],
)
def test_a_journal_without_a_line_is_described_as_it_is(tmp_path, content, why):
    (tmp_path / JOURNAL).write_bytes(content)
    refused(tmp_path, re.escape(f"line 1 is damaged ({why})"))


@POSIX
def test_a_journal_that_can_no_longer_be_written_is_not_called_closed(folder, monkeypatch):
    session_file = open_session_file(folder, FACTS)
    history = keep(session_file, place(1), place(2))
    with monkeypatch.context() as patch:
        refuse(patch, PermissionError(errno.EPERM, "Operation not permitted"), "write", "ftruncate")
        with pytest.raises(SessionFileError, match="make the file writable again"):
            session_file.append(place(3), advance(history, place(3), FACTS))
    closed = session_file.close()
    assert closed.clicks == 2
    assert closed.fault.endswith("no longer be written")


def test_a_replaced_file_is_on_disk_before_its_name_and_the_name_before_it_is_told(tmp_path, monkeypatch):
    calls: list[str] = []
    for name in ("fsync", "replace"):
        real = getattr(os, name)

        def noted(*given, name=name, real=real, **named):
            is_folder = name == "fsync" and stat.S_ISDIR(os.fstat(given[0]).st_mode)
            calls.append("folder" if is_folder else name)
            return real(*given, **named)

        monkeypatch.setattr(os, name, noted)
    folder = GuardedFolder(tmp_path / "session", create=True)
    calls.clear()
    folder.replace("journal.jsonl", b"{}")
    folder.close()
    assert calls[-2:] == ["replace", "folder"]
    assert "fsync" in calls[:-2]
