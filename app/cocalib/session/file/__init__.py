"""The session on disk: a journal of every step, written before the step is announced, and a copy to restart from.

A session is a folder, `NAME.cocalib-session/`, with `journal.jsonl` (one line per step, only ever appended to),
`journal-copy.jsonl` (the same lines) and `lock` (held while a process has the session open). All of them are opened without
following links; every line carries a checksum, and both files are compared before anything is overwritten.
"""

from cocalib.platform.resources import user_session_folder
from cocalib.session.file.contents import Repair, inspect_session, repair_session
from cocalib.session.file.finding import (
    FoundFolder,
    SessionSummary,
    find_session_folder,
    has_session_of,
    holds_session_files,
    recording_session_folder,
    remembered_map,
    session_summaries,
    unused_session_folder,
)
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.session_file import Closed, Restored, SessionFile, open_session_file, set_aside

__all__ = [
    "Closed",
    "FoundFolder",
    "Repair",
    "Restored",
    "SessionFile",
    "SessionFileError",
    "SessionSummary",
    "find_session_folder",
    "has_session_of",
    "holds_session_files",
    "inspect_session",
    "open_session_file",
    "recording_session_folder",
    "remembered_map",
    "repair_session",
    "session_summaries",
    "set_aside",
    "unused_session_folder",
    "user_session_folder",
]
