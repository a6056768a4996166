"""Who writes an unfinished result, so that what a killed process left is told from what another one is writing."""

import os
import re
import secrets
import time
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Self

_NAME = re.compile(
    r"\.(?P<digest>[^.]+)\.(?P<place>[0-9a-f]{12})-(?P<process>\d+)-(?P<begin>\d+)\.(?P<token>[0-9a-f]+)"
)
_PATIENCE_S = 3600.0
"""A result is written in seconds, once everything in it is computed."""


@dataclass(frozen=True, slots=True)
class Writer:
    """A process.

    Attributes:
        place: where process numbers mean the same: one running system, one container.
        process: its number.
        begin: when it began, in the system's own count; numbers are given again to later processes.
    """

    place: str
    process: int
    begin: int

    @classmethod
    def this(cls) -> Self:
        """Return this process."""
        return cls(_place(), os.getpid(), _begin(os.getpid()) or 0)

    def folder_name(self, digest: str) -> str:
        """Return a hidden name for a result that this process writes; another one each time."""
        return f".{digest}.{self.place}-{self.process}-{self.begin}.{secrets.token_hex(4)}"


def is_abandoned(folder: Path) -> bool:
    """Return whether nobody writes an unfinished result any more.

    Of this system's processes that is known. Of others, what has not changed for an hour is abandoned: if one of them was only
    stopped for that long, it fails to write its result, and the job runs again.

    Args:
        folder: named by a writer.
    """
    named = _NAME.fullmatch(folder.name)
    if named is not None and named["place"] == _place():
        return _begin(int(named["process"])) != int(named["begin"])
    try:
        newest_s = max(one.lstat().st_mtime for one in (folder, *folder.iterdir()))
    except OSError:  # its writer has just finished it
        return False
    return time.time() - newest_s > _PATIENCE_S


@cache
def _place() -> str:
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        space = str(Path("/proc/self/ns/pid").stat().st_ino)
    except OSError:  # not Linux: a place of its own for each process, so that age decides
        boot, space = secrets.token_hex(16), ""
    return sha256(f"{boot} {space}".encode()).hexdigest()[:12]


def _begin(process: int) -> int | None:
    """Return when a process began; None if there is none of this number."""
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return int(status.rpartition(")")[2].split()[19])
