"""Check the address, port and token of the server before anything is opened."""

import socket

from calib_core.errors import CalibrationError

__all__ = ["AddressError", "require_address", "require_token"]

_LAST_PORT = 65535


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
            f"--host {host}: cannot serve on this address ({(error.strerror or str(error)).lower()}); "
            "give an address of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them"
        ) from None


def require_token(token: str | None) -> None:
    """Refuse an empty token, which would protect nothing.

    Raises:
        AddressError: it is empty.
    """
    if token is not None and not token.strip():
        raise AddressError("--token: the token is empty; omit the flag to have one generated and printed in the link")
