"""The server: every request passes the guard, then goes to our page, our channel, or viser's 3D view."""

import asyncio
import contextlib
import logging
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import websockets
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from calib_core.recordings import EncodedImage, Recording
from cocalib.platform.error_boundary import error_boundary
from cocalib.platform.resources import site_folder, static_folder
from cocalib.web.channel.channel import Channel, Socket
from cocalib.web.channel.hub import Hub
from cocalib.web.channel.opening_service import OpeningService
from cocalib.web.messages.opening_messages import OpeningChoices
from cocalib.web.messages.outgoing import Opening
from cocalib.web.port import guard
from cocalib.web.port.entrance import Entrance
from cocalib.web.port.link import Link, ServerOptions
from cocalib.web.port.resumption import Resumption
from cocalib.web.port.routes import Reply, Routes, refusal
from cocalib.web.port.viser_hook import only_allowed, path_of_client, start_viser, stop_viser
from cocalib.web.port.waiting import WaitingRoom
from cocalib.web.port.websockets_hook import ProcessRequest, SocketHandler, head_of
from cocalib.web.view3d.scene import FIELD_OF_VIEW_RAD, LOOK_AT, STAND_AT, TabScene
from cocalib.workspace import Workspace

if TYPE_CHECKING:
    import viser

_AGAIN = 1012
"""The WebSocket's close code for a service that restarts."""
_log = logging.getLogger(__name__)


class RunningServer:
    """A running server; `close` stops it. Pages can connect at once; they wait until a recording is admitted."""

    def __init__(self, link: Link, room: WaitingRoom, opening_service: OpeningService | None = None) -> None:
        options, self._link = link.options, link
        self._opening_service = opening_service
        self._executor = _frame_threads()
        self._openings = 0
        self._pages: set[ServerConnection] = set()
        self._room = room
        self._routes = Routes(static_folder(), site_folder())
        self._entrance = Entrance(
            link.admissions, link.guard, self._routes, Resumption(options.session), link.direct_origin
        )
        self._entrance.on_admitted = link.used
        self._hub: Hub | None = None
        self._is_closed = False
        self._channels: dict[str, Channel] = {}
        self._scenes: dict[str, tuple[int, TabScene]] = {}
        self._viser = start_viser(
            options.host,
            options.port,
            wrap_request=self._wrap_request,
            wrap_handler=self._wrap_handler,
            listening=link.listening,
        )
        if not link.is_bound:
            link.port = self._viser.get_port()
        self._viser.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self._viser.initial_camera.position, self._viser.initial_camera.look_at = STAND_AT, LOOK_AT
        self._viser.initial_camera.fov = FIELD_OF_VIEW_RAD
        self._viser.on_client_connect(self._view_opened)
        self._viser.on_client_disconnect(self._view_closed)

    def admit(self, workspace: Workspace, recording: Recording) -> None:
        """Serve this recording from now on, also to the pages that are waiting."""
        self._openings += 1
        hub = Hub(
            workspace,
            recording,
            self._executor,
            opening_service=self._opening_service,
            opening=self._openings,
            proposes=self._link.options.proposes,
        )

        async def open_up() -> None:
            await hub.start()
            self._hub = hub
            self._routes.admit(workspace, recording, hub)
            self._room.end()

        self._on_loop(open_up())

    def withdraw(self, opening: Opening) -> None:
        """Stop serving the recording, and return once nothing reads it any more; its pages connect again and wait."""
        hub, executor = self._hub, self._executor
        if hub is None:
            return

        async def turn_out() -> None:
            self._hub = None
            self._routes.withdraw()
            self._room = WaitingRoom(opening, self._opening_service)
            await hub.end()
            await asyncio.gather(*(page.close(_AGAIN, "another recording is being opened") for page in [*self._pages]))

        self._on_loop(turn_out())
        hub.steps.shutdown(wait=True, cancel_futures=True)
        executor.shutdown(wait=True, cancel_futures=True)
        self._executor = _frame_threads()

    def start_over(self, opening: Opening) -> None:
        """Tell the pages that wait that another recording is being opened."""
        self._viser.get_event_loop().call_soon_threadsafe(self._room.start_over, opening)

    def ask(self, choices: OpeningChoices) -> None:
        """Ask the pages that wait which recording to open, or how."""
        self._viser.get_event_loop().call_soon_threadsafe(self._room.ask, choices)

    def _on_loop(self, work: Coroutine[Any, Any, None]) -> None:
        """Run on the event loop, and wait until it is done."""
        asyncio.run_coroutine_threadsafe(work, self._viser.get_event_loop()).result()

    def show(self, image: EncodedImage) -> None:
        """Show an image of the recording on the pages that are waiting for it.

        Raises:
            RuntimeError: the server has stopped.
        """
        self._viser.get_event_loop().call_soon_threadsafe(self._room.show, image)

    def tell(self, opening: Opening) -> None:
        """Tell the pages that are waiting what is being done."""
        self._viser.get_event_loop().call_soon_threadsafe(self._room.tell, opening)

    def refuse(self, problem: str) -> None:
        """Tell the waiting pages why the recording cannot be opened; do nothing if it was admitted or the server is closed."""
        if self._hub is None and not self._is_closed:
            self._on_loop(self._room.refuse(problem))

    @property
    def port(self) -> int:
        """The bound port; with a Unix socket, the port to forward to it."""
        return self._link.port

    @property
    def origin(self) -> str:
        """The address without a token."""
        return self._link.origin

    @property
    def url(self) -> str:
        """The link that opens the page; it works once unless the user chose the token."""
        return self._link.url

    def close(self) -> None:
        """Stop serving; the workspace and the recording stay open. Safe to call twice."""
        if self._is_closed:
            return
        self._is_closed = True
        if self._hub is not None:
            self._on_loop(self._hub.end())
            self._hub.steps.shutdown(wait=True, cancel_futures=True)
            self._routes.withdraw()
        stop_viser(self._viser)
        self._link.close()
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _wrap_request(self, _viser_files: object) -> ProcessRequest:
        """Send every request through the guard; viser's own file server is not used."""

        async def process(connection: ServerConnection, request: Request) -> Response | None:
            head = head_of(connection)
            if head.fault is not None:
                return _response(refusal(head.fault, "This request cannot be understood."))
            reply = await self._entrance.answer(_asked(request, head.method))
            return None if reply is None else _response(reply)

        return process

    def _wrap_handler(self, viser_handler: SocketHandler) -> SocketHandler:
        async def handle(connection: ServerConnection) -> None:
            assert connection.request is not None
            path = connection.request.path
            cookie = self._entrance.entered(_asked(connection.request))
            try:
                with error_boundary("a page's connection", _log.error):
                    if not path.startswith("/ws/"):
                        await viser_handler(only_allowed(connection))
                        return
                    with contextlib.suppress(websockets.ConnectionClosed, BufferError):
                        await self._run_channel(connection, path.removeprefix("/ws/"))
            finally:
                self._entrance.left(cookie)

        return handle

    async def _run_channel(self, connection: ServerConnection, tab: str) -> None:
        self._pages.add(connection)
        try:
            await self._talk(connection, tab)
        finally:
            self._pages.discard(connection)

    async def _talk(self, connection: ServerConnection, tab: str) -> None:
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
        address = path_of_client(self._viser, client.client_id)
        tab = address.partition("?")[0].rstrip("/").rpartition("/")[2]
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
    server = RunningServer(Link(options), WaitingRoom())
    server.admit(workspace, recording)
    return server


def _frame_threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=3, thread_name_prefix="frames")


def _asked(request: Request, method: str = "GET") -> guard.Request:
    headers = {name.lower(): request.headers.get_all(name) for name in request.headers}
    return guard.Request(request.path, headers, method)


def _response(reply: Reply) -> Response:
    headers = Headers([*reply.headers, ("Content-Length", str(reply.length)), ("Connection", "close")])
    return Response(reply.status.value, reply.status.phrase, headers, reply.body)
