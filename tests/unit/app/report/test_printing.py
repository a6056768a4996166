"""Finding a browser to print with, and words when there is none or it fails."""

import stat
from pathlib import Path

import pytest

from cocalib.report.printing import PrintingError, find_browser, print_pdf


def _program(path: Path, script: str) -> Path:
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IEXEC)
    return path


@pytest.fixture
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Hide every browser of this machine."""
    monkeypatch.setattr("cocalib.report.printing._PLACES", ())
    monkeypatch.delenv("COCALIB_BROWSER", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(tmp_path / "playwright"))
    return tmp_path


def test_without_a_browser_the_message_says_what_to_do(nowhere, monkeypatch):
    with pytest.raises(
        PrintingError, match="no browser found to print with; install Chromium or Chrome, set COCALIB_B"
    ):
        print_pdf("<p>report</p>")
    monkeypatch.setenv("COCALIB_BROWSER", "/nowhere/browser")
    with pytest.raises(
        PrintingError, match=r"COCALIB_BROWSER=/nowhere/browser is not a program; correct it or unset it"
    ):
        find_browser()


@pytest.mark.parametrize(
    "name",
    ["chromium", "google-chrome", "microsoft-edge", "brave-browser", "playwright/chromium-1200/chrome-linux/chrome"],
)
def test_a_browser_on_the_path_or_of_playwright_is_found(nowhere, name):
    (nowhere / name).parent.mkdir(parents=True, exist_ok=True)
    browser = _program(nowhere / name, "exit 0")
    assert find_browser() == browser


def test_a_browser_that_prints_nothing_is_named_with_its_last_words(nowhere):
    _program(nowhere / "chromium", "echo 'cannot open display' >&2; exit 3")
    with pytest.raises(
        PrintingError, match=r"printed no PDF \(exit code 3\): cannot open display; print the HTML file"
    ):
        print_pdf("<p>report</p>")


def test_the_profile_and_the_page_are_deleted_afterwards(nowhere, monkeypatch):
    temporary = nowhere / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    script = (
        'for one in "$@"; do case "$one" in --print-to-pdf=*) printf "%s" "$*" > "${one#--print-to-pdf=}";; esac; done'
    )
    _program(nowhere / "chromium", script)
    flags = print_pdf("<p>report</p>").decode()
    assert f"--user-data-dir={temporary}" in flags
    assert "--host-resolver-rules=MAP * ~NOTFOUND" in flags
    assert not list(temporary.iterdir())
