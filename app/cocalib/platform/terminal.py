"""What reaches the terminal: text from a recording, a file or a name cannot move the cursor, hide lines or change colours.

Every command prints through the streams that `escaped_output` puts in place of stdout and stderr. Control characters
become the escapes of JSON (`\\u001b`), so that JSON on stdout stays valid and keeps its values.
"""

import contextlib
import io
import re
import sys
from collections.abc import Iterator
from typing import TextIO

_UNSAFE = re.compile(
    "["
    "\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 except tab and line feed, DEL, C1
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # direction marks, overrides and isolates
    "\u2028\u2029\ufeff"  # separators that some terminals break lines at, and the byte order mark
    "\ud800-\udfff"  # bytes of a file name that are not UTF-8
    "]"
)
_COLOUR = re.compile(r"(\x1b\[[0-9;]*m)")


def escaped(text: str) -> str:
    """Return the text with control characters and direction overrides shown as `\\u001b`; line feeds and tabs stay."""
    return _UNSAFE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class _EscapingStream(io.TextIOBase):
    """A text stream that escapes what is written to it; everything else is left to the stream below."""

    def __init__(self, below: TextIO) -> None:
        self.below = below
        self.keeps_colours = False

    def write(self, text: str, /) -> int:
        if self.keeps_colours:
            parts = _COLOUR.split(text)
            shown = "".join(part if number % 2 else escaped(part) for number, part in enumerate(parts))
        else:
            shown = escaped(text)
        encoding = self.below.encoding or "utf-8"  # an ASCII terminal must not stop a command either
        self.below.write(shown.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        self.below.flush()

    def fileno(self) -> int:
        return self.below.fileno()

    def isatty(self) -> bool:
        return self.below.isatty()

    def writable(self) -> bool:
        return True

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self.below.encoding


@contextlib.contextmanager
def escaped_output() -> Iterator[None]:
    """Escape everything that is printed, logged or warned inside the `with` block."""
    kept = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = _escaping(kept[0]), _escaping(kept[1])
    try:
        yield
    finally:
        sys.stdout, sys.stderr = kept


@contextlib.contextmanager
def with_colours() -> Iterator[None]:
    """Let the colours of the help pass inside the `with` block; other control characters are escaped as ever."""
    streams = [stream for stream in (sys.stdout, sys.stderr) if isinstance(stream, _EscapingStream)]
    for stream in streams:
        stream.keeps_colours = True
    try:
        yield
    finally:
        for stream in streams:
            stream.keeps_colours = False


def terminal_stream(stream: TextIO) -> TextIO:
    """Return the stream below, for a progress bar whose texts are our own."""
    return stream.below if isinstance(stream, _EscapingStream) else stream


def print_exactly(text: str) -> None:
    """Write the content of a file to stdout: unchanged into a file or a pipe, escaped on a terminal."""
    if sys.stdout.isatty():
        sys.stdout.write(text)
    else:
        terminal_stream(sys.stdout).write(text)


def _escaping(stream: TextIO | None) -> TextIO:
    if stream is None:  # closed by whoever started the program, as by `>&-`
        stream = io.StringIO()
    return stream if isinstance(stream, _EscapingStream) else _EscapingStream(stream)  # type: ignore[return-value]
