"""Serve the page of a recording until Ctrl+C, SIGTERM or SIGHUP.

If opening the recording takes long, the page is served before the recording is open.
"""

import contextlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Protocol, Self

from calib_core.errors import CalibrationError
from calib_core.recordings import EncodedImage, Recording
from cocalib.view.wording import sentence
from cocalib.web.channel.opening_service import OpeningService
from cocalib.web.messages.opening_messages import OpeningChoices
from cocalib.web.messages.outgoing import Opening
from cocalib.web.port.link import Link, ServerOptions
from cocalib.web.port.server import RunningServer
from cocalib.web.port.waiting import WaitingRoom
from cocalib.workspace import Workspace

_WAIT_S = 0.25
"""A signal is noticed at the latest after this time [s]."""
_log = logging.getLogger(__name__)


class ChoosingService(OpeningService, Protocol):
    """Answers what pages ask about the choice of a recording; `chosen` is set once a page has chosen."""

    chosen: threading.Event


class Service:
    """Serves recordings that are opened inside the `with` block; if that takes long, pages can already connect and wait.

    An error inside the `with` block is shown on the waiting pages and then raised to the caller.
    """

    def __init__(
        self,
        link: Link | ServerOptions,
        opening: Opening,
        first_image: Callable[[], EncodedImage | None],
        *,
        let_in_after_s: float,
        opening_service: ChoosingService | None = None,
    ) -> None:
        """Set up the service; nothing is served yet.

        Args:
            link: where the page is served, and who has access; one that was announced already can be in use.
            opening: the message for waiting pages.
            first_image: reads the image for waiting pages, in its own thread; returns None if there is none to show early.
            let_in_after_s: delay before waiting pages are admitted [s]; with 0, the link is printed before anything is opened,
                so that opening the recording and starting the browser do not slow each other down.
            opening_service: answers what pages ask about the choice of a recording; without, the recording is kept.
        """
        self._link = Link(link) if isinstance(link, ServerOptions) else link
        self._opening = opening
        self._first_image = first_image
        self._let_in_after_s = let_in_after_s
        self._opening_service = opening_service
        self._chosen = threading.Event() if opening_service is None else opening_service.chosen
        self._server: RunningServer | None = None
        self._is_settled = threading.Event()
        self._threads = ThreadPoolExecutor(max_workers=2, thread_name_prefix="early")

    def __enter__(self) -> Self:
        self._early: Future[RunningServer | None] = self._threads.submit(self._start_if_slow)
        try:
            if self._let_in_after_s <= 0:
                self._early.result()
        except BaseException:
            self._end(None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._end(error)

    def tell(self, doing: str) -> None:
        """Say what is being done, in the terminal and on the pages that wait."""
        print(doing, flush=True)
        server = self._server or self._early.result()
        if server is not None:
            server.tell(Opening(self._opening.name, doing))

    def start_over(self, opening: Opening) -> None:
        """Say that another recording is being opened."""
        self._opening = opening
        if self._server is not None:
            self._server.start_over(opening)

    def serve(self, workspace: Workspace, recording: Recording) -> bool:
        """Serve the opened recording until a signal ends it, or a page chose another one; the caller then closes the session.

        Returns:
            whether a page chose another recording, or another way to read this one.

        Raises:
            OSError: no port can be bound.
        """
        server = self._running()
        try:
            server.admit(workspace, recording)
            self._wait_for_choice()
        except KeyboardInterrupt:
            server.close()
            return False
        except BaseException:
            server.close()
            raise
        server.withdraw(Opening(workspace.facts.name, "Closing the session…"))
        return True

    def ask(self, choices: OpeningChoices) -> None:
        """Ask on the page which recording to open, or how, and wait for an answer.

        Raises:
            OSError: no port can be bound.
        """
        self._running().ask(choices)
        self._wait_for_choice()

    def _wait_for_choice(self) -> None:
        """Wait until a page has chosen. A signal that comes just before a wait does not end it, so each wait is short."""
        while not self._chosen.wait(_WAIT_S):
            pass

    def _running(self) -> RunningServer:
        """Return the server, started now if that was not needed earlier."""
        self._is_settled.set()
        if self._server is None:
            self._server = self._early.result() or self._start(WaitingRoom(opening_service=self._opening_service))
        return self._server

    def _end(self, error: BaseException | None) -> None:
        """Show the error on the waiting pages, and stop serving."""
        self._is_settled.set()
        server = self._server or (None if self._early.exception() else self._early.result())
        if server is not None:
            if isinstance(error, Exception):
                server.refuse(_problem_text(error))
            server.close()
        self._link.close()
        self._threads.shutdown()

    def _start_if_slow(self) -> RunningServer | None:
        if self._is_settled.wait(self._let_in_after_s):
            return None
        image = self._threads.submit(self._first_image)
        print(self._opening.doing, flush=True)
        server = self._start(WaitingRoom(self._opening, self._opening_service))
        image.add_done_callback(lambda done: _show(server, done))
        return server

    def _start(self, room: WaitingRoom) -> RunningServer:
        """Start the server and print its link."""
        server = RunningServer(self._link, room, self._opening_service)
        self._link.announce()
        return server


def _show(server: RunningServer, image: "Future[EncodedImage | None]") -> None:
    """Show the first image, if there is one; opening the recording reports any error in it."""
    if image.exception() is not None:
        _log.warning("the first image could not be read: %s", image.exception())
    elif (found := image.result()) is not None:
        with contextlib.suppress(RuntimeError):  # the server has stopped in the meantime
            server.show(found)


def _problem_text(error: Exception) -> str:
    if isinstance(error, CalibrationError):
        return sentence(str(error))
    return "The recording cannot be opened; see the terminal for the reason."
