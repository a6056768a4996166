"""Serve recordings until a signal comes; the chooser answers pages, also after what went wrong with another."""

import contextlib
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import calib_core.recordings as recordings
from calib_core.errors import CalibrationError, InputError, RecordingError
from calib_core.input_files import name_text
from calib_core.interchange.cameras.files import CameraFile
from calib_core.recordings import Recording, TopicSummary, first_image
from cocalib.opening.choice import Choice, ChoicePart, UnusablePartError
from cocalib.opening.opened import Opened, open_choice, session_offer, with_remembered
from cocalib.opening.recent import RecentRecordings
from cocalib.opening.root_folder import RootFolder
from cocalib.platform.error_boundary import error_boundary
from cocalib.solving.solving import camera_for, intrinsics_near
from cocalib.view.wording import sentence
from cocalib.web.messages.opening_messages import (
    ChoicesWanted,
    DroppedFile,
    FolderWanted,
    OpeningChoices,
    OpeningCommand,
    OpenWith,
    RecentForgotten,
    TopicRow,
)
from cocalib.web.messages.outgoing import Opening, Outgoing
from cocalib.web.port.link import Link
from cocalib.web.port.serving import Service

_RECORDING_SUFFIXES = (".bag", ".mcap", ".db3")
_LARGE_BYTES = 1_000_000_000
"""If the files are this large in total, the page is served before they are opened."""
_SOON_S = 0.2
"""Smaller files are usually open within this time, and the page then shows no waiting screen [s]."""


class RecordingChooser:
    """Knows what is open and what can be chosen. Used by the main thread and by those that answer pages.

    Attributes:
        chosen: set once a page has chosen; `take` clears it.
    """

    def __init__(self, recent: RecentRecordings, root: RootFolder | None) -> None:
        self.chosen = threading.Event()
        self._recent = recent
        self._root = root
        self._lock = threading.Lock()
        self._question = 0
        self._choices = OpeningChoices(0)
        self._choice: Choice | None = None
        self._opened: Opened | None = None
        self._session: Path | None = None
        self._next: Choice | None = None
        self._answer = ""
        self._asks = False

    def put(self, choices: OpeningChoices, choice: Choice | None, opened: Opened | None = None) -> OpeningChoices:
        """Ask a new question; return it as pages see it.

        Args:
            choices: what can be chosen.
            choice: what is open, or could not be opened; None if nothing has been chosen.
            opened: the open recording with its session; None if none is.
        """
        with self._lock:
            self._question += 1
            self._asks = True
            self._choices, self._choice, self._opened = choices, choice, opened
            return self._current()

    def take(self) -> Choice:
        """Return what a page has chosen; it must have."""
        with self._lock:
            assert self._next is not None
            chosen, self._next = self._next, None
            self._opened = None
            self._asks = False
            self.chosen.clear()
            return chosen

    def answer(self, command: OpeningCommand) -> Outgoing | None:
        """Answer a page.

        Raises:
            InputError: it cannot be done; nothing changed.
            OSError: the list of recent recordings cannot be removed.
        """
        if isinstance(command, OpenWith):
            self._take_answer(command)
            return None
        if isinstance(command, FolderWanted):
            return self._root_folder().listing(command.path)
        if isinstance(command, RecentForgotten):
            self._recent.forget()
        elif not isinstance(command, ChoicesWanted):
            raise InputError("this message cannot be answered")
        with self._lock:
            return self._current()

    def _current(self) -> OpeningChoices:
        root = "" if self._root is None else name_text(self._root.path)
        session = self._choices.session
        if self._opened is not None:
            session = replace(session, clicks=len(self._opened.workspace.session.clicks))
        return replace(self._choices, question=self._question, session=session, recent=self._recent.rows(), root=root)

    def _root_folder(self) -> RootFolder:
        if self._root is None:
            raise InputError("no folder can be browsed in the page; start cocalib open with --root FOLDER")
        return self._root

    def _take_answer(self, command: OpenWith) -> None:
        with self._lock:
            if command.answer == self._answer:
                return  # sent again after a lost connection
            if not self._asks or command.question != self._question or self._next is not None:
                raise InputError(
                    "this question has been answered already, in another tab or window; what was chosen there is being opened"
                )
            self._next = self._chosen_by(command)
            self._answer = command.answer
            self.chosen.set()

    def _chosen_by(self, command: OpenWith) -> Choice:
        """Return what a page wants to open, checked as far as it can be without opening it.

        Raises:
            InputError: it cannot be opened.
        """
        if command.recent:
            paths = self._recent.paths_of(command.recent)
            if not paths:
                raise InputError("this recording is not there any more; choose another one")
            return Choice(paths)
        if command.paths:
            root = self._root_folder()
            return Choice(root.recordings(command.paths), below=root.path)
        if self._choice is None:
            raise InputError("no recording has been chosen; choose one from the list")
        camera_file = self._camera_file(command, self._choice)
        same_frames = command.image_topic == self._choice.topics.image_topic
        if camera_file is not None and self._opened is not None and same_frames:
            camera_for(self._opened.recording, camera_file)  # refused while everything is still open
        folder = self._choices.session.folder
        return self._choice.read_as(command, camera_file, Path(folder) if folder else None)

    def _camera_file(self, command: OpenWith, choice: Choice) -> CameraFile | None:
        if command.intrinsics == "keep":
            return choice.camera_file
        if command.intrinsics == "recorded":
            return None
        if command.intrinsics == "near":
            near = intrinsics_near(choice.paths)
            if near is None:
                raise InputError("there is no file of intrinsics next to the recording any more; drop one on the page")
            return CameraFile.read(near)
        if command.file is None:
            raise InputError("no file of intrinsics was sent; drop one on the page")
        return _read_dropped_camera(command.file)


def _read_dropped_camera(file: DroppedFile) -> CameraFile:
    """Take a file that was dropped on the page; it is checked to be a camera's here, and its size against the frames later."""
    name = name_text(file.name.replace("\\", "/").rpartition("/")[2]) or "the file"
    dropped = CameraFile(name, file.data, file.camera or None)
    if not file.data:
        raise InputError(f"{name}: is empty; drop the file of intrinsics")
    return dropped


@dataclass(frozen=True, slots=True)
class Serving:
    """Where to serve, and what happens when a recording cannot be opened.

    Attributes:
        link: where, and who has access; it may have been announced already.
        asks: ask the page to choose again; otherwise the error ends the program.
        root: a folder in which the page may choose recordings; None for none.
        recent: the recordings that were opened before.
    """

    link: Link
    asks: bool = True
    root: RootFolder | None = None
    recent: RecentRecordings = field(default_factory=RecentRecordings)


def serve(first: Choice | None, serving: Serving) -> int:
    """Open, serve until Ctrl+C, SIGTERM or SIGHUP or until a page chooses something else, close; and again.

    Args:
        first: what to open; None to ask the page.
        serving: where to serve, and what happens if that fails.

    Returns:
        the exit code: 0 after a recording was served or nothing had to be opened; 2 if a signal came while the page asked
        because a recording could not be opened.

    Raises:
        CalibrationError: it cannot be opened, and nothing is to be asked.
    """
    if first is None and not serving.asks:
        raise RecordingError("no recording given; name one or more .bag, .mcap, .db3 files or bag folders")
    chooser = RecordingChooser(serving.recent, serving.root)
    choice, was_served = first, False
    with _service(first, serving, chooser) as service:
        while True:
            problem = _Problem()
            try:
                with problem.kept() if serving.asks else contextlib.nullcontext():
                    if choice is not None and _served_to_the_end(choice, service, chooser, serving):
                        return 0
                if choice is not None and problem.part is not None:
                    choice = choice.without(problem.part)
                if choice is None or problem.words:
                    _ask(choice, problem.words, service, chooser)
                else:
                    was_served = True
            except KeyboardInterrupt:
                if not was_served and choice is not None and not problem.words:
                    raise
                with contextlib.suppress(OSError):  # the terminal may be gone
                    print("\nStopped.")
                return 2 if problem.words and not was_served else 0
            choice = chooser.take()
            service.start_over(_opening(choice))


@dataclass(slots=True)
class _Problem:
    """What went wrong while a recording was opened or served, if anything.

    Attributes:
        words: in sentences; "" if nothing did.
        part: of the choice that it is about; None if it is the recording itself.
    """

    words: str = ""
    part: ChoicePart | None = None

    @contextlib.contextmanager
    def kept(self) -> Iterator[None]:
        """Keep an error of the `with` block, and print it, instead of raising it."""
        with error_boundary("opening a recording", self._keep):
            try:
                yield
            except CalibrationError as error:
                self._keep(str(error))
                self.part = error.part if isinstance(error, UnusablePartError) else None
            except OSError as error:
                self._keep(f"{error.filename or 'a file'}: {error.strerror or error}")

    def _keep(self, line: str) -> None:
        print(f"cocalib: {' '.join(line.split())}", file=sys.stderr)
        self.words = sentence(line)


def _served_to_the_end(choice: Choice, service: Service, chooser: RecordingChooser, serving: Serving) -> bool:
    """Open and serve a recording; return False if a page chose something else.

    Raises:
        CalibrationError: it cannot be opened.
    """
    with ExitStack() as stack:
        opened = open_choice(choice, stack, service.tell)
        workspace, settled = opened.workspace, choice.settled()
        chooser.put(_choices_of(settled, opened), settled, opened)
        if not choice.is_sample:
            serving.recent.add(choice.paths, choice.title, len(workspace.session.clicks))
        goes_on = service.serve(workspace, opened.recording)
        closed = workspace.close()
    if not choice.is_sample and closed.clicks:
        serving.recent.add(choice.paths, choice.title, closed.clicks)
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(f"\n{'Closed' if goes_on else 'Stopped'}; {closed.note}." if workspace.facts.has_images else "\nStopped.")
    return not goes_on


def _ask(choice: Choice | None, problem: str, service: Service, chooser: RecordingChooser) -> None:
    """Ask the page what to open, and wait for its answer."""
    choices = OpeningChoices(0) if choice is None else OpeningChoices(0, choice.title, problem)
    if choice is not None:
        with error_boundary("listing what can be chosen", lambda _line: None):  # `problem` says what is wrong
            choices = _choices_after(choice, problem)
    service.ask(chooser.put(choices, choice))


def _service(first: Choice | None, serving: Serving, chooser: RecordingChooser) -> Service:
    """Return the service; it serves the page of a large recording before the recording is open."""
    if first is None:
        nothing = Opening("", "Choose a recording")
        return Service(serving.link, nothing, lambda: None, let_in_after_s=_SOON_S, opening_service=chooser)
    return Service(
        serving.link,
        _opening(first),
        partial(first_image, () if first.follow else first.paths, with_remembered(first)),
        let_in_after_s=0.0 if first.follow or _size_bytes(first) >= _LARGE_BYTES else _SOON_S,
        opening_service=chooser,
    )


def _opening(choice: Choice) -> Opening:
    """Say what is being opened."""
    size_bytes = _size_bytes(choice)
    size = f" ({size_bytes / 1e9:.1f} GB)" if size_bytes >= _LARGE_BYTES / 10 else ""
    name = choice.title
    doing = f"Waiting for {name}…" if choice.follow else f"Opening {name}{size}: reading its index and times…"
    return Opening(name, doing)


def _size_bytes(choice: Choice) -> int:
    return sum(map(_size_of, choice.paths))


def _size_of(path: Path) -> int:
    """Return the size of a file, or of the recording files in a folder; 0 if that is unknown."""
    try:
        if path.is_dir():
            return sum(inside.stat().st_size for inside in path.iterdir() if inside.suffix in _RECORDING_SUFFIXES)
        return path.stat().st_size
    except OSError:  # opening the recording reports the error
        return 0


def _choices_of(choice: Choice, opened: Opened) -> OpeningChoices:
    """Describe what can be chosen instead of what is open."""
    workspace = opened.workspace
    described = _choices_message(choice, opened.recording)
    folder = workspace.restored.folder if workspace.facts.has_images else None
    return replace(
        described,
        is_open=True,
        radar_topic=choice.topics.radar_topic,
        image_topic=choice.topics.image_topic,
        intrinsics=workspace.intrinsics,
        intrinsics_file=workspace.given.file is not None,
        session=session_offer(choice, workspace.facts, folder),
    )


def _choices_after(choice: Choice, problem: str) -> OpeningChoices:
    """Describe what can be chosen after a recording could not be opened as chosen.

    Args:
        choice: how it was to be opened.
        problem: why that failed, in sentences.
    """
    session = session_offer(choice, None, None)
    nothing = OpeningChoices(0, choice.title, problem, session=session, intrinsics_near=_nearest_name(choice))
    plain = replace(choice.topics, radar_topic=None, image_topic=None, camera_info_topic=None)
    try:
        with recordings.inspect_recording(choice.paths, plain) as recording:
            return replace(_choices_message(choice, recording), problem=problem, session=session)
    except (CalibrationError, OSError):  # `problem` says what is wrong with it
        return nothing


def _choices_message(choice: Choice, recording: Recording) -> OpeningChoices:
    return OpeningChoices(
        question=0,
        name=choice.title,
        radars=_radars(recording),
        radar_reason=recording.radar_choice,
        cameras=tuple(_row(topic) for topic in recording.topics if topic.kind == "image"),
        intrinsics=_intrinsics(choice, recording),
        recorded_intrinsics=recording.camera() is not None,
        intrinsics_near=_nearest_name(choice),
    )


def _intrinsics(choice: Choice, recording: Recording) -> str:
    """Say which intrinsics would be used; "" if there are none."""
    if choice.camera_file is not None:
        return name_text(Path(choice.camera_file.source).name)
    return (recording.camera_info_topic or "the recording") if recording.camera() is not None else ""


def _nearest_name(choice: Choice) -> str:
    near = intrinsics_near(choice.paths)
    return near.name if near is not None else ""


def _radars(recording: Recording) -> tuple[TopicRow, ...]:
    """List the radars, the one in use first; topics that are one radar are one row, if they have been compared."""
    topics = [topic for topic in recording.topics if topic.kind == "radar"]
    if len(topics) < 2:
        return tuple(map(_row, topics))
    compared = recording.radar_sensors
    rows = [
        TopicRow(sensor.name, recordings.figures_text(sensor.figures), used=number == 0)
        for number, sensor in enumerate(compared)
    ]
    known = {name for sensor in compared for name in (*sensor.topics, *sensor.copies)}
    return (*rows, *(_row(topic) for topic in topics if topic.name not in known))


def _row(topic: TopicSummary) -> TopicRow:
    rate = "" if topic.rate_hz is None else f" at {topic.rate_hz:.1f} Hz"
    problem = topic.problem or ("" if topic.count else "it has no messages")
    layout = f", {topic.layout}" if topic.layout else ""
    return TopicRow(topic.name, f"{topic.count} messages{rate}, {topic.type}{layout}", topic.chosen, problem)
