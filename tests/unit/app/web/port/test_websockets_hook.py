"""websockets' `serve` is wrapped only inside the context, and the filter matches its log messages for disconnecting clients."""

import asyncio
import contextlib
import logging
import socket
import subprocess
import sys
from collections.abc import Callable

import pytest
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from cocalib.web.port import websockets_hook
from cocalib.web.port.websockets_hook import SocketHandler, wrapped_serve

CHANGED = (
    "this version of websockets has changed; adapt app/cocalib/web/port/websockets_hook.py, or lower the upper bound of "
    "websockets in pyproject.toml"
)


async def echo(connection: ServerConnection) -> None:
    async for message in connection:
        await connection.send(message)


async def serve_nobody(_connection: ServerConnection, _request: Request) -> Response | None:
    return None


def kept(handler: SocketHandler) -> SocketHandler:
    return handler


def test_serve_is_wrapped_inside_the_context_and_restored_afterwards():
    original = websocket_server.serve
    with wrapped_serve(lambda _given: serve_nobody, kept) as used:
        assert websocket_server.serve is not original
        assert not used.is_set()
    assert websocket_server.serve is original
    with pytest.raises(ZeroDivisionError), wrapped_serve(lambda _given: serve_nobody, kept):
        raise ZeroDivisionError
    assert websocket_server.serve is original


def behaviour(client: Callable[[int], None], caplog: pytest.LogCaptureFixture) -> list[str]:
    """Serve, let a client misbehave, and return the log messages."""

    async def main() -> None:
        with wrapped_serve(lambda _given: serve_nobody, kept) as used:
            async with websocket_server.serve(echo, "127.0.0.1", 0) as running:
                assert used.is_set()
                port = next(iter(running.sockets)).getsockname()[1]
                await asyncio.to_thread(client, port)

    with caplog.at_level(logging.INFO):
        asyncio.run(main())
    return [record.getMessage() for record in caplog.records if record.name.startswith(("cocalib", "websockets"))]


def sent(port: int, text: bytes, *, to_the_end: bool = True, half_closed: bool = False) -> bytes:
    """Send a request, and read the whole answer unless the client leaves before it."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(text)
        if half_closed:
            connection.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: connection.recv(1000), b"")) if to_the_end else b""


def scan(port: int) -> None:
    sent(port, b"\x16\x03\x01 no HTTP at all\r\n\r\n")


def leave(port: int) -> None:
    sent(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n", to_the_end=False)


def ask_and_send_no_more(port: int) -> None:
    assert sent(port, ASKED, half_closed=True).startswith(b"HTTP/1.1 426")


ASKED = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


def ask(port: int) -> None:
    sent(port, ASKED)


@pytest.mark.parametrize("client", [scan, leave, ask])
def test_port_scans_and_disconnecting_clients_are_not_logged(client, caplog):
    assert [text for text in behaviour(client, caplog) if "listening" not in text] in (
        [],
        ["server closing", "server closed"],
    ), CHANGED


def crowd(port: int) -> None:
    """Open more connections than may be waiting, then ask; the first ones have been closed."""
    idle = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(140)]
    try:
        ask(port)
        with contextlib.suppress(ConnectionResetError):
            assert idle[0].recv(1) == b""
        idle[-1].setblocking(False)
        with pytest.raises(BlockingIOError):
            idle[-1].recv(1)
    finally:
        for connection in idle:
            connection.close()


def test_connections_that_ask_nothing_make_room_for_others(caplog):
    behaviour(crowd, caplog)


SHORT_OF_FILES = """
import asyncio, resource, sys
from websockets.asyncio import server
from tests.unit.app.web.port.test_websockets_hook import echo, kept, serve_nobody
from cocalib.web.port.websockets_hook import wrapped_serve

async def main():
    with wrapped_serve(lambda _given: serve_nobody, kept):
        async with server.serve(echo, "127.0.0.1", 0) as running:
            resource.setrlimit(resource.RLIMIT_NOFILE, (60, 60))
            print(next(iter(running.sockets)).getsockname()[1], flush=True)
            await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)

asyncio.run(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX limits")
def test_a_server_without_free_descriptors_says_so_once_and_recovers():
    process = subprocess.Popen(
        [sys.executable, "-c", SHORT_OF_FILES], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    assert process.stdin is not None and process.stdout is not None and process.stderr is not None  # noqa: PT018
    port = int(process.stdout.readline())
    idle = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(100)]
    complaint = process.stderr.readline()
    assert "no connection can" in complaint
    for connection in idle:
        connection.close()
    ask(port)
    _, others = process.communicate("", timeout=30)
    assert others == "", "said once"


def test_what_the_event_loop_reports_is_one_line_with_a_report(caplog, tmp_path):
    complaints = websockets_hook._Complaints()
    loop = asyncio.new_event_loop()
    for _ in range(6200):
        complaints.handle(
            loop, {"message": "socket.accept() out of system resource", "exception": OSError(24, "Too many")}
        )
    complaints.handle(loop, {"message": "a callback failed", "exception": LookupError("of ours")})
    complaints.handle(loop, {"message": "something else"})
    loop.close()
    first, second, third = (record.getMessage() for record in caplog.records)
    assert "Too many" in first
    assert "(LookupError: of ours)" in second
    assert third == "something else"


@pytest.mark.parametrize("client", [scan, ask_and_send_no_more])
def test_a_connection_ends_with_its_answer_and_not_when_time_is_up(client):
    async def main() -> None:
        with wrapped_serve(lambda _given: serve_nobody, kept):
            async with websocket_server.serve(echo, "127.0.0.1", 0, close_timeout=600) as running:
                await asyncio.to_thread(client, next(iter(running.sockets)).getsockname()[1])
                async with asyncio.timeout(60):
                    while running.handlers:
                        await asyncio.sleep(0)

    asyncio.run(main())
