"""Our changes to websockets: who answers its requests, and which of its log messages are shown.

viser starts its server with `websockets.asyncio.server.serve`, looked up when it is called. Inside `wrapped_serve`, that name
refers to our function. tests/unit/app/web/port/test_websockets_hook.py fails with a clear message if websockets changes this.
"""

import logging
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

__all__ = ["ProcessRequest", "SocketHandler", "wrapped_serve"]

ProcessRequest = Callable[[ServerConnection, Request], Awaitable[Response | None]]
SocketHandler = Callable[[ServerConnection], Awaitable[None]]

_LOGGER = "cocalib.port"
_one_at_a_time = threading.Lock()


class _NoHandshakeNoise(logging.Filter):
    """Drop the log messages of port scans and refused requests; real failures of a handler are kept.

    A client that disconnects in the middle of a request trips an assertion in websockets; that is not our failure either.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        left = text == "unexpected internal error" and record.exc_info and record.exc_info[0] is AssertionError
        return not left and "handshake" not in text and "connection rejected" not in text


@contextmanager
def wrapped_serve(
    wrap_request: Callable[[Any], ProcessRequest], wrap_handler: Callable[[SocketHandler], SocketHandler]
) -> Iterator[threading.Event]:
    """Wrap the request processing of every server that websockets starts inside this context.

    Args:
        wrap_request: given the server's `process_request`, returns the one to use.
        wrap_handler: given the server's WebSocket handler, returns the one to use.

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
        return original(wrap_handler(handler), *args, **kwargs)

    with _one_at_a_time:
        websocket_server.serve = serve  # type: ignore[assignment, misc]
        try:
            yield used
        finally:
            websocket_server.serve = original  # type: ignore[misc]
