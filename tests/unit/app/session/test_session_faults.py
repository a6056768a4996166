"""Session files damaged, cut, exchanged or replaced by links: nothing is changed silently, and no target is touched."""

import errno
import os
import re
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.reliability.sessions import (
    FACTS as MADE_FACTS,
)
from benchmarks.reliability.sessions import (
    Made,
    every_bit,
    every_kill,
    every_length,
    made_session,
    sampled_bits,
)
from calib_core.options import CalibrationOptions
from cocalib.session import ClickPlaced, History, OptionsChanged, advance
from cocalib.session.file import (
    SessionFile,
    SessionFileError,
    inspect_session,
    open_session_file,
    repair_session,
    set_aside,
)
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.journal import COPY, JOURNAL, bytes_of, sealed, taken_apart
from tests.unit.app.session.drive import FACTS, TIMES, keep

POSIX = pytest.mark.skipif(os.name == "nt", reason="Windows needs a right to make links, and has no pipes in folders")


@pytest.fixture(autouse=True)
def own_state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "cocalib" / "sessions"


def clicked(session_file: SessionFile, *frames: int) -> History:
    return keep(session_file, *(ClickPlaced(TIMES[frame], (float(frame), 1.0), "clicked") for frame in frames))


def closed_session(folder: Path, *frames: int) -> None:
    session_file = open_session_file(folder, FACTS)
    clicked(session_file, *frames)
    assert session_file.close().note.startswith("all clicks are saved in ")


def clicks_in(folder: Path) -> list[float]:
    session_file = open_session_file(folder, FACTS)
    session_file.close()
    return [click.u_px for click in session_file.restored.history.present.clicks]


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made_session(2, tmp_path_factory.mktemp("made") / "short")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "with_other"),
    [(JOURNAL, True), (JOURNAL, False), (COPY, True), (COPY, False)],
)
def test_no_single_bit_changes_a_session_silently(short: Made, tmp_path: Path, name: str, with_other: bool) -> None:
    counts = every_bit(short, tmp_path / "s", name=name, with_other=with_other)
    assert counts["silently changed"] == 0
    assert counts["continued"] == 0
    assert counts.total() == 8 * len(short.journal)


@pytest.mark.slow
@pytest.mark.parametrize("with_other", [True, False])
def test_no_sampled_bit_of_a_longer_journal_changes_it_silently(tmp_path: Path, with_other: bool) -> None:
    made = made_session(60, tmp_path / "made")
    counts = sampled_bits(made, tmp_path / "s", 300, seed=3, with_other=with_other)
    assert counts["silently changed"] == counts["continued"] == 0


def test_a_kill_at_any_byte_of_a_step_loses_nothing_that_was_confirmed(tmp_path: Path) -> None:
    made = made_session(12, tmp_path / "made")
    counts = every_kill(made, tmp_path / "s")
    assert counts == {"continued": counts.total()}
    assert counts.total() > 2000


def test_a_journal_cut_anywhere_is_told_and_continued_from_its_copy(short: Made, tmp_path: Path) -> None:
    counts = every_length(short, tmp_path / "s", name=JOURNAL)
    assert counts == {"continued and told": counts.total()}


def test_a_copy_cut_anywhere_changes_nothing(short: Made, tmp_path: Path) -> None:
    counts = every_length(short, tmp_path / "s", name=COPY)
    assert counts["silently changed"] == counts["refused"] == 0


def lines_of(folder: Path) -> list[bytes]:
    return (folder / JOURNAL).read_bytes().split(b"\n")[:-1]


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
def test_lines_that_were_moved_are_noticed(
    tmp_path: Path, change: Callable[[list[bytes]], list[bytes]], with_copy: bool
) -> None:
    folder = tmp_path / "s"
    closed_session(folder, 1, 2, 3, 4, 5)
    (folder / JOURNAL).write_bytes(b"".join(line + b"\n" for line in change(lines_of(folder))))
    if not with_copy:
        (folder / COPY).unlink()
    if not with_copy and len(lines_of(folder)) == 5:
        with pytest.raises(SessionFileError, match="the session is damaged: line"):
            open_session_file(folder, FACTS)
        return
    session_file = open_session_file(folder, FACTS)
    assert session_file.restored.warnings[0].code == "session-damaged"
    session_file.close()
    assert clicks_in(folder) == [1.0, 2.0, 3.0, 4.0, 5.0]


@POSIX
@pytest.mark.parametrize("name", ["lock", JOURNAL, COPY])
@pytest.mark.parametrize("existing", [True, False], ids=["in a session", "in an empty folder"])
def test_a_link_in_the_folder_is_refused_and_its_target_untouched(tmp_path: Path, name: str, existing: bool) -> None:
    folder, target = tmp_path / "s", tmp_path / "target"
    if existing:
        closed_session(folder, 1)
        (folder / name).unlink()
    else:
        folder.mkdir()
    target.write_bytes(b"precious\n")
    (folder / name).symlink_to(target)
    with pytest.raises(SessionFileError, match=rf"{name}: is a symbolic link.*Move it out of the folder"):
        open_session_file(folder, FACTS)
    assert target.read_bytes() == b"precious\n"
    with pytest.raises(SessionFileError):
        repair_session(folder)
    assert target.read_bytes() == b"precious\n"


@POSIX
@pytest.mark.parametrize("name", ["lock", JOURNAL, COPY])
@pytest.mark.parametrize("kind", ["pipe", "folder", "hard link", "dangling link"])
def test_what_is_no_plain_file_is_refused_without_waiting(tmp_path: Path, name: str, kind: str) -> None:
    folder, other = tmp_path / "s", tmp_path / "other"
    closed_session(folder, 1)
    (folder / name).unlink()
    match kind:
        case "pipe":
            os.mkfifo(folder / name)
        case "folder":
            (folder / name).mkdir()
        case "hard link":
            other.write_bytes(b"precious\n")
            (folder / name).hardlink_to(other)
        case _:
            (folder / name).symlink_to(other)
    with pytest.raises(SessionFileError, match=rf"{name}: (is a|has 2 names)"):
        open_session_file(folder, FACTS)
    assert (other.read_bytes() == b"precious\n") if kind == "hard link" else not other.exists()


@POSIX
def test_a_session_folder_that_is_a_link_is_refused(tmp_path: Path) -> None:
    closed_session(tmp_path / "real", 1)
    before = {path.name: path.read_bytes() for path in (tmp_path / "real").iterdir()}
    (tmp_path / "s").symlink_to(tmp_path / "real")
    for attempt in (lambda: open_session_file(tmp_path / "s", FACTS), lambda: set_aside(tmp_path / "s")):
        with pytest.raises(SessionFileError, match="is a symbolic link, which is not followed"):
            attempt()
    assert {path.name: path.read_bytes() for path in (tmp_path / "real").iterdir()} == before


@POSIX
def test_a_dangling_link_as_session_folder_makes_no_folder(tmp_path: Path) -> None:
    (tmp_path / "s").symlink_to(tmp_path / "nowhere")
    with pytest.raises(SessionFileError, match="is a symbolic link"):
        open_session_file(tmp_path / "s", FACTS)
    assert not (tmp_path / "nowhere").exists()


@POSIX
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a file to another user")
@pytest.mark.parametrize("name", ["", "lock", JOURNAL, COPY])
def test_what_belongs_to_another_user_is_refused(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "s"
    closed_session(folder, 1)
    os.chown(folder / name, 12345, -1)
    with pytest.raises(SessionFileError, match=r"belongs to user 12345, not to you \(user 0\)"):
        open_session_file(folder, FACTS)


@POSIX
def test_a_link_put_in_place_of_the_copy_while_the_session_is_open_is_not_followed(tmp_path: Path) -> None:
    folder, target = tmp_path / "s", tmp_path / "target"
    session_file = open_session_file(folder, FACTS)
    clicked(session_file, *range(10))
    target.write_bytes(b"precious\n")
    (folder / COPY).unlink()
    (folder / COPY).symlink_to(target)
    session_file.append(
        step := ClickPlaced(TIMES[20], (1.0, 1.0), "clicked"), advance(session_file.restored.history, step, FACTS)
    )
    assert session_file.close().note.startswith("all clicks are saved in ")
    assert target.read_bytes() == b"precious\n"


@pytest.mark.parametrize("change", ["cut", "longer", "replaced"])
def test_a_step_is_refused_when_another_program_changed_the_journal(tmp_path: Path, change: str) -> None:
    folder = tmp_path / "s"
    session_file = open_session_file(folder, FACTS)
    history = clicked(session_file, 1, 2, 3)
    journal = folder / JOURNAL
    if change == "replaced":
        shutil.copy(journal, folder / "copy")
        (folder / "copy").replace(journal)
    else:
        with journal.open("r+b") as file:
            file.truncate(journal.stat().st_size + (1 if change == "longer" else -5))
    before = journal.read_bytes()
    step = ClickPlaced(TIMES[4], (4.0, 1.0), "clicked")
    words = "deleted, moved or replaced" if change == "replaced" else "another program changed its length"
    with pytest.raises(SessionFileError, match=rf"was not made: .*{words}"):
        session_file.append(step, advance(history, step, FACTS))
    assert journal.read_bytes() == before
    left = session_file.close()
    assert "All clicks (3) are saved in" in left.note
    assert left.kept_in == folder / COPY
    assert clicks_in(folder) == [1.0, 2.0, 3.0]


def test_a_journal_changed_in_place_is_noticed_at_the_end(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    session_file = open_session_file(folder, FACTS)
    clicked(session_file, 1, 2, 3)
    with (folder / JOURNAL).open("r+b") as file:
        file.seek(-40, os.SEEK_END)
        file.write(b"X")
    left = session_file.close()
    assert "its content is no longer what was written" in left.note
    assert "saved in" in left.note
    assert clicks_in(folder) == [1.0, 2.0, 3.0]


@POSIX
@pytest.mark.parametrize("how", ["deleted", "moved", "replaced"])
def test_a_folder_that_went_away_is_written_to_the_users_folder_and_found_again(
    tmp_path: Path, own_state_folder: Path, how: str
) -> None:
    folder = tmp_path / "s"
    session_file = open_session_file(folder, FACTS)
    history = clicked(session_file, 1, 2, 3)
    if how == "deleted":
        shutil.rmtree(folder)
    else:
        folder.rename(tmp_path / "moved")
    if how == "replaced":
        folder.mkdir()
    step = ClickPlaced(TIMES[4], (4.0, 1.0), "clicked")
    with pytest.raises(SessionFileError, match="was not made"):
        session_file.append(step, advance(history, step, FACTS))
    left = session_file.close()
    assert left is session_file.close()
    assert left.kept_in == own_state_folder / "drive-rescued-1.cocalib-session"
    assert "was deleted, moved or replaced while it was open" in left.note
    assert clicks_in(left.kept_in) == [1.0, 2.0, 3.0]
    assert how == "replaced" or not folder.exists()


@POSIX
def test_without_any_place_to_write_the_end_says_that_the_clicks_are_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session_file = open_session_file(tmp_path / "s", FACTS)
    clicked(session_file, 1, 2)
    shutil.rmtree(tmp_path / "s")

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    left = session_file.close()
    assert left.kept_in is None
    assert left.note.startswith("the clicks (2) could not be saved: ")
    assert "No space left on device" in left.note


def test_a_full_disk_at_the_end_costs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session_file = open_session_file(tmp_path / "s", FACTS)
    clicked(session_file, 1, 2)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        assert session_file.close().note.startswith("all clicks are saved in ")
    assert [path.name for path in (tmp_path / "s").iterdir() if path.name.startswith(".")] == []
    assert clicks_in(tmp_path / "s") == [1.0, 2.0]


DEEP = b"[" * 100_000 + b"]" * 100_000


@pytest.mark.parametrize(
    "value", [DEEP, b'"\\ud800"', b"1e308", b"-1", b"NaN", b"9" * 400, b"null", b"{}"], ids=lambda value: value[:9]
)
@pytest.mark.parametrize("key", [b'"options":', b'"name":', b'"steps":', b'"pixel_px":', b'"recording":', b'"sec":'])
def test_odd_content_with_right_checksums_is_refused_or_read_but_never_crashes(
    tmp_path: Path, key: bytes, value: bytes
) -> None:
    folder = tmp_path / "s"
    session_file = open_session_file(folder, FACTS)
    history = clicked(session_file, 1)
    step = OptionsChanged.of(CalibrationOptions(method="paper"))
    session_file.append(step, advance(history, step, FACTS))
    session_file.close()
    with_value = re.compile(re.escape(key) + rb"[^,\]}]*")
    lines, previous = [], ""
    for line in lines_of(folder):
        lines.append(sealed(with_value.sub(lambda _: key + value, taken_apart(line).content), previous))
        previous = lines[-1].sum
    for name in (JOURNAL, COPY):
        (folder / name).write_bytes(bytes_of(lines))
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        try:
            inspect_session(folder)
            open_session_file(folder, FACTS).close()
        except SessionFileError:
            assert {
                path.name: path.read_bytes() for path in folder.iterdir() if path.name != "lock"
            }.items() <= before.items()


class Killed(BaseException):
    """The process ends here."""


@pytest.mark.parametrize("survived", range(4))
@pytest.mark.parametrize("kind", ["cut", "session-1"])
def test_a_kill_between_the_writes_of_a_repair_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, project_root: Path, kind: str, survived: int
) -> None:
    folder = tmp_path / "s"
    if kind == "cut":
        closed_session(folder, 1, 2, 3)
        (folder / JOURNAL).write_bytes(lines_of(folder)[0] + b"\n")
        expected = [1.0, 2.0, 3.0]
    else:
        shutil.copytree(project_root / "tests" / "golden" / "session-1", folder)
        expected = [0.30000000000000004, 5.0]
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
    assert clicks_in(folder) == expected


@POSIX
def test_session_files_are_as_open_to_others_as_the_user_wants(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        closed_session(tmp_path / "s", *range(10))
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in (tmp_path / "s").iterdir()}
    assert modes == {"lock": 0o600, JOURNAL: 0o600, COPY: 0o600}


def test_a_long_made_session_opens_as_it_was(tmp_path: Path) -> None:
    made = made_session(40, tmp_path / "s")
    session_file = open_session_file(tmp_path / "s", MADE_FACTS)
    assert session_file.restored.history == made.histories[-1]
    session_file.close()


@pytest.mark.parametrize(
    ("content", "why"),
    [(b"", "the file is empty"), (b"\0" * 5000, "it holds only zeros"), (b"[" * 5000, "it has no end")],
)
def test_a_journal_without_a_line_is_described_as_it_is(tmp_path: Path, content: bytes, why: str) -> None:
    (tmp_path / JOURNAL).write_bytes(content)
    with pytest.raises(SessionFileError, match=re.escape(f"line 1 is damaged ({why})")):
        open_session_file(tmp_path, FACTS)
    assert (tmp_path / JOURNAL).read_bytes() == content


@POSIX
def test_a_journal_that_can_no_longer_be_written_is_not_called_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session_file = open_session_file(tmp_path, FACTS)
    clicked(session_file, 1, 2)

    def refused(*_: object) -> int:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", refused)
        patch.setattr(os, "ftruncate", refused)
        with pytest.raises(SessionFileError, match="make the file writable again"):
            clicked(session_file, 3)
    closed = session_file.close()
    assert closed.clicks == 2
    assert closed.fault.endswith("it could no longer be written")
