"""The only mutable state of the program: the history of the session, and how every change is made."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, TypeAlias

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange.cameras.files import CameraFile
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.own.clicks_json import read_clicks, write_clicks
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import Recording, assumption_hint
from calib_core.results import DataWarning
from cocalib.hypothesis_sheet import OpenMeaning
from cocalib.session.applying import History, advance, settled
from cocalib.session.events import ClicksImported, ScansAdded, Solved, Step
from cocalib.session.file.session_file import Closed, Restored, open_session_file
from cocalib.session.state import AssumedReading, ChosenIntrinsics, RecordingFacts, Session
from cocalib.solving.worker import SolverWorker
from cocalib.view.build import view
from cocalib.view.model import View
from cocalib.view.placement_states import SeenPlacements
from cocalib.view.reference import Reference

_LONGEST_WAIT_S = 1.0
Subscriber: TypeAlias = Callable[[View], None]


class Journal(Protocol):
    """Stores the steps: cocalib.session.file.SessionFile, or a list in a test."""

    def append(self, step: Step, history: History) -> None:
        """Store a step permanently before returning; `history` is the state after it."""

    def close(self) -> Closed:
        """Close the file; return whether everything is in it, also when called again."""


class NullJournal:
    """Journal that stores nothing: changes of options while looking at a recording without images are not kept."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def append(self, step: Step, history: History) -> None:
        """Do nothing."""

    def close(self) -> Closed:
        """Return that there was nothing to store."""
        return Closed(self._folder, clicks=0)


@dataclass(frozen=True, slots=True)
class GivenIntrinsics:
    """The intrinsics that a recording was opened with.

    Attributes:
        camera: None if there are none.
        file: that they come from; None for the recording's own.
        about: where they come from, in words; "" if there are none.
    """

    camera: Camera | None = None
    file: CameraFile | None = None
    about: str = ""


class Workspace:
    """Holds the session; every change is made by dispatching a step.

    A step is journalled before the subscribers are notified. Views reach them in the order of the changes and outside the
    lock, so a subscriber may dispatch; it must return quickly and must not raise.

    Attributes:
        facts: the recording's frames.
        restored: what was found in the session's folder at the start.
        reference: a calibration to show until the clicks give a new one; None if there is none.
        given: the intrinsics that the recording was opened with.
        open_meaning: a calibration that does not state what its numbers mean, for a person to pick; None if there is none.
    """

    open_meaning: OpenMeaning | None = None

    def __init__(
        self,
        facts: RecordingFacts,
        restored: Restored,
        journal: Journal,
        solver: SolverWorker,
        reference: Reference | None = None,
        given: GivenIntrinsics | None = None,
    ) -> None:
        self.facts = facts
        self.restored = restored
        self.reference = reference
        self.given = given or GivenIntrinsics()
        self._chosen: tuple[ChosenIntrinsics, Camera] | None = None
        self._history = restored.history
        self._seen: SeenPlacements | None = None
        self._journal = journal
        self._solver = solver
        self._lock = threading.Lock()
        self._subscribers: tuple[Subscriber, ...] = ()
        self._pending: deque[tuple[View, tuple[Subscriber, ...]]] = deque()
        self._turn = threading.Lock()
        self._notifier: int | None = None
        self._answered = threading.Event()
        self._ask_for_answer(restored.history.present)

    @property
    def history(self) -> History:
        """The session, with what can be undone and redone."""
        return self._history

    @property
    def session(self) -> Session:
        """The current session."""
        return self._history.present

    @property
    def view(self) -> View:
        """The current View."""
        return self._view_of(self._history)

    @property
    def camera(self) -> Camera | None:
        """The intrinsics to solve with: those chosen in the session, else those it was opened with; None if there are none."""
        return self._chosen_camera(self.session) or self.given.camera

    @property
    def camera_file(self) -> CameraFile | None:
        """The file that they come from; None for the recording's own."""
        chosen = self._chosen_camera(self.session)
        if chosen is None:
            return self.given.file
        return CameraFile("camera.yaml", camera_info_text(chosen, "camera").encode())

    @property
    def intrinsics(self) -> str:
        """Where they come from, in words; "" if there are none."""
        chosen = self.session.intrinsics
        return self.given.about if chosen is None else chosen.about

    def _chosen_camera(self, session: Session) -> Camera | None:
        """Return the camera chosen in a session, the same object each time; None if none was."""
        chosen = session.intrinsics
        if chosen is None:
            return None
        kept = self._chosen
        if kept is None or kept[0] != chosen:
            kept = self._chosen = (chosen, chosen.camera)
        return kept[1]

    def _view_of(self, history: History) -> View:
        return view(history, self.facts, self.reference, self._seen)

    def show_placements(self, seen: SeenPlacements) -> None:
        """Take in the placements that were found in the radar data, so that the View says what became of each."""
        with self._lock:
            self._seen = seen
            self._pending.append((self._view_of(self._history), self._subscribers))
        self._notify()

    def dispatch(self, step: Step) -> None:
        """Apply one step, journal it, then notify the subscribers.

        Raises:
            EventError: the event does not fit; nothing changed.
            OptionError: an option is unknown or out of range; nothing changed.
            SessionFileError: the step could not be stored; nothing changed.
        """
        with self._lock:
            step = settled(step, self._history.present)
            after = advance(self._history, step, self.facts)
            if after is self._history:
                return
            if not isinstance(step, Solved | ScansAdded):
                self._journal.append(step, after)
            self._history = after
            self._pending.append((self._view_of(after), self._subscribers))
        self._ask_for_answer(after.present)
        self._notify()

    def extend(self, image_times: TimesNs, scans_from: TimeNs | None) -> None:
        """Take in frames and scans that have been written since; clicks with new scans in their window are solved again.

        Args:
            image_times: (m,) stamps of all frames; those before stay the first ones.
            scans_from: stamp of the first new scan; None if there is none.
        """
        with self._lock:
            self.facts = replace(self.facts, image_times=image_times)
            session = self._history.present
        locating = session.options.locating
        reach_ns = round((locating.window_s / 2 + locating.max_time_gap_s) * NS_PER_S)
        if scans_from is not None and any(click.image_time + reach_ns >= scans_from for click in session.clicks):
            self.dispatch(ScansAdded())

    def subscribe(self, subscriber: Subscriber) -> Callable[[], None]:
        """Call the subscriber with the current View, and again after every change.

        Returns:
            a function that ends the subscription.
        """
        with self._lock:
            self._subscribers = (*self._subscribers, subscriber)
            self._pending.append((self._view_of(self._history), (subscriber,)))
        self._notify()

        def end() -> None:
            with self._lock:
                self._subscribers = tuple(other for other in self._subscribers if other is not subscriber)

        return end

    def clicks_text(self) -> str:
        """Return the clicks as a clicks-1 file."""
        return write_clicks(self.session.clicks, radar_topics=self.facts.radar_topics)

    def import_clicks(self, text: str, source: str) -> None:
        """Add the clicks of a clicks-1 file to the session.

        Args:
            text: the content of the file.
            source: its name, for error messages.

        Raises:
            InputError: the text is not a file of clicks.
            EventError: a click does not belong to a frame of this recording; nothing changed.
        """
        self.dispatch(ClicksImported.of(read_clicks(text, source)))

    def wait_for_answer(self) -> None:
        """Wait until the clicks are answered, a second at most: for work in the background, which would make the answer late."""
        self._answered.wait(_LONGEST_WAIT_S)

    def close(self) -> Closed:
        """Stop the solver and close the session file; return whether all clicks are on the disk.

        Safe to call again.
        """
        self._solver.close()
        self._answered.set()
        with self._lock:
            return self._journal.close()

    def _ask_for_answer(self, session: Session) -> None:
        """Request a solve without holding the lock: the answer may come at once; older requests never replace newer ones."""
        if not session.needs_solving:
            self._answered.set()
        else:
            self._answered.clear()
            camera = self._chosen_camera(session)
            self._solver.request(session.revision, session.clicks, session.options, self.dispatch, camera)

    def _notify(self) -> None:
        """Send pending Views to their subscribers, in order; return once they have them.

        So a page has the View of its change before it is told that the change is done. A subscriber's own change is sent when the
        subscriber has returned.
        """
        if self._notifier == threading.get_ident():
            return
        with self._turn:
            self._notifier = threading.get_ident()
            try:
                while True:
                    with self._lock:
                        if not self._pending:
                            return
                        shown, subscribers = self._pending.popleft()
                    for subscriber in subscribers:
                        subscriber(shown)
            finally:
                self._notifier = None


def recording_facts(recording: Recording, name: str) -> RecordingFacts:
    """Return what clicks are checked against.

    Args:
        recording: the open recording.
        name: what to call it.

    Raises:
        InputError: it has neither frames nor radar scans.
    """
    if not len(recording.image_times) and not len(recording.radar_times):
        raise InputError(f"{name}: has neither images nor radar scans; give the files of the radar and of the camera")
    image = recording.image_bytes(0) if len(recording.image_times) else None
    return RecordingFacts(
        name,
        recording.image_times,
        image.width_px if image else 0,
        image.height_px if image else 0,
        recording.radar_axes,
        recording.radar_times,
        recording.radar_topics,
        tuple(
            AssumedReading(assumption.words, assumption_hint(assumption.confirm))
            for assumption in recording.assumptions
        ),
    )


def open_workspace(
    recording: Recording,
    *,
    camera: Camera | None,
    session_folder: Path,
    name: str,
    reference: Reference | None = None,
    warnings: tuple[DataWarning, ...] = (),
    camera_file: CameraFile | None = None,
    intrinsics: str = "",
) -> Workspace:
    """Open or start the session of a recording, with its solver.

    Args:
        recording: the open recording.
        camera: the intrinsics to solve with; None if there are none.
        session_folder: where the session is stored.
        name: what to call the recording.
        reference: a calibration to review and to compare with; None if there is none.
        warnings: what is known about the choice of the session folder.
        camera_file: the file that the intrinsics come from; None for the recording's own.
        intrinsics: where they come from, in words; by default, that file or the recording's topic.

    Without images there is nothing to click and nothing to store: the session folder is not touched.

    Raises:
        InputError: the recording has neither frames nor radar scans.
        SessionFileError: the session cannot be opened.
    """
    facts = recording_facts(recording, name)
    if not facts.has_images:
        nothing = NullJournal(session_folder)
        return Workspace(facts, Restored(session_folder, History()), nothing, SolverWorker(recording, None))
    session_file = open_session_file(session_folder, facts, warnings)
    solver = SolverWorker(recording, camera, reference.calibration if reference else None)
    given = GivenIntrinsics(camera, camera_file, intrinsics or _source_of(camera, camera_file, recording))
    return Workspace(facts, session_file.restored, session_file, solver, reference, given)


def _source_of(camera: Camera | None, camera_file: CameraFile | None, recording: Recording) -> str:
    """Say where intrinsics come from; "" if there are none."""
    if camera is None:
        return ""
    if camera_file is not None:
        return name_text(Path(camera_file.source).name)
    return recording.camera_info_topic or "the recording"
