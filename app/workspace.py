"""The one mutable cell of the program: the history of the session, and the way every change takes through it."""

import threading
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

from app.session import ClicksImported, History, RecordingFacts, Redo, Session, Solved, Step, Undo, advance, settled
from app.session.file import Restored, open_session_file
from app.solving import SolverWorker
from app.view import Reference, View, view
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import read_clicks, write_clicks
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording

__all__ = ["Journal", "Solver", "Subscriber", "Workspace", "open_workspace", "recording_facts"]

Subscriber: TypeAlias = Callable[[View], None]


class Journal(Protocol):
    """What keeps the steps: app.session.file.SessionFile, or a list in a test."""

    def append(self, step: Step, history: History) -> None:
        """Keep a step for good before returning; `history` is what it leads to."""

    def close(self) -> None:
        """Let go of the file."""


class Solver(Protocol):
    """What answers a revision: app.solving.SolverWorker, or a fake in a test."""

    def request(
        self,
        revision: int,
        clicks: Sequence[ReflectorClick],
        options: CalibrationOptions,
        when_done: Callable[[Solved], None],
    ) -> None:
        """Answer this revision soon, and forget the older ones; must not wait. A larger revision is a newer one."""

    def close(self) -> None:
        """Stop; no answer comes after this returns."""


class Workspace:
    """Holds the session; whoever wants to change it dispatches a step.

    A step is journalled before anybody is told of it. Views reach the subscribers in the order of the changes and outside
    the lock, so a subscriber may dispatch; it must return quickly and must not raise.

    Attributes:
        facts: the recording's frames.
        restored: what was found in the session's folder at the start.
        reference: a calibration to look at until the clicks give one of their own; None without one.
    """

    def __init__(
        self,
        facts: RecordingFacts,
        restored: Restored,
        journal: Journal,
        solver: Solver,
        reference: Reference | None = None,
    ) -> None:
        self.facts = facts
        self.restored = restored
        self.reference = reference
        self._history = restored.history
        self._journal = journal
        self._solver = solver
        self._lock = threading.Lock()
        self._subscribers: tuple[Subscriber, ...] = ()
        self._untold: deque[tuple[View, tuple[Subscriber, ...]]] = deque()
        self._telling = False
        self._ask_for_answer(restored.history.present)

    @property
    def history(self) -> History:
        """The session with what can be undone and redone."""
        return self._history

    @property
    def session(self) -> Session:
        """The session of now."""
        return self._history.present

    @property
    def view(self) -> View:
        """What there is to draw now."""
        return view(self._history, self.facts, self.reference)

    def dispatch(self, step: Step) -> None:
        """Take one step: apply it, journal it, then tell the subscribers.

        Raises:
            EventError: the event does not fit; nothing changed.
            OptionError: an option is unknown or out of range; nothing changed.
            SessionFileError: the step could not be kept; nothing changed.
        """
        with self._lock:
            step = settled(step, self._history.present)
            after = advance(self._history, step, self.facts)
            if after is self._history:
                return
            if not isinstance(step, Solved):
                self._journal.append(step, after)
            self._history = after
            self._untold.append((view(after, self.facts, self.reference), self._subscribers))
        self._ask_for_answer(after.present)
        self._tell()

    def undo(self) -> None:
        """Take the last change back; nothing happens when there is none."""
        self.dispatch(Undo())

    def redo(self) -> None:
        """Make the change again that was taken back last; nothing happens when there is none."""
        self.dispatch(Redo())

    def subscribe(self, subscriber: Subscriber) -> Callable[[], None]:
        """Call the subscriber with the View of now and of every change from now on.

        Returns:
            a function that ends the subscription.
        """
        with self._lock:
            self._subscribers = (*self._subscribers, subscriber)
            self._untold.append((view(self._history, self.facts, self.reference), (subscriber,)))
        self._tell()

        def end() -> None:
            with self._lock:
                self._subscribers = tuple(other for other in self._subscribers if other is not subscriber)

        return end

    def clicks_text(self) -> str:
        """Return the clicks as a clicks-1 file."""
        return write_clicks(self.session.clicks)

    def import_clicks(self, text: str, source: str) -> None:
        """Let the clicks of a clicks-1 file join the session.

        Args:
            text: the content of the file.
            source: its name, for error messages.

        Raises:
            InputError: the text is not a file of clicks.
            EventError: a click does not belong to a frame of this recording; nothing changed.
        """
        self.dispatch(ClicksImported(read_clicks(text, source)))

    def close(self) -> None:
        """Stop the solver and let go of the session file."""
        self._solver.close()
        with self._lock:
            self._journal.close()

    def _ask_for_answer(self, session: Session) -> None:
        """Ask without the lock: the answer may come in this very call, and older requests never replace newer ones."""
        if session.needs_solving:
            self._solver.request(session.revision, session.clicks, session.options, self.dispatch)

    def _tell(self) -> None:
        """Tell the subscribers what they have not heard, one thread at a time and in order."""
        while True:
            with self._lock:
                if self._telling or not self._untold:
                    return
                shown, subscribers = self._untold.popleft()
                self._telling = True
            try:
                for subscriber in subscribers:
                    subscriber(shown)
            finally:
                with self._lock:
                    self._telling = False


def recording_facts(recording: Recording, name: str) -> RecordingFacts:
    """Return the little that clicks must fit.

    Args:
        recording: the open recording.
        name: what to call it.

    Raises:
        InputError: it has no frames to click in.
    """
    if not len(recording.image_times):
        raise InputError(
            f"{name}: has no frames to click in; give the recording of the camera too, or another --image-topic"
        )
    picture = recording.image_bytes(0)
    return RecordingFacts(name, recording.image_times, picture.width_px, picture.height_px, recording.radar_axes)


def open_workspace(
    recording: Recording,
    *,
    camera: Camera | None,
    session_folder: Path,
    name: str,
    reference: Reference | None = None,
) -> Workspace:
    """Open or begin the session of a recording, with a solver beside it.

    Args:
        recording: the open recording.
        camera: the intrinsics to solve with; None where there are none.
        session_folder: where the session is kept.
        name: what to call the recording.
        reference: a calibration to look at and to compare with; None without one.

    Raises:
        InputError: the recording has no frames.
        SessionFileError: the session cannot be opened.
    """
    facts = recording_facts(recording, name)
    session_file = open_session_file(session_folder, facts)
    solver = SolverWorker(recording, camera, reference.calibration if reference else None)
    return Workspace(facts, session_file.restored, session_file, solver, reference)
