"""Which schedulers may be used: Dask's messages are pickles, so only this machine or TLS is trusted."""

from urllib.parse import urlsplit

from calib_core.errors import InputError
from cocalib.platform.loopback import is_loopback


def checked_address(address: str) -> str:
    """Return the address of a scheduler if it is safe to connect to.

    Args:
        address: such as tcp://127.0.0.1:8786 or tls://scheduler.example:8786.

    Raises:
        InputError: it is no such address, or others on the network could send this process code to run.
    """
    try:
        parts = urlsplit(address)
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
    if scheme not in ("tcp", "tls") or not host or not port or parts.path or parts.query or parts.username:
        raise InputError(
            f"--scheduler {address}: not an address of a Dask scheduler; "
            "write tcp://127.0.0.1:8786 for one on this machine, or tls://HOST:8786"
        )
    if scheme == "tcp" and not is_loopback(host):
        raise InputError(
            f"--scheduler {address}: another machine without TLS is refused, because whoever can reach an open Dask port "
            "can run code on every machine of the cluster; start the scheduler and its workers with certificates and write "
            f"tls://{host}:{port}, or start a batch of its own on each machine"
        )
    return address
