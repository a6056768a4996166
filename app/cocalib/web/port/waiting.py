"""Pages that wait while the recording is being opened, or chosen: they show its first image, what can be chosen, and why.

Messages about the choice are answered at once; all others are kept until the recording is open.
"""

import asyncio
import logging
from collections import deque

from calib_core.errors import CalibrationError
from calib_core.recordings import EncodedImage
from cocalib.platform.error_boundary import error_boundary
from cocalib.view.wording import sentence
from cocalib.web.channel.channel import Socket
from cocalib.web.channel.opening_service import NoOpening, OpeningService, opening_answers
from cocalib.web.messages.incoming import is_about_opening, parse, request_of
from cocalib.web.messages.opening_messages import OpeningChoices, OpeningCommand
from cocalib.web.messages.outgoing import FrameHeader, Opening, Problem, encode, encode_frame

_log = logging.getLogger(__name__)

_MAX_HELD = 2000
"""A page that sends more messages than this before it can be answered is disconnected; it reconnects and repeats what matters."""
_REFUSAL_TIMEOUT_S = 3.0
"""How long to wait for a page to receive the reason why the recording cannot be opened [s]."""


class WaitingRoom:
    """Sends to every waiting page, once and in order: what is being done, the first image, the end. Runs on the event loop."""

    def __init__(self, opening: Opening | None = None, opening_service: OpeningService | None = None) -> None:
        self._opening_service: OpeningService = opening_service or NoOpening()
        self._first = 0
        self._opening = opening
        self._news: list[str | bytes] = [] if opening is None else [encode(opening)]
        self._changed = asyncio.Event()
        self._over = False
        self._waiting: set[asyncio.Task[None]] = set()

    def tell(self, opening: Opening) -> None:
        """Say what is being done now."""
        self._add(encode(opening))

    def show(self, image: EncodedImage) -> None:
        """Show an image. It is not a frame yet: it has no index and no time."""
        header = FrameHeader(-1, 0, image.width_px, image.height_px, 1.0, image.format)
        self._add(encode_frame(header, image.data))

    def start_over(self, opening: Opening) -> None:
        """Say that another recording is being opened; pages that come from now on see nothing of the one before."""
        self._first, self._opening = len(self._news), opening
        self.tell(opening)

    def ask(self, choices: OpeningChoices) -> None:
        """Ask which recording to open, or how."""
        self._first, name = len(self._news), choices.name
        self.tell(Opening(name, "Choose how to open it" if name else "Choose a recording"))
        self._add(encode(choices))

    def end(self) -> None:
        """Let all pages continue: the recording is open."""
        self._over = True
        self._change()

    async def refuse(self, problem: str) -> None:
        """Send the reason why the recording cannot be opened; return once the waiting pages have received it."""
        name, doing = (self._opening.name, self._opening.doing) if self._opening else ("", "")
        self._add(encode(Opening(name, doing, problem)))
        self.end()
        if self._waiting:
            await asyncio.wait(self._waiting, timeout=_REFUSAL_TIMEOUT_S)

    async def stay(self, socket: Socket) -> Socket:
        """Keep a page waiting until the recording is open.

        Returns:
            The page's socket, which first returns the messages that the page sent while waiting.

        Raises:
            BufferError: the page sent too many messages.
        """
        held: deque[str | bytes] = deque()
        reading = asyncio.create_task(self._hold(socket, held))
        sending = asyncio.create_task(self._send_news(socket))
        self._waiting.add(sending)
        try:
            await asyncio.wait({reading, sending}, return_when=asyncio.FIRST_COMPLETED)
            for task in (sending, reading):
                if task.done():
                    task.result()
        finally:
            self._waiting.discard(sending)
            for task in (sending, reading):
                task.cancel()
            await asyncio.gather(sending, reading, return_exceptions=True)
        return _ResumedSocket(socket, held)

    async def _send_news(self, socket: Socket) -> None:
        sent = self._first
        while True:
            changed = self._changed
            while sent < len(self._news):
                await socket.send(self._news[sent])
                sent += 1
            if self._over:
                return
            await changed.wait()

    async def _hold(self, socket: Socket, held: deque[str | bytes]) -> None:
        """Keep what a page sends for later, except for messages about the choice of a recording."""
        while len(held) < _MAX_HELD:
            text = await socket.recv()
            answers: list[str] | None = []
            with error_boundary("a waiting page's message", _log.error):
                answers = await self._answers(text)
            if answers is None:
                held.append(text)
            for answer in answers or ():
                await socket.send(answer)
        raise BufferError(f"the page sent {len(held)} messages before it could be answered")

    async def _answers(self, text: str | bytes) -> list[str] | None:
        """Answer a message about the choice of a recording; return None for any other."""
        try:
            incoming = parse(text)
            if not isinstance(incoming.command, OpeningCommand):
                return None
            return await opening_answers(self._opening_service, incoming)
        except CalibrationError as error:
            if not is_about_opening(text):
                return None
            return [encode(Problem(sentence(str(error)), request=request_of(text)))]

    def _add(self, message: str | bytes) -> None:
        self._news.append(message)
        self._change()

    def _change(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()


class _ResumedSocket:
    """A socket whose first messages have already been read."""

    def __init__(self, socket: Socket, held: deque[str | bytes]) -> None:
        self._socket = socket
        self._held = held

    async def recv(self) -> str | bytes:
        return self._held.popleft() if self._held else await self._socket.recv()

    async def send(self, message: str | bytes, /) -> None:
        await self._socket.send(message)
