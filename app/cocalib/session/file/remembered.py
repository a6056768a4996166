"""What a session remembers about reading its recording, needed before the recording is open."""

from contextlib import closing
from pathlib import Path

import msgspec

from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder

_JOURNAL = "journal.jsonl"


class _Step(msgspec.Struct, frozen=True):
    type: str = ""
    column_map: tuple[str, ...] = ()


class _Line(msgspec.Struct, frozen=True):
    step: _Step | None = None


def remembered_map(folder: Path) -> tuple[str, ...]:
    """Return the values of --map that a session was last opened with; none if it has none or cannot be read.

    Args:
        folder: of the session. Opening the session afterwards reports whatever is wrong with it.
    """
    try:
        with closing(GuardedFolder(folder)) as guarded:
            lines = (guarded.read(_JOURNAL) or b"").split(b"\n")
    except (SessionFileError, OSError):  # opening the session says what is wrong with it
        return ()
    found: tuple[str, ...] = ()
    for line in lines:
        try:
            step = msgspec.json.decode(line, type=_Line).step
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            continue
        if step is not None and step.type == "columns_mapped":
            found = step.column_map
    return found
