"""A recording of 50 frames, and sessions of it on disk, for the tests of sessions."""

from pathlib import Path

import numpy as np

from calib_core.measurements import TimeNs
from cocalib.session import History, RecordingFacts, advance
from cocalib.session.file import SessionFile, open_session_file

START_NS = 1_700_000_000_123_456_789
FACTS = RecordingFacts("drive", START_NS + 100_000_000 * np.arange(50), width_px=640, height_px=480)
TIMES = [TimeNs(int(time)) for time in FACTS.image_times]


def keep(session_file: SessionFile, *steps) -> History:
    history = session_file.restored.history
    for step in steps:
        history = advance(history, step, FACTS)
        session_file.append(step, history)
    return history


def kept(folder: Path, *steps) -> History:
    """Apply steps in a new session and close it."""
    session_file = open_session_file(folder, FACTS)
    history = keep(session_file, *steps)
    session_file.close()
    return history


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "lock"}
