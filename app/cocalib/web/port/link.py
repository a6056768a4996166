"""The link that opens the page: bound and printed before the server's own modules are imported.

A browser takes about as long to start as the rest of the program. Whoever uses the link before the server accepts connections
waits in the queue of the listening socket: nothing is answered before the guard can answer it.
"""

import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO
from urllib.parse import quote

from cocalib.platform.loopback import is_loopback
from cocalib.web.port.address import listening_at
from cocalib.web.port.admissions import Admissions
from cocalib.web.port.guard import Guard, is_address
from cocalib.web.port.hand_over import HandOver
from cocalib.web.port.unix_socket import forwarding_command, listening_socket, remove_socket

_FORWARDED_PORT = 8080


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """Where the page is served, and who has access.

    Attributes:
        host: address to bind.
        port: first port to try, then the next free one; 0 for any free port.
        token: token that the link must contain; None generates one-time tokens.
        no_browser: print the link, do not open a browser.
        more_hosts: further host names that requests may use.
        socket: serve on this Unix socket instead of a port.
        session: what is served, such as the session's folder: cookies and tickets are for it only.
        proposes: whether to propose where the reflector stood without being asked.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = None
    no_browser: bool = False
    more_hosts: tuple[str, ...] = ()
    socket: Path | None = None
    session: str = ""
    proposes: bool = False


class Link:
    """The address of the page, with the socket that it leads to and the guard that checks who comes."""

    def __init__(self, options: ServerOptions) -> None:
        """Bind the socket and generate the token; nothing is printed yet.

        Raises:
            AddressError: the server cannot use this port or socket.
        """
        self.options = options
        self.admissions = Admissions(options.session)
        self.guard = Guard(self.admissions, host=options.host, token=options.token, more_hosts=options.more_hosts)
        self.listening = _bound(options)
        self.port = (options.port or _FORWARDED_PORT) if options.socket else _port_of(self.listening)
        self._announced = ""
        self._output: TextIO | None = None
        self._hand_over: HandOver | None = None

    @property
    def is_bound(self) -> bool:
        """Whether a browser can use the link already; a host name is bound by the server, to all of its addresses."""
        return self.listening is not None

    @property
    def origin(self) -> str:
        """The address without a token."""
        host = self.options.host
        shown = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
        return f"http://{shown}:{self.port}"

    @property
    def url(self) -> str:
        """The link that opens the page; it works once unless the user chose the token."""
        return f"{self.origin}/?token={quote(self.guard.token)}"

    def direct_origin(self) -> str:
        """Return the origin of pages that reach this server at its own address; "" if a name or a tunnel is in between."""
        host = "127.0.0.1" if self.options.host == "0.0.0.0" else self.options.host
        return self.origin if self.options.socket is None and is_address(host) else ""

    def announce(self, opener: Callable[[str], object] | None = None) -> None:
        """Print the link and open the browser, once.

        Args:
            opener: opens an address in the browser; None for the user's own.
        """
        if self._announced:
            return
        options, self._announced = self.options, self.url
        self._output = sys.stdout  # while viser starts, sys.stdout is not the terminal
        if not is_loopback(options.host):
            print(
                f"Warning: serving on {options.host}: anyone who has the link and can reach this machine sees the recording. "
                "From another machine, use this machine's address in the link."
            )
        if options.socket is not None:
            print("On the machine with the browser, run:")
            print(f"  {forwarding_command(options.socket, self.port)}")
        print(f"Open {self.url}", flush=True)
        if not options.no_browser and options.socket is None:
            self._hand_over = HandOver(self.url, opener)

    def used(self) -> None:
        """Delete the file with the link; a link that works once is followed by the next one."""
        if self._hand_over is not None:
            self._hand_over.discard()
        if self._announced and self.url != self._announced:
            self._announced = self.url
            print(f"For another browser, open {self.url}", file=self._output, flush=True)

    def close(self) -> None:
        """Stop listening, and delete what was written for the browser. Safe to call twice."""
        if self._hand_over is not None:
            self._hand_over.discard()
        if self.listening is not None:
            self.listening.close()
        if self.options.socket is not None:
            remove_socket(self.options.socket)


def _bound(options: ServerOptions) -> socket.socket | None:
    if options.socket is not None:
        return listening_socket(options.socket)
    return listening_at(options.host, options.port) if is_address(options.host) else None


def _port_of(listening: socket.socket | None) -> int:
    return 0 if listening is None else int(listening.getsockname()[1])
