"""The head of an HTTP request, checked before websockets parses it.

websockets answers nothing but GET: it drops the connection of any other request without a word. A head that it could not
parse is therefore replaced by an empty GET, and answered with the status found here.
"""

import re
from dataclasses import dataclass
from typing import Literal

Fault = Literal[400, 414, 431, 505]
MAX_HEAD_BYTES = 64 * 1024
_MAX_LINE_BYTES = 8 * 1024
_MAX_HEADERS = 100
_TOKEN = re.compile(rb"[-!#$%&'*+.^_`|~0-9A-Za-z]{1,64}")
_TARGET = re.compile(rb"[\x21-\x7e]+")
_VALUE = re.compile(rb"[\x09\x20-\x7e\x80-\xff]*")
_OF_A_BODY = (b"content-length", b"transfer-encoding", b"expect")


@dataclass(frozen=True, slots=True)
class Head:
    """A request's head.

    Attributes:
        method: such as GET.
        data: what websockets is given instead of the bytes received: a GET without a body.
        upgrades: it asks for a WebSocket; whatever follows any other head is of no interest.
        fault: the status to answer with at once; None if the head is sound.
    """

    method: str
    data: bytes
    upgrades: bool = False
    fault: Fault | None = None


def read_head(received: bytes) -> Head | None:
    """Read the head of a request.

    Args:
        received: all bytes of the connection so far.

    Returns:
        None while it is incomplete.
    """
    if received and not _TOKEN.match(received):
        return _faulty(400)  # such as the beginning of TLS
    end = received.find(b"\r\n\r\n", 0, MAX_HEAD_BYTES)
    if end < 0:
        return _faulty(431) if len(received) >= MAX_HEAD_BYTES else None
    first, *headers = received[:end].split(b"\r\n")
    parts = first.split(b" ")
    if len(first) > _MAX_LINE_BYTES:
        return _faulty(414)
    if len(parts) != 3 or not _TOKEN.fullmatch(parts[0]) or not _TARGET.fullmatch(parts[1]):
        return _faulty(400)
    if parts[2] != b"HTTP/1.1":
        return _faulty(505 if parts[2].startswith(b"HTTP/") else 400)
    return _with_headers(parts[0], parts[1], headers, received[end + 4 :])


def _with_headers(method: bytes, target: bytes, headers: list[bytes], rest: bytes) -> Head:
    if len(headers) > _MAX_HEADERS or any(len(line) > _MAX_LINE_BYTES for line in headers):
        return _faulty(431)
    kept = []
    for line in headers:
        name, colon, value = line.partition(b":")
        if not colon or not _TOKEN.fullmatch(name) or not _VALUE.fullmatch(value):
            return _faulty(400)
        if name.lower() not in _OF_A_BODY:
            kept.append(line)
        elif method == b"GET" and value.strip() != b"0":
            return _faulty(400)  # a GET with a body
    head = b"\r\n".join((b"GET " + target + b" HTTP/1.1", *kept))
    upgrades = method == b"GET" and any(line.lower().startswith(b"upgrade:") for line in kept)
    return Head(method.decode("ascii"), head + b"\r\n\r\n" + (rest if upgrades else b""), upgrades)


def _faulty(fault: Fault) -> Head:
    return Head("GET", b"GET / HTTP/1.1\r\n\r\n", fault=fault)
