"""What `cocalib session list` shows of each session."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cocalib.platform.resources import state_folder
from cocalib.session.file.contents import inspect_session
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.finding import holds_session_files
from cocalib.session.file.folders import recording_session_folder, session_folders_in
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.journal import COPY, JOURNAL
from cocalib.session.file.lock import lock_holder
from cocalib.session.file.snapshot import SNAPSHOT


@dataclass(frozen=True, slots=True)
class SessionSummary:
    """One session.

    Attributes:
        folder: its path.
        recording: name of its recording; "" if unknown.
        clicks: how many it has, or how many are proven.
        steps: how many steps its journal holds.
        changed_at_s: when it was last changed, in seconds since the epoch; None if unknown.
        state: "sound", "damaged", "open" (in another process), or "unreadable".
        about: what is wrong, or which process has it open.
    """

    folder: Path
    recording: str
    clicks: int
    steps: int
    changed_at_s: float | None
    state: str
    about: str


def session_summaries(places: Sequence[Path]) -> tuple[SessionSummary, ...]:
    """Return the sessions in some places and in the user's folder.

    Args:
        places: session folders, recordings, or folders that hold either; folders in them are not searched.
    """
    folders = [folder for place in (*places, state_folder() / "sessions") for folder in _folders(place)]
    return tuple(_summary(folder) for folder in dict.fromkeys(folder.absolute() for folder in folders))


def _folders(place: Path) -> tuple[Path, ...]:
    if holds_session_files(place):
        return (place,)
    inside = session_folders_in(place, set_aside=True)
    named = recording_session_folder([place]) if place.exists() else place
    return (*inside, named) if named.is_dir() and named not in inside else inside


def _summary(path: Path) -> SessionSummary:
    changed, holder = None, ""
    try:
        folder = GuardedFolder(path)
        try:
            changed = max(filter(None, map(folder.changed_at_s, (JOURNAL, COPY, SNAPSHOT))), default=None)
            holder = lock_holder(folder)
        finally:
            folder.close()
        found = inspect_session(path)
    except (SessionFileError, OSError) as error:
        return SessionSummary(path, "", 0, 0, changed, "unreadable", str(error))
    state = "open" if holder else "damaged" if found.faults else "sound"
    about = "; ".join(filter(None, (holder, *found.faults)))
    return SessionSummary(path, found.recording, len(found.clicks), found.steps, changed, state, about)
