"""The link is valid before the server answers: who uses it early waits, and is then checked like anyone else."""

import re
import socket
from collections.abc import Iterator

import pytest

from cocalib.web.port.address import AddressError, listening_at
from cocalib.web.port.link import Link, ServerOptions
from cocalib.web.port.server import RunningServer
from cocalib.web.port.waiting import WaitingRoom
from tests.port_client import come_in, get


@pytest.fixture
def link() -> Iterator[Link]:
    made = Link(ServerOptions(port=0, no_browser=True))
    yield made
    made.close()


def test_a_printed_link_can_be_used_before_the_server_runs(link, capsys):
    link.announce()
    first = link.url
    assert capsys.readouterr().out == f"Open {first}\n"
    early = socket.create_connection(("127.0.0.1", link.port), timeout=20)
    early.sendall(f"GET /?{first.partition('?')[2]} HTTP/1.1\r\nHost: 127.0.0.1:{link.port}\r\n\r\n".encode())
    server = RunningServer(link, WaitingRoom())
    with early:
        answer = b""
        while chunk := early.recv(65536):
            answer += chunk
    assert answer.startswith(b"HTTP/1.1 200")
    assert b"\r\nSet-Cookie: " in answer
    link.announce()
    assert server.url != first
    assert capsys.readouterr().out == f"For another browser, open {server.url}\n"
    server.close()


@pytest.mark.parametrize(("host", "status"), [("127.0.0.1", b"401"), ("evil.example", b"421")])
def test_who_came_early_without_the_token_is_refused(host, status, link):
    with socket.create_connection(("127.0.0.1", link.port), timeout=20) as early:
        early.sendall(f"GET / HTTP/1.1\r\nHost: {host}:{link.port}\r\n\r\n".encode())
        server = RunningServer(link, WaitingRoom())
        assert early.recv(65536).split(b" ")[1] == status
    server.close()


def test_a_taken_port_is_followed_by_the_next_free_one_if_there_is_one(link, capsys):
    second = Link(ServerOptions(port=link.port, no_browser=True))
    second.announce()
    assert second.port > link.port
    first_line = capsys.readouterr().out.splitlines()[0]
    assert [int(number) for number in re.findall(r"\d+", first_line)] == [link.port, second.port]
    second.close()
    with listening_at("127.0.0.1", 65535), pytest.raises(AddressError, match="--port 65535: neither this port"):
        listening_at("127.0.0.1", 65535)


def test_a_host_name_is_bound_by_the_server_to_all_of_its_addresses():
    named = Link(ServerOptions(host="localhost", port=0))
    assert not named.is_bound
    server = RunningServer(named, WaitingRoom())
    assert server.port > 0
    assert get(server, "/", Cookie=come_in(server)).status == 200
    server.close()


def test_closing_the_link_frees_its_port(link):
    link.close()
    link.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", link.port), timeout=20)
