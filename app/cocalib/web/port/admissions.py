"""Who has been admitted: a random cookie for each browser, known to this process only, with an end.

The cookie's name is the server's own, because a browser sends the cookies of a host to all its ports: two servers must not
overwrite each other's. Its value is worth nothing to any other server, and nothing after this one has stopped.
"""

import hashlib
import platform
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

MAX_IDLE_S = 12 * 3600.0
"""A browser that has neither an open page nor made a request for this long is no longer admitted [s]."""
_MAX_AGE_S = 7 * 24 * 3600
"""How long a browser keeps the cookie after the last request; an open page makes none for hours [s]."""
_MOST = 256
"""Admitted browsers; one more ends the admission that was used longest ago."""


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
