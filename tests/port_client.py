"""A client of the port: GET, the link that gives a cookie, and a page's channel."""

import http.client
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from websockets.sync.client import ClientConnection, connect


class Served(Protocol):
    """A server, in this process or another one."""

    @property
    def port(self) -> int: ...
    @property
    def origin(self) -> str: ...
    @property
    def url(self) -> str: ...


class Answer:
    def __init__(self, response: http.client.HTTPResponse) -> None:
        self.status, self.headers, self.body = response.status, response.headers, response.read()


def get(server: Served, path: str, **headers: str) -> Answer:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = Answer(connection.getresponse())
    connection.close()
    return answer


@contextmanager
def channel(server: Served, cookie: str, path: str = "/ws/tab1") -> Iterator[ClientConnection]:
    address = server.origin.replace("http", "ws") + path
    with connect(address, origin=server.origin, additional_headers={"Cookie": cookie}, max_size=None) as socket:
        yield socket


def come_in(server: Served) -> str:
    """Come in by the link; return the cookie."""
    answer = get(server, server.url.removeprefix(server.origin))
    assert answer.status == 200
    assert answer.headers["Refresh"] == "0; url=/"
    return answer.headers["Set-Cookie"].partition(";")[0]


def wanted(socket: ClientConnection, kind: str) -> Any:
    """Read on until a message of this kind comes."""
    while True:
        message = socket.recv(timeout=20)
        if isinstance(message, str) and json.loads(message)["type"] == kind:
            return json.loads(message)
