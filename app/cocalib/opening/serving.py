"""Serve recordings until a signal comes; what goes wrong while one is opened is shown in the page, which may choose again."""

import contextlib
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from calib_core.errors import CalibrationError, RecordingError
from calib_core.recordings import first_picture
from cocalib.opening.choice import Choice, ChoicePart, UnusablePartError
from cocalib.opening.choices import choices_after, choices_of
from cocalib.opening.desk import OpeningDesk
from cocalib.opening.opened import open_choice, with_remembered
from cocalib.opening.recent import RecentRecordings
from cocalib.opening.root_folder import RootFolder
from cocalib.platform.error_boundary import error_boundary
from cocalib.view import sentence
from cocalib.web.messages import Opening, OpeningChoices
from cocalib.web.port.link import Link
from cocalib.web.port.serving import Service

_RECORDING_SUFFIXES = (".bag", ".mcap", ".db3")
_LARGE_BYTES = 1_000_000_000
"""If the files are this large in total, the page is served before they are opened."""
_SOON_S = 0.2
"""Smaller files are usually open within this time, and the page then shows no waiting screen [s]."""


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
    desk = OpeningDesk(serving.recent, serving.root)
    choice, was_served = first, False
    with _service(first, serving, desk) as service:
        while True:
            problem = _Problem()
            try:
                with problem.kept() if serving.asks else contextlib.nullcontext():
                    if choice is not None and _served_to_the_end(choice, service, desk, serving):
                        return 0
                if choice is not None and problem.part is not None:
                    choice = choice.without(problem.part)
                if choice is None or problem.words:
                    _ask(choice, problem.words, service, desk)
                else:
                    was_served = True
            except KeyboardInterrupt:
                if not was_served and choice is not None and not problem.words:
                    raise
                _say_stopped()
                return 2 if problem.words and not was_served else 0
            choice = desk.take()
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


def _served_to_the_end(choice: Choice, service: Service, desk: OpeningDesk, serving: Serving) -> bool:
    """Open and serve a recording; return False if a page chose something else.

    Raises:
        CalibrationError: it cannot be opened.
    """
    with ExitStack() as stack:
        opened = open_choice(choice, stack, service.tell)
        workspace, settled = opened.workspace, choice.settled()
        desk.put(choices_of(settled, opened), settled, opened)
        if not choice.is_sample:
            serving.recent.add(choice.paths, choice.title, len(workspace.session.clicks))
        goes_on = service.serve(workspace, opened.recording)
        closed = workspace.close()
    if not choice.is_sample and closed.clicks:
        serving.recent.add(choice.paths, choice.title, closed.clicks)
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(
            f"\n{'Closed' if goes_on else 'Stopped'}; {closed.note}." if workspace.facts.has_pictures else "\nStopped."
        )
    return not goes_on


def _ask(choice: Choice | None, problem: str, service: Service, desk: OpeningDesk) -> None:
    """Ask the page what to open, and wait for its answer."""
    choices = OpeningChoices(0) if choice is None else OpeningChoices(0, choice.title, problem)
    if choice is not None:
        with error_boundary("listing what can be chosen", lambda _line: None):  # `problem` says what is wrong
            choices = choices_after(choice, problem)
    service.ask(desk.put(choices, choice))


def _say_stopped() -> None:
    with contextlib.suppress(OSError):  # the terminal may be gone
        print("\nStopped.")


def _service(first: Choice | None, serving: Serving, desk: OpeningDesk) -> Service:
    """Return the service; it serves the page of a large recording before the recording is open."""
    if first is None:
        nothing = Opening("", "Choose a recording")
        return Service(serving.link, nothing, lambda: None, let_in_after_s=_SOON_S, desk=desk)
    return Service(
        serving.link,
        _opening(first),
        partial(first_picture, () if first.follow else first.paths, with_remembered(first)),
        let_in_after_s=0.0 if first.follow or _size_bytes(first) >= _LARGE_BYTES else _SOON_S,
        desk=desk,
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
