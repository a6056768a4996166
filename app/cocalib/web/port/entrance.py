"""What happens to each request before it reaches a page's channel or the 3D view: who is it, what is it, what is the answer."""

import asyncio
import logging
import time
from collections.abc import Callable
from dataclasses import replace
from urllib.parse import parse_qs

import msgspec

from cocalib.platform.error_boundary import error_boundary
from cocalib.web.port import guard
from cocalib.web.port.guard import Admissions
from cocalib.web.port.resumption import Resumption
from cocalib.web.port.routes import Reply, Routes, json_reply, landing, refusal

MAX_SOCKETS = 64
"""WebSockets of one browser; a page has two."""
_METHODS = ("GET", "HEAD")
_CHALLENGE, _RESUME, _TICKET = "/api/challenge", "/api/resume", "/api/ticket"
_log = logging.getLogger(__name__)
_FREE_TRIES = 5
_FIRST_DELAY_S = 0.25
_LONGEST_DELAY_S = 8.0
_FORGOTTEN_AFTER_S = 300.0
_MOST_WAITING = 8


class Entrance:
    """Answers requests, or lets a WebSocket in. Runs on one event loop."""

    def __init__(
        self,
        admissions: Admissions,
        door: guard.Guard,
        routes: Routes,
        resumption: Resumption,
        origin: Callable[[], str],
    ) -> None:
        """Set up the entrance.

        Args:
            admissions: who has been admitted.
            door: who may be.
            routes: what is served.
            resumption: checks pages of an earlier run.
            origin: the origin under which pages reach this server directly; "" if there is none.
        """
        self._admissions = admissions
        self._guard = door
        self._routes = routes
        self._resumption = resumption
        self._origin = origin
        self._backoff = Backoff()
        self.on_admitted: Callable[[], None] = lambda: None

    async def answer(self, request: guard.Request) -> Reply | None:
        """Answer a request; return None for a WebSocket that may be opened."""
        reply: Reply | None = refusal(500, "Internal error; the terminal says where its report is.")
        with error_boundary("a request", _log.error):
            reply = await self._answer(request)
        return replace(reply, body=b"") if reply is not None and request.method == "HEAD" else reply

    def entered(self, request: guard.Request) -> str:
        """Count an opened WebSocket; return the cookie that it came with."""
        cookie = self._admissions.admitted(request.headers) or ""
        self._admissions.opened(cookie)
        return cookie

    def left(self, cookie: str) -> None:
        """Note that it has been closed."""
        self._admissions.closed(cookie)

    async def _answer(self, request: guard.Request) -> Reply | None:
        if (refused := self._guard.screen(request)) is not None:
            return refusal(refused.status, refused.reason)
        path, _, query = request.path.partition("?")
        if path == _CHALLENGE and request.method == "GET":
            return json_reply(msgspec.json.encode({"challenge": self._resumption.challenge()}))
        if path == _RESUME and request.method == "GET":
            return self._resume(parse_qs(query))
        return await self._admission(request)

    async def _admission(self, request: guard.Request) -> Reply | None:
        tried = self._guard.tries_token(request)
        if tried and not await self._backoff.turn():
            return refusal(429, "Too many links were tried. Wait a moment.", more=(("Retry-After", "10"),))
        verdict = self._guard.check(request)
        if isinstance(verdict, guard.Admitted):
            if tried:
                self._backoff.right()
            self.on_admitted()
            return landing(self._admissions.set_cookie(verdict.cookie))
        if isinstance(verdict, guard.Refused):
            if tried:
                self._backoff.wrong()
            return refusal(verdict.status, verdict.reason)
        return await self._answer_admitted(request, verdict.cookie)

    async def _answer_admitted(self, request: guard.Request, cookie: str) -> Reply | None:
        path = request.path.partition("?")[0]
        if request.method not in _METHODS:
            return refusal(405, "Only GET and HEAD are answered.", more=(("Allow", ", ".join(_METHODS)),))
        if not path.startswith("/"):
            return refusal(400, "The address of a request begins with a slash.")
        renewed = ("Set-Cookie", self._admissions.set_cookie(cookie))
        if request.is_websocket:
            if not path.startswith(("/ws/", "/viser/")):
                return refusal(404, "No WebSocket at this address.")
            if self._admissions.open_sockets(cookie) >= MAX_SOCKETS:
                return refusal(429, "Too many pages of this browser are open; close some.")
            return None
        if path == _TICKET:
            return json_reply(msgspec.json.encode(self._resumption.ticket()), more=(renewed,))
        reply = await self._routes.answer(request.path)
        return replace(reply, headers=(*reply.headers, renewed))

    def _resume(self, query: dict[str, list[str]]) -> Reply:
        """Admit a page that proves that an earlier run had admitted it."""
        given = {name: query.get(name, [""])[0] for name in ("ticket", "challenge", "proof")}
        origin = self._origin()
        if not origin or not self._resumption.is_proven(**given, origin=origin):
            return refusal(401, "Open the link shown in the terminal.")
        cookie = self._admissions.set_cookie(self._admissions.admit())
        return json_reply(b"{}", more=(("Set-Cookie", cookie),))


class Backoff:
    """Lets tokens be tried one after another, ever more slowly while they are wrong. Runs on one event loop."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._wrong = 0
        self._last_wrong = now()
        self._waiting = 0
        self._turn: asyncio.Lock | None = None

    @property
    def delay_s(self) -> float:
        """How long the next try has to wait [s]."""
        if self._now() - self._last_wrong > _FORGOTTEN_AFTER_S:
            self._wrong = 0
        late = self._wrong - _FREE_TRIES
        return 0.0 if late < 0 else min(_LONGEST_DELAY_S, _FIRST_DELAY_S * 2.0 ** min(late, 10))

    async def turn(self) -> bool:
        """Wait for the turn of a try; return False if too many are waiting already."""
        if self._waiting >= _MOST_WAITING:
            return False
        self._turn = self._turn or asyncio.Lock()
        self._waiting += 1
        try:
            async with self._turn:
                await asyncio.sleep(self.delay_s)
        finally:
            self._waiting -= 1
        return True

    def wrong(self) -> None:
        """Note a wrong token."""
        self._wrong += 1
        self._last_wrong = self._now()

    def right(self) -> None:
        """Note a right token: the delay ends."""
        self._wrong = 0
