"""Access control for the port: Host allow-list, Origin check, one-time link, then a cookie.

The port serves the pictures and clicks of a recording, which may be confidential. Web pages from other sites, rebound DNS
names and other users of the machine must not get access.
"""

import hashlib
import hmac
import ipaddress
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qs, urlsplit

__all__ = ["COOKIE_NAME", "Admitted", "Allowed", "Guard", "Refused", "Request", "Verdict", "is_loopback"]

COOKIE_NAME = "cocalib"
_LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")


@dataclass(frozen=True, slots=True)
class Request:
    """The part of a request that the guard checks.

    Attributes:
        path: path and query as sent.
        headers: all values of each header; names in lower case.
    """

    path: str
    headers: Mapping[str, Sequence[str]]

    @property
    def is_websocket(self) -> bool:
        """Whether the request is a WebSocket upgrade."""
        return any("websocket" in value.lower() for value in self.headers.get("upgrade", ()))


@dataclass(frozen=True, slots=True)
class Allowed:
    """Serve it."""


@dataclass(frozen=True, slots=True)
class Admitted:
    """The link's token is correct: set the cookie and redirect to the address without the token."""

    set_cookie: str
    location: str


@dataclass(frozen=True, slots=True)
class Refused:
    """Do not serve it.

    Attributes:
        status: 400, 401, 403 or 421.
        reason: a short text shown in the browser.
    """

    status: Literal[400, 401, 403, 421]
    reason: str


Verdict = Allowed | Admitted | Refused


def is_loopback(host: str) -> bool:
    """Return whether a bind address can only be reached from this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Guard:
    """Decides which requests a server answers.

    The link printed in the terminal contains a token. A generated token works once and is then replaced; a token chosen by
    the user stays valid. A browser admitted by a link gets a cookie, which stays valid after a restart if the key is the same.
    """

    def __init__(self, *, host: str, key: bytes, token: str | None = None, more_hosts: Sequence[str] = ()) -> None:
        """Set up the access control.

        Args:
            host: the address that the server binds.
            key: secret from which the cookie is derived; with the same key, cookies of an earlier process are accepted.
            token: the user's own token; None generates one-time tokens.
            more_hosts: further host names that requests may use.
        """
        self._names = {*_LOOPBACK_NAMES, host.lower(), *(name.lower() for name in more_hosts)}
        self._takes_addresses = not is_loopback(host)
        self._cookie = hmac.new(key, b"cocalib cookie 1", hashlib.sha256).hexdigest()
        self._fixed = token is not None
        self._token = token if token is not None else secrets.token_urlsafe(24)

    @property
    def token(self) -> str:
        """The token that is currently valid."""
        return self._token

    @property
    def cookie(self) -> str:
        """Name and value of the cookie, as sent by a client."""
        return f"{COOKIE_NAME}={self._cookie}"

    def check(self, request: Request) -> Verdict:
        """Decide on a request before anything else handles it."""
        host = self._host_of(request)
        if isinstance(host, Refused):
            return host
        foreign = self._foreign_origin(request, host)
        if foreign is not None:
            return foreign
        return self._admission(request)

    def _host_of(self, request: Request) -> str | Refused:
        """Return the Host header; refuse names that are not ours, to prevent DNS rebinding."""
        hosts = request.headers.get("host", ())
        if len(hosts) != 1:
            return Refused(400, "A request needs exactly one Host header.")
        name = _without_port(hosts[0].strip().lower())
        if name in self._names or (self._takes_addresses and _is_address(name)):
            return hosts[0].strip().lower()
        return Refused(421, "This server does not accept that host name. Use the link shown in the terminal.")

    def _foreign_origin(self, request: Request, host: str) -> Refused | None:
        origins = request.headers.get("origin", ())
        if not origins:
            if request.is_websocket:
                return Refused(403, "A WebSocket request needs an Origin header.")
            return None
        if [origin.lower() for origin in origins] in ([f"http://{host}"], [f"https://{host}"]):
            return None
        return Refused(403, "This request came from another site. Open the link shown in the terminal.")

    def _admission(self, request: Request) -> Verdict:
        address = urlsplit(request.path)
        offered = parse_qs(address.query).get("token", [])
        if request.is_websocket:
            offered = []
        if _same(_cookies(request), self._cookie):
            return Admitted(self._set_cookie(), address.path) if offered else Allowed()
        if offered and hmac.compare_digest(offered[0].encode(), self._token.encode()):
            if not self._fixed:
                self._token = secrets.token_urlsafe(24)
            return Admitted(self._set_cookie(), address.path)
        return Refused(
            401, "Open the link shown in the terminal. Each link works once; the terminal then shows a new one."
        )

    def _set_cookie(self) -> str:
        return f"{COOKIE_NAME}={self._cookie}; HttpOnly; SameSite=Strict; Path=/"


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host.partition("]")[0] + "]"
    return host.partition(":")[0]


def _is_address(name: str) -> bool:
    """Return whether a host is an address rather than a name: DNS cannot rebind an address."""
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True


def _cookies(request: Request) -> list[str]:
    pairs = (pair.strip().partition("=") for header in request.headers.get("cookie", ()) for pair in header.split(";"))
    return [value for name, _, value in pairs if name == COOKIE_NAME]


def _same(offered: list[str], wanted: str) -> bool:
    return any(hmac.compare_digest(value.encode(), wanted.encode()) for value in offered)
