"""The server: every request passes the guard, then goes to our page, our channel, or viser's 3D view."""

import asyncio
import contextlib
import os
import secrets
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import quote

import websockets
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.resources import state_folder, static_folder
from app.web.channel.channel import Channel, Socket
from app.web.channel.hub import Hub
from app.web.messages import Opening
from app.web.port import guard
from app.web.port.routes import Reply, Routes, refusal
from app.web.port.viser_hook import path_of_client, start_viser, stop_viser
from app.web.port.waiting import WaitingRoom
from app.web.port.websockets_hook import ProcessRequest, SocketHandler
from app.web.view3d.scene import FIELD_OF_VIEW_RAD, LOOK_AT, STAND_AT, TabScene
from app.workspace import Workspace
from calib_core.recordings import EncodedImage, Recording

if TYPE_CHECKING:
    import viser

__all__ = ["RunningServer", "ServerOptions", "start"]


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """Where the page is served, and who has access.

    Attributes:
        host: address to bind.
        port: first port to try, then the next free one; 0 for any free port.
        token: token that the link must contain; None generates one-time tokens.
        no_browser: print the link, do not open a browser.
        more_hosts: further host names that requests may use.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = None
    no_browser: bool = False
    more_hosts: tuple[str, ...] = ()


class RunningServer:
    """A running server; `close` stops it. Pages can connect at once; they wait until a recording is admitted."""

    def __init__(self, options: ServerOptions, room: WaitingRoom) -> None:
        self._options = options
        self._guard = guard.Guard(
            host=options.host, key=_cookie_key(), token=options.token, more_hosts=options.more_hosts
        )
        self._executor = ThreadPoolExecutor(max_workers=3, thread_name_prefix="frames")
        self._room = room
        self._routes = Routes(static_folder())
        self._hub: Hub | None = None
        self._is_closed = False
        self._channels: dict[str, Channel] = {}
        self._scenes: dict[str, tuple[int, TabScene]] = {}
        self.on_new_link: Callable[[], None] = lambda: None
        self._viser = start_viser(
            options.host, options.port, wrap_request=self._wrap_request, wrap_handler=self._wrap_handler
        )
        self._viser.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self._viser.initial_camera.position, self._viser.initial_camera.look_at = STAND_AT, LOOK_AT
        self._viser.initial_camera.fov = FIELD_OF_VIEW_RAD
        self._viser.on_client_connect(self._view_opened)
        self._viser.on_client_disconnect(self._view_closed)

    def admit(self, workspace: Workspace, recording: Recording) -> None:
        """Serve this recording from now on, also to the pages that are waiting."""
        hub = Hub(workspace, recording, self._executor)

        async def open_up() -> None:
            await hub.start()
            self._hub = hub
            self._routes.admit(workspace, recording, hub)
            self._room.end()

        asyncio.run_coroutine_threadsafe(open_up(), self._viser.get_event_loop()).result()

    def show(self, picture: EncodedImage) -> None:
        """Show a picture of the recording on the pages that are waiting for it.

        Raises:
            RuntimeError: the server has stopped.
        """
        self._viser.get_event_loop().call_soon_threadsafe(self._room.show, picture)

    def tell(self, opening: Opening) -> None:
        """Tell the pages that are waiting what is being done."""
        self._viser.get_event_loop().call_soon_threadsafe(self._room.tell, opening)

    def refuse(self, problem: str) -> None:
        """Tell the waiting pages why the recording cannot be opened; do nothing if it was admitted or the server is closed."""
        if self._hub is None and not self._is_closed:
            asyncio.run_coroutine_threadsafe(self._room.refuse(problem), self._viser.get_event_loop()).result()

    @property
    def port(self) -> int:
        """The bound port."""
        return self._viser.get_port()

    @property
    def origin(self) -> str:
        """The address without a token."""
        host = self._options.host
        shown = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
        return f"http://{shown}:{self.port}"

    @property
    def url(self) -> str:
        """The link that opens the page; it works once unless the user chose the token."""
        return f"{self.origin}/?token={quote(self._guard.token)}"

    def close(self) -> None:
        """Stop serving; the workspace and the recording stay open. Safe to call twice."""
        if self._is_closed:
            return
        self._is_closed = True
        if self._hub is not None:
            asyncio.run_coroutine_threadsafe(self._hub.end(), self._viser.get_event_loop()).result()
            self._hub.steps.shutdown(wait=True, cancel_futures=True)
        stop_viser(self._viser)
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _wrap_request(self, _viser_files: object) -> ProcessRequest:
        """Send every request through the guard; viser's own file server is not used."""

        async def process(_connection: ServerConnection, request: Request) -> Response | None:
            asked = guard.Request(request.path, _all_headers(request.headers))
            link = self._guard.token
            verdict = self._guard.check(asked)
            if isinstance(verdict, guard.Refused):
                return _response(refusal(verdict.status, verdict.reason))
            if isinstance(verdict, guard.Admitted):
                if self._guard.token != link:
                    self.on_new_link()
                return _redirect(verdict)
            path = request.path.partition("?")[0]
            if asked.is_websocket:
                known = path.startswith(("/ws/", "/viser/"))
                return None if known else _response(refusal(404, "No WebSocket at this address."))
            return _response(await self._routes.answer(request.path))

        return process

    def _wrap_handler(self, viser_handler: SocketHandler) -> SocketHandler:
        async def handle(connection: ServerConnection) -> None:
            path = connection.request.path if connection.request else ""
            if not path.startswith("/ws/"):
                await viser_handler(connection)
                return
            with contextlib.suppress(websockets.ConnectionClosed, BufferError):
                await self._run_channel(connection, path.removeprefix("/ws/"))

        return handle

    async def _run_channel(self, connection: ServerConnection, tab: str) -> None:
        socket: Socket = connection if self._hub else await self._room.stay(connection)
        if self._hub is None:
            return
        channel = Channel(self._hub)
        self._channels[tab] = channel
        if tab in self._scenes:
            channel.scene = self._scenes[tab][1]
        try:
            await channel.run(socket)
        finally:
            if self._channels.get(tab) is channel:
                del self._channels[tab]

    async def _view_opened(self, client: "viser.ClientHandle") -> None:
        """Connect a new 3D view to the page that contains it."""
        tab = _tab_of(self._viser, client.client_id)
        scene = TabScene(client)
        self._scenes[tab] = (client.client_id, scene)
        channel = self._channels.get(tab)
        if channel is not None:
            channel.scene = scene
            channel.refresh()

    async def _view_closed(self, client: "viser.ClientHandle") -> None:
        for tab, (client_id, _) in list(self._scenes.items()):
            if client_id == client.client_id:
                del self._scenes[tab]
                if tab in self._channels:
                    self._channels[tab].scene = None


def start(workspace: Workspace, recording: Recording, options: ServerOptions) -> RunningServer:
    """Start serving a recording; return once the port accepts connections."""
    server = RunningServer(options, WaitingRoom())
    server.admit(workspace, recording)
    return server


def _all_headers(headers: Headers) -> dict[str, list[str]]:
    return {name.lower(): headers.get_all(name) for name in headers}


def _response(reply: Reply) -> Response:
    headers = Headers([*reply.headers, ("Content-Length", str(len(reply.body))), ("Connection", "close")])
    return Response(reply.status.value, reply.status.phrase, headers, reply.body)


def _redirect(admitted: guard.Admitted) -> Response:
    location = admitted.location if admitted.location.startswith("/") and admitted.location[:2] != "//" else "/"
    return Response(303, "See Other", Headers([("Location", location), ("Set-Cookie", admitted.set_cookie),
                    ("Content-Length", "0"), ("Referrer-Policy", "no-referrer"), ("Connection", "close")]), b"")  # fmt: skip


def _tab_of(server: "viser.ViserServer", client_id: int) -> str:
    """Return the name of the tab that a 3D view belongs to: the last part of its address."""
    return path_of_client(server, client_id).partition("?")[0].rstrip("/").rpartition("/")[2]


def _cookie_key() -> bytes:
    """Return the secret for the cookies, stored in the user's state folder so that pages stay admitted after a restart."""
    path = state_folder() / "cookie.key"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
            with os.fdopen(descriptor, "wb") as file:
                file.write(secrets.token_bytes(32))
        key = path.read_bytes()
    except OSError:
        key = b""
    return key if len(key) == 32 else secrets.token_bytes(32)
