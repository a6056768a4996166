"""Where a session is stored: next to its recording if that folder is writable, else in the user's state folder."""

import os
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cocalib.platform.resources import SESSION_SUFFIX, user_session_folder

_SET_ASIDE = re.compile(re.escape(SESSION_SUFFIX) + r"\.[0-9]+$")


def recording_session_folder(paths: Sequence[Path]) -> Path:
    """Return the session folder of a recording: an existing one, else next to the recording, else in the state folder.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
    """
    first = paths[0].resolve()
    adjacent = first.with_name(first.name + SESSION_SUFFIX)
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
        free = folder.with_name(f"{folder.name.removesuffix(SESSION_SUFFIX)}-{number}{SESSION_SUFFIX}")
    return free


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
        folder / name
        for name in names
        if name.endswith(SESSION_SUFFIX) or (set_aside and _SET_ASIDE.search(name) is not None)
    )


def is_writable(folder: Path) -> bool:
    """Try to write: permission bits do not cover read-only media, quotas and network folders."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
