"""The private parts of viser that we use still exist, and a viser without them is refused before anything is served."""

import asyncio
import contextlib
import re
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import msgspec
import pytest
import viser

from cocalib.platform.resources import InstallationError
from cocalib.web.port import viser_hook
from cocalib.web.port.websockets_hook import ProcessRequest, SocketHandler

CHANGED = (
    "this version of viser has changed its private API; adapt app/cocalib/web/port/viser_hook.py, or lower the upper bound "
    "of viser in pyproject.toml"
)


def unwrapped(handler: SocketHandler) -> SocketHandler:
    return handler


def nobody(_files: object) -> ProcessRequest:
    async def refuse(_connection: object, _request: object) -> None:
        return None

    return refuse


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    started = viser_hook.start_viser("127.0.0.1", 0, wrap_request=nobody, wrap_handler=unwrapped)
    yield started
    viser_hook.stop_viser(started)


def test_viser_still_has_the_private_parts_that_are_used(server):
    assert viser_hook.missing_parts(server) == (), CHANGED


def test_nobody_can_ask_viser_for_a_public_tunnel(server):
    handled = {kind.__name__ for kind in server._websock_server._incoming_handlers}
    assert handled.isdisjoint({"ShareUrlRequest", "ShareUrlDisconnect"})
    assert handled != set(), CHANGED


class Spoken:
    """A connection that says what a test gives it."""

    subprotocol = "viser"

    def __init__(self, *messages: object) -> None:
        self._messages = list(messages)

    async def recv(self) -> object:
        if not self._messages:
            raise EOFError
        return self._messages.pop(0)


def heard(*messages: object) -> list[bytes]:
    """Return what viser would receive of these messages."""

    async def run() -> list[bytes]:
        connection, received = viser_hook.only_allowed(Spoken(*messages)), []
        assert connection.subprotocol == "viser"
        with contextlib.suppress(EOFError):
            while True:
                received.append(await connection.recv())
        return received

    return asyncio.run(run())


CAMERA = msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "fov": 1.0})


def test_only_the_camera_of_the_3d_view_is_heard():
    from viser import _messages

    known = _messages.Message._subclass_from_type_string()
    assert "ViewerCameraMessage" in known, CHANGED
    assert len(known) > 50, CHANGED
    others = [msgspec.msgpack.encode({"type": name}) for name in known if name != "ViewerCameraMessage"]
    assert heard(*others, CAMERA) == [CAMERA]


@pytest.mark.parametrize(
    "message",
    [
        msgspec.msgpack.encode({"type": "BrandNewMessage", "run": "this"}),
        msgspec.msgpack.encode({"no": "type"}),
        msgspec.msgpack.encode({"type": ["ViewerCameraMessage"]}),
        msgspec.msgpack.encode(["ViewerCameraMessage"]),
        msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": [0.0] * 5000}),
        b"\x81" * 4000,
        b"\xff\x00",
        b"",
        "text",
    ],
    ids=["unknown", "untyped", "list type", "list", "huge", "deep", "damaged", "empty", "text"],
)
def test_a_message_that_a_newer_viser_may_understand_is_dropped(message):
    assert heard(message, CAMERA, message) == [CAMERA]


def test_a_client_that_has_left_has_no_address(server):
    assert viser_hook.path_of_client(server, 7) == ""


def test_visers_page_runs_our_script_first_and_hides_its_panels():
    page = viser_hook.client_page("../../space/pace.js").decode()
    head, _, rest = page.partition("</head>")
    scripts = re.findall(r"<script[^>]*>", page)
    assert scripts[0] == '<script src="../../space/pace.js">'
    assert len(scripts) > 1, CHANGED
    assert "mantine-Paper-root" in head, CHANGED
    assert "<body" in rest, CHANGED


def test_a_viser_that_starts_its_server_in_another_way_is_stopped_and_named(monkeypatch):
    stopped = []
    monkeypatch.setattr(viser, "ViserServer", lambda **_: SimpleNamespace(stop=lambda: stopped.append(True)))
    with pytest.raises(InstallationError, match=rf"viser {viser.__version__} cannot be used: it does not start"):
        viser_hook.start_viser("127.0.0.1", 0, wrap_request=nobody, wrap_handler=unwrapped)
    assert stopped


def test_a_viser_without_a_part_is_stopped_and_the_part_is_named(monkeypatch, capsys):
    started: list[viser.ViserServer] = []
    stop: Callable[[viser.ViserServer], None] = viser_hook.stop_viser
    monkeypatch.setattr(viser_hook, "stop_viser", lambda server: (started.append(server), stop(server)))
    monkeypatch.setattr(viser_hook, "_TUNNEL_MESSAGES", ("ShareUrlRequest", "ShareEverything"))
    with pytest.raises(InstallationError, match=r"it has no viser\._messages\.ShareEverything; reinstall cocalib"):
        viser_hook.start_viser("127.0.0.1", 0, wrap_request=nobody, wrap_handler=unwrapped)
    assert len(started) == 1
    assert capsys.readouterr().out == ""
