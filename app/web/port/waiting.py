"""Where pages wait while the recording is still being opened: they see its first picture, and what they say is kept for later."""

import asyncio
from collections import deque

from app.web.channel.channel import Socket
from app.web.messages import FrameHeader, Opening, encode, encode_frame
from calib_core.recordings import EncodedImage

__all__ = ["WaitingRoom"]

_MOST_HELD = 2000
"""A page that says more than this before it can be answered is let go; it comes again and repeats what counts."""
_FAREWELL_S = 3.0
"""How long a page may take to read why the recording cannot be opened [s]."""


class WaitingRoom:
    """Told once, in order, to every page that waits: what is going on, the first picture, the end. Lives on the event loop."""

    def __init__(self, opening: Opening | None = None) -> None:
        self._opening = opening
        self._news: list[str | bytes] = [] if opening is None else [encode(opening)]
        self._changed = asyncio.Event()
        self._over = False
        self._waiting: set[asyncio.Task[None]] = set()

    def show(self, picture: EncodedImage) -> None:
        """Show a picture. It is no frame yet: it has no place among them and no time."""
        header = FrameHeader(-1, 0, picture.width_px, picture.height_px, 1.0, picture.format)
        self._add(encode_frame(header, picture.data))

    def end(self) -> None:
        """The recording is open: everybody may go on."""
        self._over = True
        self._change()

    async def refuse(self, problem: str) -> None:
        """Say why the recording cannot be opened; return once those who wait have heard it."""
        name, doing = (self._opening.name, self._opening.doing) if self._opening else ("", "")
        self._add(encode(Opening(name, doing, problem)))
        self.end()
        if self._waiting:
            await asyncio.wait(self._waiting, timeout=_FAREWELL_S)

    async def stay(self, socket: Socket) -> Socket:
        """Let a page wait.

        Returns:
            The page's socket, which gives what the page has said meanwhile first.

        Raises:
            BufferError: the page has said too much.
        """
        held: deque[str | bytes] = deque()
        reading = asyncio.create_task(_hold(socket, held))
        telling = asyncio.create_task(self._tell(socket))
        self._waiting.add(telling)
        try:
            await asyncio.wait({reading, telling}, return_when=asyncio.FIRST_COMPLETED)
            for task in (telling, reading):
                if task.done():
                    task.result()
        finally:
            self._waiting.discard(telling)
            for task in (telling, reading):
                task.cancel()
            await asyncio.gather(telling, reading, return_exceptions=True)
        return _ResumedSocket(socket, held)

    async def _tell(self, socket: Socket) -> None:
        told = 0
        while True:
            changed = self._changed
            while told < len(self._news):
                await socket.send(self._news[told])
                told += 1
            if self._over:
                return
            await changed.wait()

    def _add(self, message: str | bytes) -> None:
        self._news.append(message)
        self._change()

    def _change(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()


class _ResumedSocket:
    """A socket some of whose messages were read before."""

    def __init__(self, socket: Socket, held: deque[str | bytes]) -> None:
        self._socket = socket
        self._held = held

    async def recv(self) -> str | bytes:
        return self._held.popleft() if self._held else await self._socket.recv()

    async def send(self, message: str | bytes, /) -> None:
        await self._socket.send(message)


async def _hold(socket: Socket, held: deque[str | bytes]) -> None:
    while len(held) < _MOST_HELD:
        held.append(await socket.recv())
    raise BufferError(f"the page has said {len(held)} things before it could be answered")
