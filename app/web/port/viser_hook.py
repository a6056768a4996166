"""Viser's port made ours: wrap websockets' `serve` while ViserServer starts, so that one port carries both.

Viser has no public way to add routes. The wrap lasts for the constructor only; tests/unit/app/web/port/test_server.py is
the contract that breaks first when a new viser starts its server in another way.
"""

import contextlib
import io
import logging
import threading
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

if TYPE_CHECKING:
    import viser

__all__ = ["ProcessRequest", "SocketHandler", "start_viser"]

ProcessRequest = Callable[[ServerConnection, Request], Awaitable[Response | None]]
SocketHandler = Callable[[ServerConnection], Awaitable[None]]

_one_at_a_time = threading.Lock()


class _NoHandshakeNoise(logging.Filter):
    """Drop what every port scan and every refused request would print; real failures of a handler pass.

    A client that leaves in the middle of a request trips an assertion of websockets: that is no failure of ours either.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        left = text == "unexpected internal error" and record.exc_info and record.exc_info[0] is AssertionError
        return not left and "handshake" not in text and "connection rejected" not in text


def start_viser(
    host: str,
    port: int,
    *,
    wrap_request: Callable[[Any], ProcessRequest],
    wrap_handler: Callable[[SocketHandler], SocketHandler],
) -> "viser.ViserServer":
    """Start viser with our request processing in front of its own.

    Args:
        host: address to bind.
        port: first port to try; viser takes the next free one. 0 takes any.
        wrap_request: given viser's `process_request`, returns the one to use.
        wrap_handler: given viser's WebSocket handler, returns the one to use.

    Raises:
        RuntimeError: viser did not start its server by `websockets.asyncio.server.serve`.
    """
    import viser
    from viser import _messages

    original, hooked = websocket_server.serve, threading.Event()

    def serve(handler: SocketHandler, *args: Any, **kwargs: Any) -> Any:
        hooked.set()
        logger = logging.getLogger("cocalib.port")
        if not logger.filters:
            logger.addFilter(_NoHandshakeNoise())
        kwargs["process_request"] = wrap_request(kwargs.get("process_request"))
        kwargs["logger"] = logger
        return original(wrap_handler(handler), *args, **kwargs)

    with _one_at_a_time, contextlib.redirect_stdout(io.StringIO()):  # viser prints an address that lacks the token
        websocket_server.serve = serve  # type: ignore[assignment, misc]
        try:
            server = viser.ViserServer(host=host, port=port, verbose=False)
        finally:
            websocket_server.serve = original  # type: ignore[misc]
    if not hooked.is_set():
        server.stop()
        raise RuntimeError(f"viser {viser.__version__} starts its server in a way this version does not know")
    # Any client could ask viser to open a public tunnel; nobody can here.
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server
