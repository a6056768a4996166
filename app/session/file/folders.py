"""Where a session is stored: next to its recording if that folder is writable, else in the user's state folder."""

import hashlib
import os
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

from app.resources import state_folder

__all__ = [
    "is_writable",
    "recording_session_folder",
    "session_folders_in",
    "unused_session_folder",
    "user_session_folder",
]

_SUFFIX = ".cocalib-session"
_SET_ASIDE = re.compile(re.escape(_SUFFIX) + r"\.[0-9]+$")


def recording_session_folder(paths: Sequence[Path]) -> Path:
    """Return the session folder of a recording: an existing one, else next to the recording, else in the state folder.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
    """
    first = paths[0].resolve()
    adjacent = first.with_name(first.name + _SUFFIX)
    in_state_folder = user_session_folder(first.name, key=str(first))
    for folder in (adjacent, in_state_folder):
        if folder.is_dir() and is_writable(folder):
            return folder
    return adjacent if is_writable(adjacent.parent) else in_state_folder


def unused_session_folder(folder: Path) -> Path:
    """Return a name that no session has yet: the given one, or that with a number, such as NAME-2.cocalib-session."""
    number, free = 1, folder
    while os.path.lexists(free):
        number += 1
        free = folder.with_name(f"{folder.name.removesuffix(_SUFFIX)}-{number}{_SUFFIX}")
    return free


def user_session_folder(name: str, *, key: str = "") -> Path:
    """Return a session folder in the user's state folder.

    Args:
        name: what the session is of.
        key: distinguishes sessions of the same name, such as the recording's path.
    """
    distinct = f"-{hashlib.sha256(os.fsencode(key)).hexdigest()[:8]}" if key else ""
    return state_folder() / "sessions" / f"{name}{distinct}{_SUFFIX}"


def session_folders_in(folder: Path, *, set_aside: bool = False) -> tuple[Path, ...]:
    """Return the session folders directly in a folder, by name; none if it cannot be read.

    Args:
        folder: where to look.
        set_aside: also those that --fresh has renamed.
    """
    try:
        names = sorted(path.name for path in folder.iterdir())
    except OSError:
        return ()
    return tuple(
        folder / name for name in names if name.endswith(_SUFFIX) or (set_aside and _SET_ASIDE.search(name) is not None)
    )


def is_writable(folder: Path) -> bool:
    """Try to write: permission bits do not cover read-only media, quotas and network folders."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
