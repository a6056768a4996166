"""Open the link in the browser without showing it to other users: a command line is visible to them, a private file is not."""

import html
import os
import secrets
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

from cocalib.platform.resources import state_folder

_SNAPS = ("firefox", "chromium", "brave", "opera")


class HandOver:
    """A file that leads a browser to the link; it is deleted once the link was used, or when the server stops."""

    def __init__(self, url: str, opener: Callable[[str], object] | None = None) -> None:
        """Write the file and open it; if it cannot be written, nothing is opened: the printed link remains.

        Args:
            url: the link.
            opener: opens an address in the browser; None for the user's own.
        """
        self.path = _written(url)
        if self.path is not None:
            threading.Thread(target=opener or webbrowser.open, args=(self.path.as_uri(),), daemon=True).start()

    def discard(self) -> None:
        """Delete the file. Safe to call twice."""
        if self.path is None:
            return
        try:
            self.path.unlink(missing_ok=True)
            self.path.parent.rmdir()
        except OSError:
            return  # another server's file is in the folder


def _written(url: str) -> Path | None:
    link = html.escape(url, quote=True)
    page = (
        '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer"><title>cocalib</title>'
        f'<meta http-equiv="refresh" content="0; url={link}"><p><a href="{link}">Open the page</a>\n'
    )
    try:
        folder = _folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
        if os.name != "nt" and (status.st_uid != os.getuid() or status.st_mode & 0o077):
            folder = Path(tempfile.mkdtemp(prefix="cocalib-"))
        path = folder / f"open-{secrets.token_hex(8)}.html"
        with os.fdopen(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="utf-8") as file:
            file.write(page)
    except OSError:
        return None
    return path


def _folder() -> Path:
    """Return a folder of this user that the browser can read: one from a snap reads no hidden folders."""
    if sys.platform == "linux" and any(Path("/snap/bin", name).exists() for name in _SNAPS):
        return Path.home() / "cocalib-link"
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or "")
    return runtime / "cocalib" if runtime.is_absolute() and runtime.is_dir() else state_folder() / "link"
