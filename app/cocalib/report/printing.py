"""Print the report with a browser that is there: Chrome, Chromium, Edge or Brave, or the one that Playwright brings."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from calib_core.errors import CalibrationError
from calib_core.file_tag import TAG

_VARIABLE = "COCALIB_BROWSER"
_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome-stable",
    "google-chrome",
    "chrome",
    "microsoft-edge",
    "msedge",
    "brave-browser",
    "brave",
)
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "/Applications/Brave Browser.app/Contents/MacOS/Brave Browser",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
_OF_PLAYWRIGHT = (
    "chromium*/chrome-*/chrome",
    "chromium*/chrome-*/headless_shell",
    "chromium*/chrome-*/chrome.exe",
    "chromium*/chrome-*/*.app/Contents/MacOS/*",
)
_PATIENCE_S = 120.0


class PrintingError(CalibrationError):
    """No PDF could be made."""


def print_pdf(html: str) -> bytes:
    """Return the report as PDF.

    The browser gets a profile of its own that is deleted afterwards, and no network.

    Raises:
        PrintingError: there is no browser, or it fails.
    """
    browser = find_browser()
    with tempfile.TemporaryDirectory(prefix="cocalib-print-", ignore_cleanup_errors=True) as folder:
        page, pdf = Path(folder, "report.html"), Path(folder, "report.pdf")
        page.write_text(html, encoding="utf-8")
        command = [
            str(browser),
            "--headless",
            "--disable-gpu",
            "--disable-extensions",
            "--disable-background-networking",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--no-pdf-header-footer",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={Path(folder, 'profile')}",
            *(["--no-sandbox"] if _is_root() else []),  # Chromium's sandbox refuses root; the page has no script
            f"--print-to-pdf={pdf}",
            page.as_uri(),
        ]
        try:
            answer = subprocess.run(command, capture_output=True, timeout=_PATIENCE_S, check=False)
        except subprocess.TimeoutExpired:
            raise PrintingError(
                f"{browser} did not print the report within {_PATIENCE_S:.0f} s; print the HTML file from your browser"
            ) from None
        except OSError as error:
            raise PrintingError(
                f"{browser} cannot be started: {error.strerror or error}; set {_VARIABLE} to another browser"
            ) from error
        if not pdf.is_file():
            said = answer.stderr.decode("utf-8", "replace").strip().splitlines()
            why = f": {said[-1]}" if said else ""
            raise PrintingError(
                f"{browser} printed no PDF (exit code {answer.returncode}){why}; print the HTML file from your browser"
            )
        return pdf.read_bytes() + f"%{TAG}\n".encode()


def find_browser() -> Path:
    """Return the browser to print with.

    Raises:
        PrintingError: there is none.
    """
    chosen = os.environ.get(_VARIABLE)
    if chosen:
        found = shutil.which(chosen)
        if found is None:
            raise PrintingError(f"{_VARIABLE}={chosen} is not a program; correct it or unset it")
        return Path(found)
    for path in _candidates():
        if path.is_file() and os.access(path, os.X_OK):
            return path
    raise PrintingError(
        f"no browser found to print with; install Chromium or Chrome, set {_VARIABLE} to the path of one, "
        "or print the HTML file from your browser"
    )


def _candidates() -> Iterator[Path]:
    yield from (Path(found) for name in _NAMES if (found := shutil.which(name)))
    yield from map(Path, _PLACES)
    stated = os.environ.get("PLAYWRIGHT_BROWSERS_PATH", "")
    caches = (
        [Path(stated)]
        if stated
        else [Path.home() / ".cache/ms-playwright", Path.home() / "Library/Caches/ms-playwright"]
    )
    yield from (
        found for cache in caches for pattern in _OF_PLAYWRIGHT for found in sorted(cache.glob(pattern), reverse=True)
    )


def _is_root() -> bool:
    return sys.platform != "win32" and os.geteuid() == 0
