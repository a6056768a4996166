"""Whether an address can be served from, found out before anything is opened for it."""

import socket

from calib_core.errors import CalibrationError

__all__ = ["AddressError", "require_address", "require_token"]

_LAST_PORT = 65535


class AddressError(CalibrationError):
    """An address, port or token that cannot be served with."""


def require_address(host: str, port: int) -> None:
    """Try whether an address can be bound; a port that is taken is no fault, for the next one is taken then.

    Args:
        host: a name or an address of this machine.
        port: 0 to 65535.

    Raises:
        AddressError: the port is no port, or the address is none of this machine.
    """
    if not 0 <= port <= _LAST_PORT:
        raise AddressError(f"--port {port}: a port is 0 (any free one) to {_LAST_PORT}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.bind(address)
    except OSError as error:
        raise AddressError(
            f"--host {host}: cannot be served from ({(error.strerror or str(error)).lower()}); "
            "give an address of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them"
        ) from None


def require_token(token: str | None) -> None:
    """Refuse a token that protects nothing.

    Raises:
        AddressError: it is empty.
    """
    if token is not None and not token.strip():
        raise AddressError("--token: it is empty; leave the flag out, and a token is made and printed in the link")
