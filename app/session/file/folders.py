"""Where a session is stored: next to its recording if that folder is writable, else in the user's state folder."""

import hashlib
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from app.resources import state_folder

__all__ = ["recording_session_folder", "user_session_folder"]

_SUFFIX = ".cocalib-session"


def recording_session_folder(paths: Sequence[Path]) -> Path:
    """Return the session folder of a recording: an existing one, else next to the recording, else in the state folder.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
    """
    first = paths[0].resolve()
    adjacent = first.with_name(first.name + _SUFFIX)
    in_state_folder = user_session_folder(first.name, key=str(first))
    for folder in (adjacent, in_state_folder):
        if folder.is_dir() and _is_writable(folder):
            return folder
    return adjacent if _is_writable(adjacent.parent) else in_state_folder


def user_session_folder(name: str, *, key: str = "") -> Path:
    """Return a session folder in the user's state folder.

    Args:
        name: what the session is of.
        key: distinguishes sessions of the same name, such as the recording's path.
    """
    distinct = f"-{hashlib.sha256(os.fsencode(key)).hexdigest()[:8]}" if key else ""
    return state_folder() / "sessions" / f"{name}{distinct}{_SUFFIX}"


def _is_writable(folder: Path) -> bool:
    """Try to write: permission bits do not cover read-only media, quotas and network folders."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
