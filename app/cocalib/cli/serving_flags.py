"""Flags that say where the page is served."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from cocalib.cli.flags import Switch, called
from cocalib.platform.loopback import is_loopback
from cocalib.web.port.address import require_address, require_one_address, require_token
from cocalib.web.port.link import Link, ServerOptions


@dataclass(frozen=True, slots=True)
class ServingFlags:
    """Where to serve the page."""

    host: Annotated[str, tyro.conf.arg(metavar="ADDRESS")] = "127.0.0.1"
    """Address to bind; any other than loopback admits other machines, which then need the token."""
    port: int = 8080
    """Port; if it is taken, the next free one; 0 for any free port."""
    token: Annotated[str | None, called("TOKEN")] = None
    """Token that the link must contain, 8 characters or more, 16 for other machines; generated and printed if omitted."""
    socket: Annotated[Path | None, called("PATH")] = None
    """Serve on a Unix socket that only you can reach, for shared robots; the ssh command that forwards it is printed."""
    no_browser: Switch = False
    """Print the link, do not open a browser."""
    no_proposals: Switch = False
    """Do not look in the images for where the reflector stood; the page can still ask for it."""
    on_problem: Annotated[Literal["auto", "ask", "exit"], called()] = "auto"
    """What to do if the recording cannot be opened: ask in the page, or exit with code 2; auto asks, but exits with
    --no-browser if the output is no terminal, as in scripts."""

    @property
    def asks(self) -> bool:
        """Whether a recording that cannot be opened leads to a question in the page; otherwise it ends the command."""
        if self.on_problem != "auto":
            return self.on_problem == "ask"
        return not self.no_browser or sys.stdout.isatty()

    def link(self, session: str) -> Link:
        """Bind the address and generate the token; nothing is printed yet.

        Args:
            session: what is served, such as the session's folder.

        Raises:
            AddressError: the address, the port, the token or the socket cannot be used.
        """
        require_address(self.host, self.port)
        require_one_address(self.socket, self.host)
        require_token(self.token, reachable=not is_loopback(self.host))
        return Link(
            ServerOptions(
                self.host,
                self.port,
                self.token,
                no_browser=self.no_browser,
                socket=self.socket,
                session=session,
                proposes=not self.no_proposals,
            )
        )
