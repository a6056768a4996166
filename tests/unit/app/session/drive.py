"""The harness of the tests of sessions: a recording of 50 frames, sessions of it on disk, and what an opening makes of them."""

from pathlib import Path

import numpy as np
import pytest

from calib_core.measurements import TimeNs
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickPlaced, Step
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.journal import JOURNAL
from cocalib.session.file.session_file import Restored, SessionFile, open_session_file
from cocalib.session.state import RecordingFacts

START_NS = 1_700_000_000_123_456_789
FACTS = RecordingFacts("drive", START_NS + 100_000_000 * np.arange(50), width_px=640, height_px=480)
TIMES = [TimeNs(int(time)) for time in FACTS.image_times]


def place(frame: int, facts: RecordingFacts = FACTS) -> ClickPlaced:
    """Return the step that clicks a pixel whose column is the frame's number."""
    return ClickPlaced(TimeNs(int(facts.image_times[frame])), (float(frame), 1.0), "clicked")


def keep(session_file: SessionFile, *steps: Step, facts: RecordingFacts = FACTS) -> History:
    """Apply steps in an open session."""
    history = session_file.restored.history
    for step in steps:
        history = advance(history, step, facts)
        session_file.append(step, history)
    return history


def kept(folder: Path, *steps: Step, facts: RecordingFacts = FACTS) -> History:
    """Apply steps in a session, new or continued, and close it."""
    session_file = open_session_file(folder, facts)
    history = keep(session_file, *steps, facts=facts)
    assert session_file.close().note.startswith("all clicks are saved")
    return history


def restored(folder: Path, facts: RecordingFacts = FACTS) -> Restored:
    """Open a session, and close it."""
    session_file = open_session_file(folder, facts)
    session_file.close()
    return session_file.restored


def clicks_in(folder: Path, facts: RecordingFacts = FACTS) -> list[float]:
    """Return the columns of the clicks of a session."""
    return [click.u_px for click in restored(folder, facts).history.present.clicks]


def refused(folder: Path, words: str | None = None, facts: RecordingFacts = FACTS) -> str:
    """Expect that a session is refused, and left as it is; return the reason."""
    before = files(folder)
    with pytest.raises(SessionFileError, match=words) as error:
        open_session_file(folder, facts)
    assert files(folder) == before
    return str(error.value)


def files(folder: Path) -> dict[str, bytes]:
    """Return the files of a session without its lock."""
    plain = (path for path in folder.glob("*") if path.is_file() and not path.is_symlink())
    return {path.name: path.read_bytes() for path in plain if path.name != "lock"}


def lines_of(folder: Path, name: str = JOURNAL) -> list[bytes]:
    """Return the lines of a journal or of its copy."""
    return (folder / name).read_bytes().split(b"\n")[:-1]


def damage(folder: Path, line: int, text: bytes, name: str = JOURNAL) -> None:
    """Replace a line of a journal or of its copy."""
    lines = lines_of(folder, name)
    lines[line] = text
    (folder / name).write_bytes(b"".join(each + b"\n" for each in lines))
