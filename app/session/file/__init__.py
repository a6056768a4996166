"""The session on disk: a journal of every step, written before the step is announced, and a snapshot to restart from.

A session is a folder, `NAME.cocalib-session/`, with `journal.jsonl` (one line per step, only ever appended to), `session.json`
(the clicks and options, replaced as a whole from time to time) and `lock` (held while a process has the session open).
"""

from app.session.file.errors import SessionFileError
from app.session.file.folders import recording_session_folder, user_session_folder
from app.session.file.remembered import remembered_map
from app.session.file.session_file import Restored, SessionFile, open_session_file, set_aside

__all__ = [
    "Restored",
    "SessionFile",
    "SessionFileError",
    "open_session_file",
    "recording_session_folder",
    "remembered_map",
    "set_aside",
    "user_session_folder",
]
