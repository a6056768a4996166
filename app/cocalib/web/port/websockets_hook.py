"""Our changes to websockets: who answers its requests, and which of its log messages are shown.

viser starts its server with `websockets.asyncio.server.serve`, looked up when it is called. Inside `wrapped_serve`, that name
refers to our function. tests/unit/app/web/port/test_websockets_hook.py fails with a clear message if websockets changes this.
"""

import asyncio
import contextlib
import errno
import logging
import socket
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from cocalib.platform.error_boundary import report_of
from cocalib.web.port.request_head import Head, read_head

ProcessRequest = Callable[[ServerConnection, Request], Awaitable[Response | None]]
SocketHandler = Callable[[ServerConnection], Awaitable[None]]

_LOGGER = "cocalib.port"
_MOST_BEGINNING = 128
_NO_RESOURCES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_COMPLAIN_EVERY_S = 60.0
_log = logging.getLogger(_LOGGER)
_one_at_a_time = threading.Lock()


class _NoHandshakeNoise(logging.Filter):
    """Drop the log messages of port scans and refused requests; real failures of a handler are kept.

    A client that disconnects in the middle of a request trips an assertion in websockets; that is not our failure either.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        left = text == "unexpected internal error" and record.exc_info and record.exc_info[0] is AssertionError
        return not left and "handshake" not in text and "connection rejected" not in text


class _Complaints:
    """What the event loop reports: too many open files once a minute, anything else with a report in a file.

    The loop itself tries to accept again after a second, so that a server recovers when files are closed.
    """

    def __init__(self) -> None:
        self._next_s = 0.0

    def handle(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in _NO_RESOURCES:
            if time.monotonic() >= self._next_s:
                self._next_s = time.monotonic() + _COMPLAIN_EVERY_S
                _log.error("no connection can be accepted: %s; waiting until some are closed", error.strerror)
        elif isinstance(error, Exception):
            _log.error("%s", report_of(error, str(context.get("message", "the event loop"))))
        else:
            _log.error("%s", context.get("message"))


class Connection(ServerConnection):
    """A connection whose requests may have any method, and are answered whatever is wrong with them.

    Of the connections that have not sent a request yet, only so many are kept: they must not use up the descriptors.
    """

    beginning: "deque[Connection]"

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.head: Head | None = None
        self._received = bytearray()
        self._ended_early = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:  # noqa: D102
        super().connection_made(transport)
        self.beginning.append(self)
        if len(self.beginning) > _MOST_BEGINNING:
            self.beginning.popleft().transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: D102
        self._begun()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:  # noqa: D102
        if self.head is None:
            self._received += data
            self.head = read_head(bytes(self._received))
            if self.head is None:
                return
            self._begun()
            data = self.head.data
            self._received.clear()
        elif not self.head.upgrades:
            return
        super().data_received(data)

    def eof_received(self) -> bool | None:  # type: ignore[override]
        """Answer a client that sends no more after its request; a WebSocket needs both directions.

        Until the answer is sent the protocol is not told, for it would close the connection.
        """
        if self.head is not None and not self.head.upgrades and self.response is None:
            self._ended_early = True
            return True
        super().eof_received()
        return None

    def send_data(self) -> None:
        """Send, and close the connection of a client that had ended its side before the answer."""
        super().send_data()
        if self._ended_early and self.response is not None:
            self._ended_early = False
            super().eof_received()
            self.transport.close()

    def _begun(self) -> None:
        with contextlib.suppress(ValueError):
            self.beginning.remove(self)


def head_of(connection: ServerConnection) -> Head:
    """Return the head of the request that opened a connection of ours."""
    assert isinstance(connection, Connection)
    assert connection.head is not None
    return connection.head


@contextmanager
def wrapped_serve(
    wrap_request: Callable[[Any], ProcessRequest],
    wrap_handler: Callable[[SocketHandler], SocketHandler],
    listening: socket.socket | None = None,
) -> Iterator[threading.Event]:
    """Wrap the request processing of every server that websockets starts inside this context.

    Args:
        wrap_request: given the server's `process_request`, returns the one to use.
        wrap_handler: given the server's WebSocket handler, returns the one to use.
        listening: a socket to serve on instead of the address that the server asks for.

    Yields:
        an event that is set once a server has been started this way.
    """
    original, used = websocket_server.serve, threading.Event()

    def serve(handler: SocketHandler, *args: Any, **kwargs: Any) -> Any:
        used.set()
        logger = logging.getLogger(_LOGGER)
        if not logger.filters:
            logger.addFilter(_NoHandshakeNoise())
        kwargs["process_request"] = wrap_request(kwargs.get("process_request"))
        kwargs["logger"] = logger
        kwargs["create_connection"] = type("OurConnection", (Connection,), {"beginning": deque()})
        kwargs["server_header"] = None  # nobody needs to know our versions
        asyncio.get_running_loop().set_exception_handler(_Complaints().handle)
        if listening is not None:
            return original(wrap_handler(handler), sock=listening, **kwargs)
        return original(wrap_handler(handler), *args, **kwargs)

    with _one_at_a_time:
        websocket_server.serve = serve  # type: ignore[assignment, misc]
        try:
            yield used
        finally:
            websocket_server.serve = original  # type: ignore[misc]
