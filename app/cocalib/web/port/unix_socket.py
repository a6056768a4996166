"""Serve on a Unix socket instead of a port: on a shared robot, no other user can even connect."""

import contextlib
import getpass
import os
import shlex
import socket
import stat
from pathlib import Path

from cocalib.web.port.address import AddressError

_LONGEST_BYTES = 103
"""macOS allows 103 bytes, Linux 107."""


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
