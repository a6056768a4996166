"""Files that are read as input: only regular files, never more than a limit, and names that every encoder takes."""

import os
import select
import stat
from pathlib import Path
from typing import Any

from calib_core.errors import InputError

_SHELL_PIPES = ("/dev/fd/", "/proc/self/fd/", "/dev/stdin")
"""Where a shell puts what `<(command)` writes: there is a writer, so reading it ends."""
_PIPE = "a named pipe (FIFO)"
_WRITER_TIMEOUT_S = 5.0


def special_kind(path: Path) -> str | None:
    """Return what a path is if it is neither a regular file nor a folder, such as "a named pipe (FIFO)"; None otherwise.

    Reading a pipe waits for a writer, perhaps for ever, and reading a device may never end.

    Raises:
        OSError: the path does not exist or cannot be examined.
    """
    mode = path.stat().st_mode
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return None
    if stat.S_ISFIFO(mode):
        return _PIPE
    return "a socket" if stat.S_ISSOCK(mode) else "a device"


def read_input(path: Path, *, max_bytes: int, is_what: str) -> bytes:
    """Read a small file whole; a pipe that somebody writes to, such as the shell's `<(command)`, may be read too, once.

    Args:
        path: the file.
        max_bytes: larger files are refused.
        is_what: what it should be, such as "a file of clicks", for the error message.

    Raises:
        InputError: it is a device or a socket, a pipe that nobody writes to, or too large.
        OSError: it cannot be read.
    """
    kind = special_kind(path)
    if kind is not None and kind != _PIPE:
        raise InputError(f"{path}: is {kind}, not {is_what}; give a regular file")
    if kind == _PIPE and not str(path).startswith(_SHELL_PIPES):
        data = _read_pipe(path, max_bytes + 1)
    else:
        with path.open("rb") as file:
            data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise InputError(f"{path}: larger than {max_bytes >> 20} MB, too large for {is_what}; is it the right file?")
    return data


def _read_pipe(path: Path, size: int) -> bytes:
    """Read a named pipe, if somebody begins to write to it soon: opening it would wait for a writer for ever.

    Raises:
        InputError: nobody does.
    """
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as pipe:
        if not select.select([pipe], [], [], _WRITER_TIMEOUT_S)[0]:
            raise InputError(f"{path}: is {_PIPE} that nobody writes to; give a regular file")
        os.set_blocking(pipe.fileno(), True)
        return pipe.read(size)


def file_text(data: bytes) -> str:
    """Decode UTF-8 with or without a byte order mark; lines end with a line feed.

    Raises:
        UnicodeDecodeError: it is not UTF-8.
    """
    return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def name_text(name: str | Path) -> str:
    """Return a file's name or path as text that any file and any page can hold: bytes that are not UTF-8 become `\\xff`."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def encodable(value: Any) -> Any:
    """Return strings, and lists and dicts of them, with everything that UTF-8 cannot hold shown as `\udcff`."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, dict):
        return {encodable(key): encodable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [encodable(item) for item in value]
    return value
