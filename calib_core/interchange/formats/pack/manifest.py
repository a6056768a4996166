"""SHA256SUMS: the hash of every file of a pack, as `sha256sum -c` reads it."""

import hashlib
import re
from collections.abc import Mapping

from calib_core.errors import InputError

MANIFEST = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64}) [ *](.+)")


def manifest_text(members: Mapping[str, bytes]) -> str:
    """Return the manifest of a pack's other files, one line each, in their order."""
    return "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in members.items())


def verify(members: Mapping[str, bytes], *, source: str) -> None:
    """Verify the files of a pack against its manifest.

    Args:
        members: all files by name, the manifest among them.
        source: the name of the pack in error messages.

    Raises:
        InputError: the manifest is missing or unreadable, or a file is missing, changed or not listed.
    """
    if MANIFEST not in members:
        raise InputError(f"{source}: {MANIFEST} is missing, so its files cannot be verified; export the pack again")
    stated = {}
    for line in members[MANIFEST].decode("utf-8", errors="replace").splitlines():
        match = _LINE.fullmatch(line)
        if match is None:
            raise InputError(f"{source}: {MANIFEST}: a line is not a hash and a file name; export the pack again")
        stated[match[2]] = match[1]
    for name in sorted({*stated, *members} - {MANIFEST}):
        if name not in members:
            raise InputError(f"{source}: {name} is missing, which {MANIFEST} lists; export the pack again")
        if name not in stated:
            raise InputError(f"{source}: {name} is not listed in {MANIFEST}; remove it or export the pack again")
        if hashlib.sha256(members[name]).hexdigest() != stated[name]:
            raise InputError(
                f"{source}: {name} was changed after the export ({MANIFEST} has another hash); export the pack again"
            )
