"""Which session an opening continues or starts, and which clicks it takes from another one."""

from dataclasses import dataclass
from pathlib import Path

from calib_core.measurements import ReflectorClick
from calib_core.results import DataWarning
from cocalib.opening.choice import Choice
from cocalib.session import RecordingFacts
from cocalib.session.file import (
    FoundFolder,
    SessionFileError,
    find_session_folder,
    has_session_of,
    inspect_session,
    recording_session_folder,
    set_aside,
    unused_session_folder,
)
from cocalib.web.messages import SessionOffer


def session_folder(choice: Choice, facts: RecordingFacts) -> FoundFolder:
    """Return the folder of the session to open; with `fresh`, or for a new one, the existing one is kept under another name.

    Raises:
        SessionFileError: an existing one cannot be renamed.
    """
    if choice.fresh:
        return FoundFolder(_emptied(choice.session or recording_session_folder(choice.paths)))
    if choice.session_plan == "continue":
        return FoundFolder(choice.session) if choice.session else find_session_folder(choice.paths, facts)
    named = choice.session or recording_session_folder(choice.paths)
    if choice.session_plan == "new" and has_session_of(named, facts):
        return FoundFolder(_emptied(named))
    return FoundFolder(unused_session_folder(named))


def _emptied(folder: Path) -> Path:
    """Rename an existing session, so that a new one can start in its folder."""
    if (kept := set_aside(folder)) is not None:
        print(f"The previous session is kept in {kept}")
    return folder


@dataclass(frozen=True, slots=True)
class FittingClicks:
    """Clicks of another session that belong to frames of this recording.

    Attributes:
        clicks: sorted by time.
        about: how many there are, and why others are not.
    """

    clicks: tuple[ReflectorClick, ...]
    about: DataWarning


def fitting_clicks(folder: Path, facts: RecordingFacts) -> FittingClicks:
    """Return the clicks of a session whose stamp is that of a frame, on the picture.

    Raises:
        SessionFileError: the session cannot be read.
    """
    found = inspect_session(folder)
    fitting = tuple(
        click
        for click in found.clicks
        if facts.frame_at(click.image_time) is not None and facts.has_pixel(click.u_px, click.v_px)
    )
    left = len(found.clicks) - len(fitting)
    message = f"{len(fitting)} of the {len(found.clicks)} clicks in {folder} were copied"
    if left:
        message += f"; {left} belong to frames that this recording does not have"
    return FittingClicks(fitting, DataWarning("clicks-copied", message, "the session that they come from is unchanged"))


def session_offer(choice: Choice, facts: RecordingFacts | None, opened_in: Path | None) -> SessionOffer:
    """Describe the session that an opening would continue, or could take clicks from.

    Args:
        choice: what is to be opened.
        facts: of the recording; None if it could not be opened.
        opened_in: the folder of the session that is open; None if none is.
    """
    folder = opened_in or choice.session or recording_session_folder(choice.paths)
    try:
        found = inspect_session(folder)
    except (SessionFileError, OSError):
        return SessionOffer(plan=choice.session_plan)
    continues = opened_in is not None or (facts is not None and has_session_of(folder, facts))
    return SessionOffer(str(folder), len(found.clicks), found.recording, continues, choice.session_plan)
