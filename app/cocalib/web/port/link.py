"""The link that opens the page, on a port or a Unix socket: bound and handed over before the server's own modules are imported.

A browser takes about as long to start as the rest of the program. Whoever uses the link before the server accepts connections
waits in the queue of the listening socket: nothing is answered before the guard can answer it.
"""

import contextlib
import getpass
import html
import os
import secrets
import shlex
import socket
import stat
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO
from urllib.parse import quote

from cocalib.platform.loopback import is_loopback
from cocalib.platform.resources import state_folder
from cocalib.web.port.address import AddressError, listening_at
from cocalib.web.port.guard import Admissions, Guard, is_address

_FORWARDED_PORT = 8080
_SNAPS = ("firefox", "chromium", "brave", "opera")
_LONGEST_BYTES = 103
"""macOS allows 103 bytes, Linux 107."""


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
        if options.port and options.socket is None and self.port != options.port:
            print(f"Port {options.port} is taken; this is port {self.port}.")
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


class HandOver:
    """A file that leads a browser to the link; it is deleted once the link was used, or when the server stops."""

    def __init__(self, url: str, opener: Callable[[str], object] | None = None) -> None:
        """Write the file and open it; if it cannot be written, nothing is opened: the printed link remains.

        Args:
            url: the link.
            opener: opens an address in the browser; None for the user's own.
        """
        self.path = _write_link(url)
        if self.path is not None:
            threading.Thread(target=opener or webbrowser.open, args=(self.path.as_uri(),), daemon=True).start()

    def discard(self) -> None:
        """Delete the file. Safe to call twice."""
        if self.path is None:
            return
        try:
            self.path.unlink(missing_ok=True)
            self.path.parent.rmdir()
        except OSError:
            return  # another server's file is in the folder


def _write_link(url: str) -> Path | None:
    link = html.escape(url, quote=True)
    page = (
        '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer"><title>cocalib</title>'
        f'<meta http-equiv="refresh" content="0; url={link}"><p><a href="{link}">Open the page</a>\n'
    )
    try:
        folder = _folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
        if os.name != "nt" and (status.st_uid != os.getuid() or status.st_mode & 0o077):
            folder = Path(tempfile.mkdtemp(prefix="cocalib-"))
        path = folder / f"open-{secrets.token_hex(8)}.html"
        with os.fdopen(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="utf-8") as file:
            file.write(page)
    except OSError:
        return None
    return path


def _folder() -> Path:
    """Return a folder of this user that the browser can read: one from a snap reads no hidden folders."""
    if sys.platform == "linux" and any(Path("/snap/bin", name).exists() for name in _SNAPS):
        return Path.home() / "cocalib-link"
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or "")
    return runtime / "cocalib" if runtime.is_absolute() and runtime.is_dir() else state_folder() / "link"


def listening_socket(path: Path) -> socket.socket:
    """Bind a socket that only this user can reach; one that a killed server left behind is replaced.

    Args:
        path: where to create it; its folder is created if it is missing.

    Raises:
        AddressError: the system has no Unix sockets, the path is too long or taken, or others can enter its folder.
    """
    path = path.absolute()
    if not hasattr(socket, "AF_UNIX"):
        raise AddressError("--socket: this system has no Unix sockets; leave the option out")
    if len(os.fsencode(path)) > _LONGEST_BYTES:
        raise AddressError(f"--socket {path}: longer than {_LONGEST_BYTES} bytes, the maximum; choose a shorter path")
    if ":" in str(path):
        raise AddressError(f"--socket {path}: ssh cannot forward a path with a colon; choose another one")
    bound = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        _require_private(path.parent)
        _require_free(path)
        bound.bind(str(path))
        path.chmod(0o600)
        bound.listen()
    except OSError as error:
        bound.close()
        raise AddressError(
            f"--socket {path}: cannot be created ({error.strerror or error}); choose another path"
        ) from None
    except AddressError:
        bound.close()
        raise
    return bound


def remove_socket(path: Path) -> None:
    """Remove the socket's file, if it is one."""
    with contextlib.suppress(OSError):
        if stat.S_ISSOCK(path.lstat().st_mode):
            path.unlink()


def forwarding_command(path: Path, port: int) -> str:
    """Return the command that forwards a port of another machine to the socket."""
    to = shlex.quote(f"{port}:{path.absolute()}")
    return f"ssh -N -L {to} {shlex.quote(f'{getpass.getuser()}@{socket.gethostname()}')}"


def _require_private(folder: Path) -> None:
    """Create the folder if it is missing; refuse one that others can enter."""
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.stat()
    if status.st_uid != os.getuid() or status.st_mode & 0o077:
        raise AddressError(
            f"--socket: others can enter {folder}; choose a path in a folder of your own that nobody else can enter, "
            f"such as {_suggestion()}"
        )


def _suggestion() -> str:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"{runtime}/cocalib.sock" if runtime else "~/.cocalib/socket"


def _require_free(path: Path) -> None:
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise AddressError(f"--socket {path}: exists and is not a socket; choose another path")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as trial:
        try:
            trial.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
    raise AddressError(f"--socket {path}: another server is using it; stop that one, or choose another path")
