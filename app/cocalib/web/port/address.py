"""Check the address, port and token of the server before anything is opened."""

import socket
from pathlib import Path

from calib_core.errors import CalibrationError

_LAST_PORT = 65535
_PORTS_TRIED = 1000
_QUEUE = 100
"""Connections that may wait until the server accepts them."""
_LEAST, _LEAST_REACHABLE, _LEAST_DIFFERENT = 8, 16, 4


class AddressError(CalibrationError):
    """The server cannot use this address, port or token."""


def require_address(host: str, port: int) -> None:
    """Check that an address can be bound; a port that is in use is not an error, since the next free one is used instead.

    Args:
        host: a name or address of this machine.
        port: 0 to 65535.

    Raises:
        AddressError: the port is invalid, or the address does not belong to this machine.
    """
    if not 0 <= port <= _LAST_PORT:
        raise AddressError(f"--port {port}: not a valid port; give 0 (any free port) to {_LAST_PORT}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.bind(address)
    except OSError as error:
        raise AddressError(
            f"--host {host}: cannot serve on this address ({error.strerror or error}); "
            "give an address of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them"
        ) from None


def listening_at(host: str, port: int) -> socket.socket:
    """Return a listening socket on the first free port.

    Args:
        host: an address of this machine.
        port: the first port to try; 0 for any free port.

    Raises:
        AddressError: none of the ports is free.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in range(port, min(port + _PORTS_TRIED, _LAST_PORT + 1)) if port else (0,):
        try:
            return socket.create_server((host, number), family=family, backlog=_QUEUE)
        except OSError as error:
            reason = error
    raise AddressError(
        f"--port {port}: neither this port nor the {_PORTS_TRIED} after it can be used "
        f"({reason.strerror or reason}); give another one, or 0 for any free port"
    )


def require_token(token: str | None, *, reachable: bool) -> None:
    """Refuse a token that could be guessed.

    Args:
        token: the user's; None to have one generated.
        reachable: other machines can reach the server.

    Raises:
        AddressError: it is empty or too short.
    """
    omit = "omit the flag to have one generated and printed in the link"
    if token is None:
        return
    if not token.strip():
        raise AddressError(f"--token: the token is empty; {omit}")
    least = _LEAST_REACHABLE if reachable else _LEAST
    if len(token) < least or len(set(token)) < _LEAST_DIFFERENT:
        where = "when other machines can reach the page" if reachable else "against other users of this machine"
        raise AddressError(
            f"--token: at least {least} characters, {_LEAST_DIFFERENT} of them different, are needed {where}; {omit}"
        )


def require_one_address(socket_path: Path | None, host: str) -> None:
    """Refuse a Unix socket together with an address.

    Raises:
        AddressError: both are given.
    """
    if socket_path is not None and host != "127.0.0.1":
        raise AddressError("--socket takes the place of --host; give one of them")
