"""What happens to each request before it reaches a page's channel or the 3D view: who is it, what is it, what is the answer."""

import logging
from collections.abc import Callable
from dataclasses import replace
from urllib.parse import parse_qs

import msgspec

from cocalib.platform.error_boundary import error_boundary
from cocalib.web.port import guard
from cocalib.web.port.admissions import Admissions
from cocalib.web.port.backoff import Backoff
from cocalib.web.port.resumption import Resumption
from cocalib.web.port.routes import Reply, Routes, json_reply, landing, refusal

MAX_SOCKETS = 64
"""WebSockets of one browser; a page has two."""
_METHODS = ("GET", "HEAD")
_CHALLENGE, _RESUME, _TICKET = "/api/challenge", "/api/resume", "/api/ticket"
_log = logging.getLogger(__name__)


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
