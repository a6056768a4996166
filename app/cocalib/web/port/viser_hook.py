"""All use of viser's private API: its server on our port, its connections, and its own page.

viser has no public API to add routes, to disable public tunnels, or to find out which page a client belongs to.
`missing_parts` names what a new viser lacks; in that case nothing is served, because the port would be unguarded.
tests/unit/app/web/port/test_viser_hook.py and test_server.py test these parts.
"""

import contextlib
import io
import socket
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import msgspec
from websockets.asyncio.server import ServerConnection

from cocalib.platform.resources import InstallationError
from cocalib.web.port.websockets_hook import ProcessRequest, SocketHandler, wrapped_serve

if TYPE_CHECKING:
    import viser

_ALLOWED_MESSAGES = ("ViewerCameraMessage",)
"""What our page's 3D view sends: where its camera is. It has no controls, no clicks and no uploads."""
_MAX_MESSAGE_BYTES = 4096
_TUNNEL_MESSAGES = ("ShareUrlRequest", "ShareUrlDisconnect")
_STYLE = """<style>
.mantine-Notifications-root, .mantine-Paper-root, [data-portal], [data-dock-root] > :not(:first-child) {
  display: none !important;
}
html, body, #root, #root div { background-color: transparent !important; }
html { background: #0d1014 !important; }
html[data-theme="light"] { background: #e4e8ed !important; }
</style>
</head>"""


class _Typed(msgspec.Struct):
    """A message of viser, of which only the type is read here."""

    type: str


def start_viser(
    host: str,
    port: int,
    *,
    wrap_request: Callable[[Any], ProcessRequest],
    wrap_handler: Callable[[SocketHandler], SocketHandler],
    listening: socket.socket | None = None,
) -> "viser.ViserServer":
    """Start viser with our request processing wrapped around its own.

    Args:
        host: address to bind.
        port: first port to try; viser takes the next free one. 0 for any free port.
        wrap_request: given viser's `process_request`, returns the one to use.
        wrap_handler: given viser's WebSocket handler, returns the one to use.
        listening: a socket to serve on instead of the address and port.

    Raises:
        InstallationError: this version of viser starts its server differently, or lacks a required part.
    """
    import viser

    with (
        wrapped_serve(wrap_request, wrap_handler, listening) as used,
        contextlib.redirect_stdout(io.StringIO()),  # viser prints an address without the token
    ):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if not used.is_set():
        stop_viser(server)
        raise _unknown_viser("it does not start its server with websockets.asyncio.server.serve")
    if missing := missing_parts(server):
        stop_viser(server)
        raise _unknown_viser(f"it has no {', '.join(missing)}")
    # In viser, any client can request a public tunnel; the allow-list drops the request, and nothing handles it.
    for name in _TUNNEL_MESSAGES:
        server._websock_server.unregister_handler(getattr(viser._messages, name))
    return server


def stop_viser(server: "viser.ViserServer") -> None:
    """Stop a viser server without its printed message."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


class _Filtered:
    """A connection that receives the messages of the allow-list only; everything else is as in the connection."""

    def __init__(self, connection: ServerConnection) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    async def recv(self) -> bytes:
        while True:
            message = await self._connection.recv()
            if isinstance(message, bytes) and _is_allowed(message):
                return message


def only_allowed(connection: ServerConnection) -> ServerConnection:
    """Return the connection with every message dropped that our 3D view does not need, also those of a newer viser."""
    return cast(ServerConnection, _Filtered(connection))


def _is_allowed(message: bytes) -> bool:
    if len(message) > _MAX_MESSAGE_BYTES:
        return False
    try:
        return msgspec.msgpack.decode(message, type=_Typed).type in _ALLOWED_MESSAGES
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False


def path_of_client(server: "viser.ViserServer", client_id: int) -> str:
    """Return the path and query of a client's connection; "" if it has disconnected."""
    connection = server._websock_server._live_connections.get(client_id)
    return connection.request.path if connection is not None and connection.request is not None else ""


def client_page(script: str) -> bytes:
    """Return viser's own page with its panels hidden: our page has its own.

    Args:
        script: address of our script that runs before viser's.
    """
    page = _client_file().read_bytes()
    page = page.replace(b"<head>", f'<head><script src="{script}"></script>'.encode(), 1)
    return page.replace(b"</head>", _STYLE.encode(), 1)


def missing_parts(server: "viser.ViserServer") -> tuple[str, ...]:
    """Return the private parts of viser used here that the installed version lacks."""
    from viser import _messages

    sockets = getattr(server, "_websock_server", None)
    parts = {
        **{f"viser._messages.{name}": hasattr(_messages, name) for name in (*_TUNNEL_MESSAGES, *_ALLOWED_MESSAGES)},
        "ViserServer._websock_server": sockets is not None,
        "ViserServer._websock_server.unregister_handler": hasattr(sockets, "unregister_handler"),
        "ViserServer._websock_server._live_connections": hasattr(sockets, "_live_connections"),
        "viser/client/build/index.html": _client_file().is_file(),
    }
    return tuple(name for name, found in parts.items() if not found)


def _client_file() -> Path:
    import viser

    return Path(viser.__file__).parent / "client" / "build" / "index.html"


def _unknown_viser(what: str) -> InstallationError:
    import viser

    return InstallationError(
        f"viser {viser.__version__} cannot be used: {what}; reinstall cocalib, with the viser version that it requires"
    )
