"""Our changes to websockets: the head of a request is checked first, who answers it, and which log messages are shown.

viser starts its server with `websockets.asyncio.server.serve`, looked up when it is called. Inside `wrapped_serve`, that name
refers to our function. tests/unit/app/web/port/test_websockets_hook.py fails with a clear message if websockets changes this.
"""

import asyncio
import contextlib
import errno
import logging
import re
import socket
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from cocalib.platform.error_boundary import report_of

Fault = Literal[400, 414, 431, 505]
_MAX_HEAD_BYTES = 64 * 1024
_MAX_LINE_BYTES = 8 * 1024
_MAX_HEADERS = 100
_TOKEN = re.compile(rb"[-!#$%&'*+.^_`|~0-9A-Za-z]{1,64}")
_TARGET = re.compile(rb"[\x21-\x7e]+")
_VALUE = re.compile(rb"[\x09\x20-\x7e\x80-\xff]*")
_OF_A_BODY = (b"content-length", b"transfer-encoding", b"expect")
ProcessRequest = Callable[[ServerConnection, Request], Awaitable[Response | None]]
SocketHandler = Callable[[ServerConnection], Awaitable[None]]
_LOGGER = "cocalib.port"
_MOST_BEGINNING = 128
_NO_RESOURCES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_COMPLAIN_EVERY_S = 60.0
_log = logging.getLogger(_LOGGER)
_one_at_a_time = threading.Lock()


@dataclass(frozen=True, slots=True)
class Head:
    """A request's head.

    Attributes:
        method: such as GET.
        data: what websockets is given instead of the bytes received: a GET without a body.
        upgrades: it asks for a WebSocket; whatever follows any other head is of no interest.
        fault: the status to answer with at once; None if the head is sound.
    """

    method: str
    data: bytes
    upgrades: bool = False
    fault: Fault | None = None


def read_head(received: bytes) -> Head | None:
    """Read the head of a request.

    Args:
        received: all bytes of the connection so far.

    Returns:
        None while it is incomplete.
    """
    if received and not _TOKEN.match(received):
        return _faulty(400)  # such as the beginning of TLS
    end = received.find(b"\r\n\r\n", 0, _MAX_HEAD_BYTES)
    if end < 0:
        return _faulty(431) if len(received) >= _MAX_HEAD_BYTES else None
    first, *headers = received[:end].split(b"\r\n")
    parts = first.split(b" ")
    if len(first) > _MAX_LINE_BYTES:
        return _faulty(414)
    if len(parts) != 3 or not _TOKEN.fullmatch(parts[0]) or not _TARGET.fullmatch(parts[1]):
        return _faulty(400)
    if parts[2] != b"HTTP/1.1":
        return _faulty(505 if parts[2].startswith(b"HTTP/") else 400)
    return _with_headers(parts[0], parts[1], headers, received[end + 4 :])


def _with_headers(method: bytes, target: bytes, headers: list[bytes], rest: bytes) -> Head:
    if len(headers) > _MAX_HEADERS or any(len(line) > _MAX_LINE_BYTES for line in headers):
        return _faulty(431)
    kept = []
    for line in headers:
        name, colon, value = line.partition(b":")
        if not colon or not _TOKEN.fullmatch(name) or not _VALUE.fullmatch(value):
            return _faulty(400)
        if name.lower() not in _OF_A_BODY:
            kept.append(line)
        elif method == b"GET" and value.strip() != b"0":
            return _faulty(400)  # a GET with a body
    head = b"\r\n".join((b"GET " + target + b" HTTP/1.1", *kept))
    upgrades = method == b"GET" and any(line.lower().startswith(b"upgrade:") for line in kept)
    return Head(method.decode("ascii"), head + b"\r\n\r\n" + (rest if upgrades else b""), upgrades)


def _faulty(fault: Fault) -> Head:
    return Head("GET", b"GET / HTTP/1.1\r\n\r\n", fault=fault)


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
