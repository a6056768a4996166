"""Find the browser for the tests, or install one: `python tests/find_browser.py [--install]` prints its path.

Order: $COCALIB_BROWSER, a working Chrome or Chromium on the system, Playwright's own build; with --install, Debian's
chromium package if run as root, else Playwright's build. The tests are not skipped: without a browser they fail.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

_NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome", "chrome", "msedge")
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
_ADVICE = "no working browser found; run: python tests/find_browser.py --install"


class BrowserMissingError(RuntimeError):
    """There is no working browser on this machine."""


def find_browser() -> Path:
    """Return a browser that answers --version; Ubuntu's package can be a stub that does not.

    Raises:
        BrowserMissingError: there is none; the message has the command to run.
    """
    chosen = os.environ.get("COCALIB_BROWSER")
    if chosen:
        if not _runs(chosen):
            raise BrowserMissingError(f"COCALIB_BROWSER={chosen} does not run; correct it or unset it")
        return Path(chosen)
    for candidate in _candidates():
        if candidate and _runs(candidate):
            return Path(candidate)
    raise BrowserMissingError(_ADVICE)


def _candidates() -> Iterator[str]:
    """Yield paths to try; Playwright is only started when nothing else runs."""
    yield from (path for name in _NAMES if (path := shutil.which(name)))
    yield from _PLACES
    yield _playwright_build()


def _runs(path: str) -> bool:
    if sys.platform == "win32":  # there, --version prints nothing and opens a window
        return Path(path).is_file()
    try:
        answer = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return answer.returncode == 0 and any(character.isdigit() for character in answer.stdout)


def _playwright_build() -> str:
    """Return the path of Playwright's Chromium; "" if its driver does not start."""
    code = "from playwright.sync_api import sync_playwright as s\nwith s() as p: print(p.chromium.executable_path)"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    return answer.stdout.strip() if answer.returncode == 0 else ""


def _install() -> None:
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    if root and shutil.which("apt-get") and not _is_ubuntu():
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        for command in (["update", "-qq"], ["install", "-y", "-qq", "chromium", "libatomic1"]):
            subprocess.run(["apt-get", *command], env=environment, check=False, stdout=sys.stderr)
        if _installed():
            return
    dependencies = ["--with-deps"] if root else []
    subprocess.run(
        [sys.executable, "-m", "playwright", "install", *dependencies, "chromium"], check=False, stdout=sys.stderr
    )


def _installed() -> bool:
    return any(_runs(path) for name in _NAMES if (path := shutil.which(name)))


def _is_ubuntu() -> bool:
    """Return whether this is Ubuntu, where the chromium package is only a stub for a snap."""
    release = Path("/etc/os-release")
    return release.is_file() and "ubuntu" in release.read_text(encoding="utf-8").lower()


def main() -> int:
    """Print the browser's path; with --install, install one if there is none."""
    try:
        print(find_browser())
    except BrowserMissingError as error:
        if "--install" not in sys.argv[1:] or os.environ.get("COCALIB_BROWSER"):
            print(error, file=sys.stderr)
            return 1
        _install()
        try:
            print(find_browser())
        except BrowserMissingError:
            print(
                "cannot install a browser; install Chrome or Chromium and set COCALIB_BROWSER to its path",
                file=sys.stderr,
            )
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
