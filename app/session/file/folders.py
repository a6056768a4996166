"""Where a session lies: beside its recording when that folder can be written, else in the user's own state folder."""

import hashlib
import tempfile
from collections.abc import Sequence
from pathlib import Path

from app.resources import state_folder

__all__ = ["recording_session_folder", "user_session_folder"]

_SUFFIX = ".cocalib-session"


def recording_session_folder(paths: Sequence[Path]) -> Path:
    """Return the session folder of a recording: where one is already, else beside it, else in the state folder.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
    """
    first = paths[0].resolve()
    beside = first.with_name(first.name + _SUFFIX)
    at_home = user_session_folder(first.name, key=str(first))
    for folder in (beside, at_home):
        if folder.is_dir() and _is_writable(folder):
            return folder
    return beside if _is_writable(beside.parent) else at_home


def user_session_folder(name: str, *, key: str = "") -> Path:
    """Return a session folder in the user's state folder.

    Args:
        name: what the session is of.
        key: tells sessions of the same name apart, such as the recording's path.
    """
    distinct = f"-{hashlib.sha256(key.encode()).hexdigest()[:8]}" if key else ""
    return state_folder() / "sessions" / f"{name}{distinct}{_SUFFIX}"


def _is_writable(folder: Path) -> bool:
    """Try it: permission bits do not tell about read-only media, quotas and network folders."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
