"""websockets' `serve` is wrapped only inside the context, and the filter matches its log messages for disconnecting clients."""

import asyncio
import logging
import socket
from collections.abc import Callable

import pytest
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from app.web.port.websockets_hook import SocketHandler, wrapped_serve

CHANGED = (
    "this version of websockets has changed; adapt app/web/port/websockets_hook.py, or lower the upper bound of "
    "websockets in pyproject.toml"
)


async def echo(connection: ServerConnection) -> None:
    async for message in connection:
        await connection.send(message)


async def serve_nobody(_connection: ServerConnection, _request: Request) -> Response | None:
    return None


def kept(handler: SocketHandler) -> SocketHandler:
    return handler


def test_serve_is_wrapped_inside_the_context_and_restored_afterwards() -> None:
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


def scan(port: int) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(b"\x16\x03\x01 no HTTP at all\r\n\r\n")
        while connection.recv(1000):
            pass


def leave(port: int) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")


def ask(port: int) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        while connection.recv(1000):
            pass


@pytest.mark.parametrize("client", [scan, leave, ask])
def test_port_scans_and_disconnecting_clients_are_not_logged(
    client: Callable[[int], None], caplog: pytest.LogCaptureFixture
) -> None:
    assert [text for text in behaviour(client, caplog) if "listening" not in text] in (
        [],
        ["server closing", "server closed"],
    ), CHANGED
