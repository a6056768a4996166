"""The end of a session: whether all of it is on the disk, and a copy elsewhere if it is not."""

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calib_core.measurements import ReflectorClick
from cocalib.platform.resources import user_session_folder, version
from cocalib.session import BoxesLoaded, ClicksImported, OptionsChanged, Session
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import RecordingForm
from cocalib.session.file.journal import begin_journal
from cocalib.session.file.snapshot import SNAPSHOT, read_snapshot, write_snapshot


@dataclass(frozen=True, slots=True)
class Closed:
    """What is on the disk after a session was closed.

    Attributes:
        folder: of the session.
        clicks: how many it has.
        fault: what was wrong with the folder; "" if everything is there and was verified.
        kept_in: where the clicks are instead; None if they could not be written anywhere.
    """

    folder: Path
    clicks: int
    fault: str = ""
    kept_in: Path | None = None

    @property
    def note(self) -> str:
        """What to tell the user, without a full stop at the end."""
        if not self.fault:
            return f"all clicks are saved in {self.folder}"
        if not self.clicks and self.kept_in is None:
            return f"there were no clicks to save, but {self.fault}"
        if self.kept_in is None:
            return f"the clicks ({self.clicks}) could not be saved: {self.fault}"
        again = "they are used when it is opened again"
        if self.kept_in.parent != self.folder:
            again = f"to continue with them, open the recording with --session {self.kept_in}"
        return f"{self.fault}. All clicks ({self.clicks}) are saved in {self.kept_in}; {again}"


def snapshot_fault(folder: GuardedFolder, clicks: Sequence[ReflectorClick]) -> str:
    """Return why the snapshot on the disk does not hold these clicks; "" if it does."""
    try:
        data = folder.read(SNAPSHOT)
        if data is None:
            return "it is missing"
        return "" if read_snapshot(data, SNAPSHOT).clicks == tuple(clicks) else "another program has changed it"
    except OSError as error:
        return error.strerror or str(error)
    except SessionFileError as error:
        return str(error)


def rescued(folder: Path, session: Session, recording: RecordingForm, fault: str) -> Closed:
    """Write a session to the user's folder, or to the system's folder for temporary files.

    Args:
        folder: where it was.
        session: its present state.
        recording: the recording it belongs to.
        fault: why it cannot be kept in its folder.
    """
    count = len(session.clicks)
    if not count and not session.boxes:
        return Closed(folder, 0, fault)
    for home in (user_session_folder(f"{recording.name}-rescued").parent, Path(tempfile.gettempdir())):
        try:
            return Closed(folder, count, fault, _written(home, session, recording))
        except OSError as error:
            fault = f"{fault}; {home}: {error.strerror or error}"
        except SessionFileError as error:
            fault = f"{fault}; {error}"
    return Closed(folder, count, fault)


def _written(home: Path, session: Session, recording: RecordingForm) -> Path:
    number = 1
    plain = "".join(letter if letter.isalnum() or letter in "._-" else "_" for letter in recording.name)[:100]
    while os.path.lexists(path := home / f"{plain}-rescued-{number}.cocalib-session"):
        number += 1
    folder = GuardedFolder(path, create=True)
    try:
        loaded = BoxesLoaded(session.boxes, session.empty_frames)
        steps = (OptionsChanged.of(session.options), ClicksImported.of(session.clicks), loaded)
        sums = begin_journal(folder, recording, steps, cocalib=version())
        write_snapshot(folder, session, recording=recording, sums=sums, cocalib=version())
        if fault := snapshot_fault(folder, session.clicks):
            raise SessionFileError(f"{path}: {fault}")
    finally:
        folder.close()
    return path
