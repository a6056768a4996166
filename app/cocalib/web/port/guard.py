"""Access control for the port: Host allow-list, Origin check, one-time link, then a cookie.

The port serves the images and clicks of a recording, which may be confidential. Web pages from other sites, rebound DNS
names and other users of the machine must not get access.
"""

import hashlib
import hmac
import ipaddress
import platform
import re
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qs

from cocalib.platform.loopback import is_loopback

MAX_IDLE_S = 12 * 3600.0
"""A browser that has neither an open page nor made a request for this long is no longer admitted [s]."""
_MAX_AGE_S = 7 * 24 * 3600
"""How long a browser keeps the cookie after the last request; an open page makes none for hours [s]."""
_MOST = 256
"""Admitted browsers; one more ends the admission that was used longest ago."""
_HOST = re.compile(r"(\[[^\]]*\]|[^:\[\]]*)(?::[0-9]*)?")
_LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")


class Admissions:
    """The admitted browsers of one server."""

    def __init__(self, session: str, now: Callable[[], float] = time.monotonic) -> None:
        """Set up without admissions.

        Args:
            session: what is served, such as the path of the session's folder; names the cookie.
            now: a monotonic clock [s].
        """
        server = hashlib.sha256(f"{platform.node()}\0{session}".encode("utf-8", "backslashreplace"))
        self.cookie_name = f"cocalib-{server.hexdigest()[:12]}"
        self._now = now
        self._last_use: dict[str, float] = {}
        self._open: Counter[str] = Counter()

    def admit(self) -> str:
        """Admit one more browser; return its cookie's value."""
        while len(self._last_use) >= _MOST:
            del self._last_use[min(self._last_use, key=lambda key: (self._open[key] > 0, self._last_use[key]))]
        value = secrets.token_urlsafe(32)
        self._last_use[_digest(value)] = self._now()
        return value

    def admitted(self, headers: Mapping[str, Sequence[str]]) -> str | None:
        """Return the cookie's value if the request has one that is admitted, which counts as a use."""
        for value in self._offered(headers):
            if self._use(_digest(value)):
                return value
        return None

    def opened(self, value: str) -> None:
        """Note that a page of this browser has opened a WebSocket: while it is open, the admission does not end."""
        self._open[_digest(value)] += 1

    def closed(self, value: str) -> None:
        """Note that it has been closed, which counts as a use."""
        key = _digest(value)
        self._open[key] -= 1
        if self._open[key] <= 0:
            del self._open[key]
        if key in self._last_use:
            self._last_use[key] = self._now()

    def open_sockets(self, value: str) -> int:
        """Return how many WebSockets of this browser are open."""
        return self._open[_digest(value)]

    def _use(self, key: str) -> bool:
        """Renew an admission; return whether it has not ended."""
        last = self._last_use.get(key)
        if last is None or (self._now() - last > MAX_IDLE_S and not self._open[key]):
            self._last_use.pop(key, None)
            return False
        self._last_use[key] = self._now()
        return True

    def set_cookie(self, value: str) -> str:
        """Return the header that sets the cookie, or renews it."""
        return f"{self.cookie_name}={value}; Max-Age={_MAX_AGE_S}; HttpOnly; SameSite=Strict; Path=/"

    def _offered(self, headers: Mapping[str, Sequence[str]]) -> list[str]:
        pairs = (pair.strip().partition("=") for header in headers.get("cookie", ()) for pair in header.split(";"))
        return [value for name, _, value in pairs if name == self.cookie_name]


def _digest(value: str) -> str:
    """Hash a value, so that looking it up takes no longer for one that is nearly right."""
    return hashlib.sha256(value.encode("utf-8", "backslashreplace")).hexdigest()


@dataclass(frozen=True, slots=True)
class Request:
    """The part of a request that the guard checks.

    Attributes:
        path: path and query as sent.
        headers: all values of each header; names in lower case.
        method: such as GET.
    """

    path: str
    headers: Mapping[str, Sequence[str]]
    method: str = "GET"

    @property
    def is_websocket(self) -> bool:
        """Whether the request is a WebSocket upgrade."""
        return any("websocket" in value.lower() for value in self.headers.get("upgrade", ()))


@dataclass(frozen=True, slots=True)
class Allowed:
    """Serve it.

    Attributes:
        cookie: the value of the cookie that it came with.
    """

    cookie: str


@dataclass(frozen=True, slots=True)
class Admitted:
    """The link's token is correct: set the cookie and go on to the address without the token.

    Attributes:
        cookie: the value of the new cookie.
    """

    cookie: str


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


class Guard:
    """Decides which requests a server answers.

    The link printed in the terminal contains a token. A generated token works once and is then replaced; a token chosen by
    the user stays valid. A browser admitted by a link gets a cookie.
    """

    def __init__(
        self, admissions: Admissions, *, host: str, token: str | None = None, more_hosts: Sequence[str] = ()
    ) -> None:
        """Set up the access control.

        Args:
            admissions: who has been admitted.
            host: the address that the server binds.
            token: the user's own token; None generates one-time tokens.
            more_hosts: further host names that requests may use.
        """
        self._admissions = admissions
        self._names = {*_LOOPBACK_NAMES, host.lower(), *(name.lower() for name in more_hosts)}
        self._takes_addresses = not is_loopback(host)
        self._fixed = token is not None
        self._token = token if token is not None else secrets.token_urlsafe(24)

    @property
    def token(self) -> str:
        """The token that is currently valid."""
        return self._token

    def screen(self, request: Request) -> Refused | None:
        """Refuse requests under a foreign host name or from a foreign page, whoever sends them."""
        host = self._host_of(request)
        return host if isinstance(host, Refused) else self._foreign_origin(request, host)

    def tries_token(self, request: Request) -> bool:
        """Return whether a request has to wait for its turn: it offers a token that may have been guessed.

        A generated token is too long to be guessed at any rate, so the right one need not wait behind wrong ones.
        """
        offered = self._offered(request)
        if not offered or self._admissions.admitted(request.headers) is not None:
            return False
        return self._fixed or not self._is_token(offered[0])

    def check(self, request: Request) -> Verdict:
        """Decide on a request before anything else handles it."""
        if (refused := self.screen(request)) is not None:
            return refused
        offered = self._offered(request)
        cookie = self._admissions.admitted(request.headers)
        if cookie is not None:
            return Admitted(cookie) if offered else Allowed(cookie)
        if offered and self._is_token(offered[0]):
            if not self._fixed:
                self._token = secrets.token_urlsafe(24)
            return Admitted(self._admissions.admit())
        return Refused(
            401, "Open the link shown in the terminal. Each link works once; the terminal then shows a new one."
        )

    def _host_of(self, request: Request) -> str | Refused:
        """Return the Host header; refuse names that are not ours, to prevent DNS rebinding."""
        hosts = request.headers.get("host", ())
        if len(hosts) != 1:
            return Refused(400, "A request needs exactly one Host header.")
        host = hosts[0].strip().lower()
        match = _HOST.fullmatch(host)
        name = match[1] if match else host
        if name in self._names or (self._takes_addresses and is_address(name)):
            return host
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

    def _offered(self, request: Request) -> list[str]:
        """Return the tokens in the address: only opening it as a page uses a link up, not a preview or a WebSocket."""
        if request.is_websocket or request.method != "GET":
            return []
        return parse_qs(request.path.partition("?")[2]).get("token", [])

    def _is_token(self, offered: str) -> bool:
        return hmac.compare_digest(_bytes(offered), _bytes(self._token))


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "backslashreplace")


def is_address(name: str) -> bool:
    """Return whether a host is an address rather than a name: DNS cannot rebind an address."""
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
