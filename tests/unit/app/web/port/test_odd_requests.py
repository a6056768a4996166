"""Requests that no browser sends: each gets the right status, and none an internal error."""

import socket
import sys
from collections.abc import Generator, Iterator

import pytest
import websockets.http11
from hypothesis import example, given
from hypothesis import strategies as st

from cocalib.web.port.server import RunningServer
from cocalib.web.port.websockets_hook import read_head
from tests.image_recording import ImageRecording, grey_images
from tests.port_client import come_in
from tests.serving import serving

HOST = b"Host: 127.0.0.1\r\n"
UPGRADE = (
    b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nOrigin: http://127.0.0.1\r\n"
)


def lines(*headers: bytes, first: bytes = b"GET / HTTP/1.1") -> bytes:
    return b"".join(line + b"\r\n" for line in (first, b"Host: 127.0.0.1", *headers))


UNREADABLE = {
    "no target": (lines(first=b"GET  HTTP/1.1"), 400),
    "no version": (lines(first=b"GET /"), 400),
    "four words": (lines(first=b"GET / x HTTP/1.1"), 400),
    "not ASCII": (lines(first=b"GET /\xc3\xa4 HTTP/1.1"), 400),
    "HTTP/1.0": (lines(first=b"GET / HTTP/1.0"), 505),
    "HTTP/2": (b"PRI * HTTP/2.0\r\n", 505),
    "another protocol": (lines(first=b"GET / RTSP/1.0"), 400),
    "TLS": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 400),
    "a long target": (lines(first=b"GET /" + b"a" * 9000 + b" HTTP/1.1"), 414),
    "a long header": (lines(b"X: " + b"a" * 9000), 431),
    "many headers": (lines(*[b"X: 1"] * 200), 431),
    "endless headers": (lines(*[b"X: 1"] * 20_000), 431),
    "no colon": (lines(b"nonsense"), 400),
    "a folded header": (lines(b"X: 1", b" 2"), 400),
    "a space before the colon": (b"GET / HTTP/1.1\r\nHost : 127.0.0.1\r\n", 400),
    "NUL in a header": (lines(b"X: \x00"), 400),
    "GET with a body": (lines(b"Content-Length: 5"), 400),
    "GET with chunks": (lines(b"Transfer-Encoding: chunked"), 400),
    "a length that is none": (lines(b"Content-Length: many"), 400),
}
"""What is answered whoever asks."""
ODD = {
    "an absolute address": (b"GET http://127.0.0.1/ HTTP/1.1\r\n" + HOST, 401, 400),
    "a foreign absolute address": (b"GET http://evil.example/ HTTP/1.1\r\n" + HOST, 401, 400),
    "a star": (b"OPTIONS * HTTP/1.1\r\n" + HOST, 401, 405),
    "no slash": (b"GET index.html HTTP/1.1\r\n" + HOST, 401, 400),
    "an open bracket": (b"GET //[ HTTP/1.1\r\n" + HOST, 401, 404),
    "a bad bracket": (b"GET http://[::1/ HTTP/1.1\r\n" + HOST, 401, 400),
    "bad escapes": (b"GET /%zz%?token=%zz%e4 HTTP/1.1\r\n" + HOST, 401, 200),
    "an escaped NUL": (b"GET /%00 HTTP/1.1\r\n" + HOST, 401, 404),
    "parents": (b"GET /../../etc/passwd HTTP/1.1\r\n" + HOST, 401, 404),
    "escaped parents": (b"GET /%2e%2e%2f%2e%2e/etc/passwd HTTP/1.1\r\n" + HOST, 401, 404),
    "doubly escaped parents": (b"GET /%252e%252e%252fetc/passwd HTTP/1.1\r\n" + HOST, 401, 404),
    "backslashes": (b"GET /..\\..\\etc\\passwd HTTP/1.1\r\n" + HOST, 401, 404),
    "parents in an export": (b"GET /api/export/../../etc/passwd HTTP/1.1\r\n" + HOST, 401, 404),
    "parents in the 3D view": (b"GET /viser/../x/ HTTP/1.1\r\n" + HOST, 401, 404),
    "a header that is not ASCII": (b"GET / HTTP/1.1\r\n" + HOST + b"X-Name: \xe4\xff\r\n", 401, 200),
    "a cookie that is not ASCII": (b"GET / HTTP/1.1\r\n" + HOST + b"Cookie: cocalib=\xe4\xff\r\n", 401, 200),
    "a token that is not ASCII": (b"GET /?token=%E4%FF%F0%9F HTTP/1.1\r\n" + HOST, 401, 200),
    "two cookie headers": (b"GET / HTTP/1.1\r\n" + HOST + b"Cookie: a=1\r\nCookie: b=2\r\n", 401, 200),
    "a host that is not ASCII": (b"GET / HTTP/1.1\r\nHost: \xe4\r\n", 421, 421),
    "an empty host": (b"GET / HTTP/1.1\r\nHost:\r\n", 421, 421),
    "no host": (b"GET / HTTP/1.1\r\n", 400, 400),
    "two hosts": (b"GET / HTTP/1.1\r\n" + HOST + HOST, 400, 400),
    "another origin": (b"GET / HTTP/1.1\r\n" + HOST + b"Origin: null\r\n", 403, 403),
    "HEAD": (b"HEAD / HTTP/1.1\r\n" + HOST, 401, 200),
    "HEAD of nothing": (b"HEAD /nothing HTTP/1.1\r\n" + HOST, 401, 404),
    "POST": (b"POST /api/clicks.json HTTP/1.1\r\n" + HOST + b"Content-Length: 5\r\n", 401, 405),
    "chunked POST": (b"POST / HTTP/1.1\r\n" + HOST + b"Transfer-Encoding: chunked\r\n", 401, 405),
    "PUT": (b"PUT / HTTP/1.1\r\n" + HOST, 401, 405),
    "DELETE": (b"DELETE / HTTP/1.1\r\n" + HOST, 401, 405),
    "OPTIONS": (b"OPTIONS / HTTP/1.1\r\n" + HOST, 401, 405),
    "TRACE": (b"TRACE / HTTP/1.1\r\n" + HOST, 401, 405),
    "CONNECT": (b"CONNECT evil.example:443 HTTP/1.1\r\n" + HOST, 401, 405),
    "an unknown method": (b"BREW /pot HTTP/1.1\r\n" + HOST, 401, 405),
    "a POST that wants a WebSocket": (b"POST /ws/tab HTTP/1.1\r\n" + HOST + UPGRADE, 401, 405),
    "a WebSocket elsewhere": (b"GET /nothing HTTP/1.1\r\n" + HOST + UPGRADE, 401, 404),
    "a resumption without a proof": (b"GET /api/resume HTTP/1.1\r\n" + HOST, 401, 401),
    "a resumption with nonsense": (
        b"GET /api/resume?ticket=%FF.9&challenge=%E4&proof=%00 HTTP/1.1\r\n" + HOST,
        401,
        401,
    ),
}
"""What is answered to a stranger, and to an admitted browser."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    patch = pytest.MonkeyPatch()
    patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
    recording = ImageRecording(grey_images(1))
    with serving(recording, tmp_path_factory.mktemp("s") / "s", name="one grey") as (running, _):
        yield running
    patch.undo()


def asked(
    server: RunningServer, head: bytes, cookie: str = "", rest: bytes = b"", *, half_closed: bool = False
) -> bytes:
    """Send a request as it is; return everything that is answered until the server closes the connection."""
    sent = head + (f"Cookie: {cookie}\r\n".encode() if cookie else b"") + b"\r\n"
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as connection:
        connection.sendall(sent + rest)
        if half_closed:
            connection.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: connection.recv(65536), b""))


def status(answer: bytes) -> int:
    return int(answer.split(b" ")[1]) if answer else 0


@pytest.mark.parametrize(("head", "wanted"), UNREADABLE.values(), ids=UNREADABLE)
def test_a_request_that_cannot_be_read_is_answered(server, head, wanted):
    assert status(asked(server, head, rest=b"")) == wanted


@pytest.mark.parametrize(("head", "wanted", "_admitted"), ODD.values(), ids=ODD)
def test_an_odd_request_of_a_stranger_is_refused(server, head, wanted, _admitted):
    answer = asked(server, head, rest=b"" if UPGRADE in head else b"hello")
    assert status(answer) == wanted
    assert b"Set-Cookie" not in answer


@pytest.mark.parametrize(("head", "_stranger", "wanted"), ODD.values(), ids=ODD)
def test_an_odd_request_of_an_admitted_browser_gets_its_status(server, head, _stranger, wanted, cookie):
    answer = asked(server, head, cookie, b"" if UPGRADE in head else b"hello")
    assert status(answer) == wanted
    assert b"Location" not in answer
    assert (b"Allow: GET, HEAD" in answer) == (wanted == 405)
    if head.startswith(b"HEAD"):
        assert answer.endswith(b"\r\n\r\n"), "no body"
        assert b"Content-Length: 0" not in answer, "but its length"


@pytest.fixture(scope="module")
def cookie(server: RunningServer) -> str:
    return come_in(server)


def test_a_cookie_of_an_admitted_browser_is_renewed_by_each_answer(server, cookie):
    answer = asked(server, b"GET /page/main.js HTTP/1.1\r\n" + HOST, cookie)
    assert f"Set-Cookie: {cookie}; Max-Age=".encode() in answer


@pytest.mark.parametrize("method", [b"GET", b"HEAD", b"POST"])
def test_a_client_that_sends_no_more_is_still_answered_without_versions(server, cookie, method):
    head = method + b" / HTTP/1.1\r\n" + HOST
    for cookies, wanted in (("", 401), (cookie, 405 if method == b"POST" else 200)):
        answer = asked(server, head, cookies, half_closed=True)
        assert status(answer) == wanted
        assert b"websockets" not in answer


@pytest.mark.parametrize("cut", [1, 3, 14, 15, 16, 40])
def test_a_head_may_arrive_in_any_pieces(cut):
    whole = b"HEAD /a HTTP/1.1\r\n" + HOST + b"Content-Length: 3\r\n\r\nabc"
    for end in range(0, whole.index(b"\r\n\r\n") + 4, cut):
        assert read_head(whole[:end]) is None
    head = read_head(whole)
    assert (head.method, head.fault) == ("HEAD", None)
    assert head.data == b"GET /a HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


def test_what_follows_a_websockets_head_reaches_it():
    head = read_head(b"GET /ws/t HTTP/1.1\r\n" + HOST + UPGRADE + b"\r\n\x81\x00")
    assert head.data.endswith(b"\r\n\r\n\x81\x00")


@pytest.mark.skipif(sys.platform == "win32", reason="no parents to reach")
def test_no_answer_ever_holds_a_file_from_elsewhere(server, cookie, project_root):
    secret = (project_root / "pyproject.toml").read_bytes()[:40]
    for dots in (b"..", b"%2e%2e", b"%2E.", b"%252e%252e", b"..%00", b"%c0%ae%c0%ae", b"..;", b"...", b"..%5c"):
        for slash in (b"/", b"%2f", b"%5c", b"\\", b"//"):
            for start_at in (b"/", b"/static/", b"/viser/a/", b"/api/export/", b"/page/main.js/"):
                target = start_at + (dots + slash) * 3 + b"pyproject.toml"
                answer = asked(server, b"GET " + target + b" HTTP/1.1\r\n" + HOST, cookie, b"")
                assert status(answer) == 404
                assert secret not in answer


PIECES = st.sampled_from(
    [b"GET", b"HEAD", b"POST", b" ", b"/", b"HTTP/1.1", b"\r\n", b"\r\n\r\n", b"Host: 127.0.0.1", b"Content-Length: 3",
     b"X:", b"\xff", b"Upgrade: websocket", b"Transfer-Encoding: chunked", b"\x00", b"%2e%2e", b"?token=", b":", b"\n",
     b"a" * 9000]
)  # fmt: skip


@given(st.lists(st.one_of(PIECES, st.binary(max_size=5)), max_size=20).map(b"".join))
@example(b"GET / HTTP/1.1\r\n" + HOST + b"\r\n")
def test_websockets_can_read_every_head_that_it_is_given(received):
    head = read_head(received)
    if head is None:
        return
    lines = iter(head.data.splitlines(keepends=True))

    def read_line(_size: int) -> Generator[None, None, bytes]:
        yield
        return next(lines)

    found: list[websockets.http11.Request] = []

    def read() -> Generator[None, None, None]:
        found.append((yield from websockets.http11.Request.parse(read_line)))

    for _ in read():
        pass
    assert len(found) == 1
