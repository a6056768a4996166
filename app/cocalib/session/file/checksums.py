"""Chained checksums: every line carries one over its own content and the checksum of the line before.

A changed bit, a line that was removed, inserted, repeated or exchanged breaks the chain at that line. It shows faults of disks,
copies and other programs; someone who edits a session on purpose can calculate checksums too.
"""

import hashlib
from dataclasses import dataclass

_DIGITS = 16
_BEFORE, _AFTER = b',"sum":"', b'"}'
_LENGTH = len(_BEFORE) + _DIGITS + len(_AFTER)


@dataclass(frozen=True, slots=True)
class SealedLine:
    """A line as found; whether its checksum is right depends on the line before.

    Attributes:
        content: the JSON object without the checksum.
        sum: the checksum that the line states; "" if it states none.
    """

    content: bytes
    sum: str

    def follows(self, previous: str) -> bool:
        """Return whether the checksum is right, if the line before states `previous`."""
        return self.sum != "" and self.sum == _checksum(previous, self.content)


def sealed(content: bytes, previous: str = "") -> SealedLine:
    """Calculate the checksum of a line.

    Args:
        content: a JSON object with at least one key.
        previous: checksum of the line before; "" for the first.
    """
    return SealedLine(content, _checksum(previous, content))


def line_bytes(line: SealedLine) -> bytes:
    """Return a line as written, without its line end."""
    return line.content[:-1] + _BEFORE + line.sum.encode() + _AFTER


def taken_apart(line: bytes) -> SealedLine:
    """Separate a line's content from the checksum that it states."""
    end = line[-_LENGTH:]
    if len(line) <= _LENGTH or not (end.startswith(_BEFORE) and end.endswith(_AFTER)):
        return SealedLine(line, "")
    return SealedLine(line[:-_LENGTH] + b"}", end[len(_BEFORE) : -len(_AFTER)].decode("ascii", "replace"))


def _checksum(previous: str, content: bytes) -> str:
    return hashlib.sha256(previous.encode() + b"\n" + content).hexdigest()[:_DIGITS]
