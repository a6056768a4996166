"""An unforeseen exception becomes one line and a report in a file."""

import asyncio
import sys
import threading
from pathlib import Path

import pytest

from cocalib.cli import run
from cocalib.platform import error_boundary as module
from cocalib.platform.error_boundary import INTERNAL_ERROR, error_boundary, report_of, report_thread_errors


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(module, "_reported", {})
    monkeypatch.setattr(sys, "platform", "linux")
    return tmp_path / "cocalib" / "reports"


def reports(state: Path) -> list[Path]:
    return sorted(state.glob("*"))


def test_the_block_ends_with_a_line_and_a_private_report(state):
    told: list[str] = []
    with error_boundary("a test", told.append):
        raise ZeroDivisionError("of\nnothing\x1b[2J")
    (line,), (report,) = told, reports(state)
    assert "(ZeroDivisionError: of nothing\\u001b[2J)" in line
    assert str(report) in line
    assert "\n" not in line
    assert report.stat().st_mode & 0o077 == 0
    assert report.parent.stat().st_mode & 0o077 == 0
    text = report.read_text()
    for part in ("a test", "ZeroDivisionError", "test_error_boundary.py", "Python", "cocalib"):
        assert part in text
    assert "\x1b" not in text


def test_secrets_are_left_out(state, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["cocalib", "open", "a.bag", "--token", "SECRET1", "--token=SECRET2"])
    report_of(ValueError("GET /?token=SECRET3&a=1 Cookie: cocalib-1=SECRET4"), "a test")
    (report,) = reports(state)
    assert "SECRET" not in report.read_text()
    assert "a.bag" in report.read_text()


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(3), asyncio.CancelledError()])
def test_an_end_that_is_wanted_passes(error, state):
    with pytest.raises(type(error)), error_boundary("a test", lambda line: None):
        raise error
    assert not reports(state)


def test_the_same_error_is_saved_once_and_old_reports_go(state, monkeypatch):
    lines = set()
    for _ in range(3):
        with error_boundary("a loop", lines.add):
            raise LookupError("again")
    assert len(lines) == len(reports(state)) == 1
    for number in range(40):
        monkeypatch.setattr(module, "_reported", {})
        report_of(LookupError(f"{number}"), "a test")
    assert len(reports(state)) == 20


def test_a_report_that_cannot_be_saved_is_said(tmp_path):
    (tmp_path / "cocalib").write_text("a file where the folder should be")
    assert "could not be saved" in report_of(LookupError("x"), "a test")


def test_debugging_shows_the_traceback(monkeypatch, capsys):
    report_of(LookupError("quiet"), "a test")
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("COCALIB_DEBUG", "1")
    report_of(LookupError("loud"), "a test")
    assert "LookupError: loud" in capsys.readouterr().err


def test_a_command_with_a_bug_exits_with_its_own_code(state, monkeypatch, capsys):
    def broken(*_: object, **__: object) -> None:
        raise RecursionError("too deep")

    monkeypatch.setattr("calib_core.recordings.open_recording", broken)
    assert run(["info", "a.bag"]) == INTERNAL_ERROR
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert "internal error (RecursionError: too" in line
    assert str(reports(state)[0]) in line


def test_a_thread_with_a_bug_prints_one_line(state, monkeypatch, capsys):
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    report_thread_errors()

    def broken() -> None:
        raise LookupError("in a thread")

    thread = threading.Thread(target=broken, name="solver")
    thread.start()
    thread.join()
    (line,) = capsys.readouterr().err.splitlines()
    assert "LookupError: in a thread" in line
    assert "solver" in reports(state)[0].read_text()


def test_no_other_module_catches_every_exception(project_root):
    found = [
        str(path.relative_to(project_root))
        for folder in ("app", "calib_core")
        for path in sorted((project_root / folder).rglob("*.py"))
        if any(words in path.read_text() for words in ("except Exception", "except:"))
    ]
    assert found == ["app/cocalib/platform/error_boundary.py"]
