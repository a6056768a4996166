"""Flags that say where the page is served."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from app.cli.flags import Switch, called
from app.web.port.address import require_address, require_one_address, require_token
from app.web.port.guard import is_loopback
from app.web.port.link import Link, ServerOptions

__all__ = ["ServingFlags"]


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

    def link(self, session: Path) -> Link:
        """Bind the address and generate the token; nothing is printed yet.

        Args:
            session: the session's folder.

        Raises:
            AddressError: the address, the port, the token or the socket cannot be used.
        """
        require_address(self.host, self.port)
        require_one_address(self.socket, self.host)
        require_token(self.token, reachable=not is_loopback(self.host))
        return Link(ServerOptions(**dataclasses.asdict(self), session=str(session.absolute())))
