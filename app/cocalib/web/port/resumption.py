"""An open page is admitted again after the server was restarted, without a new link.

A cookie cannot do this safely: while the server is down, another user of the machine may listen on its port, and the
browser would send that cookie to them. The page instead keeps a secret in its memory, which no request carries, and proves
that it has it: it signs a challenge of the new server together with its own address. The proof is worth nothing to a
server on any other port, and a challenge is accepted once.
"""

import hashlib
import hmac
import os
import secrets
import stat
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cocalib.platform.resources import state_folder

_KEY_BYTES = 32
_VALID_S = 24 * 3600
_CHALLENGE_S = 30.0
_MOST_CHALLENGES = 64


@dataclass(frozen=True, slots=True)
class Ticket:
    """What an admitted page keeps in its memory.

    Attributes:
        ticket: names the secret and its end; not secret.
        secret: the key of the page's proofs, as hexadecimal digits.
    """

    ticket: str
    secret: str


class Resumption:
    """Gives tickets to admitted pages, and checks their proofs after a restart. Runs on one event loop."""

    def __init__(self, session: str, *, wall: Callable[[], float] = time.time) -> None:
        """Set up with the user's key.

        Args:
            session: what is served; a ticket is for one session.
            wall: the time since 1970 [s].
        """
        self._key = _user_key()
        self._session = session
        self._wall = wall
        self._challenges: dict[str, float] = {}

    def ticket(self) -> Ticket:
        """Return a new ticket."""
        name = f"{secrets.token_hex(8)}.{int(self._wall()) + _VALID_S}"
        return Ticket(name, self._secret(name).hex())

    def challenge(self) -> str:
        """Return a new challenge; of many, the oldest expire first."""
        while len(self._challenges) >= _MOST_CHALLENGES:
            del self._challenges[next(iter(self._challenges))]
        made = secrets.token_hex(16)
        self._challenges[made] = self._wall()
        return made

    def is_proven(self, *, ticket: str, challenge: str, proof: str, origin: str) -> bool:
        """Return whether a page of this session and origin holds the ticket's secret; a challenge is used up by asking.

        Args:
            ticket: its name.
            challenge: of this server.
            proof: HMAC-SHA256 of the challenge, a line feed and the origin, as hexadecimal digits.
            origin: the only origin under which this server is reached directly.
        """
        made = self._challenges.pop(challenge, None)
        end = ticket.rpartition(".")[2]
        if made is None or self._wall() - made > _CHALLENGE_S or not (end.isascii() and end.isdigit()):
            return False
        if len(end) > 12 or int(end) < self._wall():
            return False
        wanted = hmac.new(self._secret(ticket), f"{challenge}\n{origin}".encode(), hashlib.sha256).hexdigest()
        return hmac.compare_digest(wanted.encode(), proof.encode("utf-8", "backslashreplace"))

    def _secret(self, ticket: str) -> bytes:
        text = f"page 1\0{self._session}\0{ticket}"
        return hmac.new(self._key, text.encode("utf-8", "backslashreplace"), hashlib.sha256).digest()


def _user_key() -> bytes:
    """Return the user's secret from the state folder; one of this process if that cannot hold it privately."""
    path = state_folder() / "page.key"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return _stored_key(path)
    except OSError:
        return secrets.token_bytes(_KEY_BYTES)


def _stored_key(path: Path) -> bytes:
    """Read the key, or make it.

    Raises:
        OSError: it cannot be read or written, or others could have written or read it.
    """
    follow_nothing = getattr(os, "O_NOFOLLOW", 0)
    try:
        descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | follow_nothing, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(secrets.token_bytes(_KEY_BYTES))
    except FileExistsError:
        pass
    with os.fdopen(os.open(path, os.O_RDONLY | follow_nothing | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
        status = os.fstat(file.fileno())
        key = file.read(_KEY_BYTES + 1)
    private = os.name == "nt" or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
    if not stat.S_ISREG(status.st_mode) or not private or len(key) != _KEY_BYTES:
        raise OSError("not a private key file")
    return key
