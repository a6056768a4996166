"""Files that are read as input: only regular files, never more than a limit, and names that every encoder takes."""

import os
import re
import select
import stat
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from calib_core.errors import InputError

_SHELL_PIPES = ("/dev/fd/", "/proc/self/fd/", "/dev/stdin")
"""Where a shell puts what `<(command)` writes: there is a writer, so reading it ends."""
_PIPE = "a named pipe (FIFO)"
_WRITER_TIMEOUT_S = 5.0
MAX_TEXT_BYTES = 64 << 20
_BEGINNINGS = {
    **dict.fromkeys(
        (b"#ROSBAG", b"\x89MCAP", b"SQLite format 3"), "a recording; give it as RECORDING, or with --recording"
    ),
    b"PK": "an archive or a spreadsheet; unpack it, or save it as CSV",
    b"\x89PNG": "an image",
    b"\x93NUMPY": "an array of another shape; save camera_from_radar as a 4x4 array",
    b"\xff\xd8\xff": "an image",
}
_USES = {
    "calibration-1": "give it with --calibration FILE (evaluate: as CALIBRATION, first); solve it again with --pairs FILE",
    "clicks-1": "give them with their recording: cocalib solve (or open) RECORDING --clicks FILE",
    "pairs-1": "solve them without a recording: cocalib solve --pairs FILE",
    "proposals-1": "confirm them on the page, or copy the clicks that you have looked at into a clicks-1 file",
    "boxes-1": "give it with --boxes FILE",
    "labels-1": "give it with --labels FILE",
}
"""What our own files are for, by their schema."""


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


def no_such(path: Path, *, if_missing: str = "") -> str:
    """Say that there is nothing of this name, and what to do: unless told, the name in its folder that looks like it."""
    try:
        near = get_close_matches(
            path.name, [] if if_missing else [one.name for one in path.parent.iterdir()], n=1, cutoff=0.75
        )
    except OSError:
        near = []
    if re.match(r"\w{2,}:/", str(path)):
        return f"{name_text(path)}: is an address; copy it to this machine first"
    step = f"did you mean {name_text(path.with_name(near[0]))}?" if near else if_missing or "check the path"
    return f"{name_text(path)}: no such file or folder; {step}"


def other_kind(schema: object, wanted: str) -> str:
    """Say that a file is another one of ours than the one wanted, and what it is for; "" if it is not known to be ours."""
    use = _USES.get(str(schema).removeprefix("cocalib/"))
    return f"this is a {schema} file, not {wanted}; {use}" if use else ""


def read_input(path: Path, *, max_bytes: int, is_what: str, if_missing: str = "") -> bytes:
    """Read a small file whole; a pipe that somebody writes to, such as the shell's `<(command)`, may be read too, once.

    Args:
        path: the file.
        max_bytes: larger files are refused.
        is_what: what it should be, such as "a file of clicks", for the error message.
        if_missing: what to do then; by default, the name that looks like it.

    Raises:
        InputError: it is missing, a folder, a device or a socket, a pipe that nobody writes to, unreadable, or too large.
    """
    try:
        kind = special_kind(path)
        if kind is not None and kind != _PIPE:
            raise InputError(f"{path}: is {kind}, not {is_what}; give a regular file")
        if kind == _PIPE and not str(path).startswith(_SHELL_PIPES):
            data = _read_pipe(path, max_bytes + 1)
        else:
            with path.open("rb") as file:
                data = file.read(max_bytes + 1)
    except FileNotFoundError:
        raise InputError(no_such(path, if_missing=if_missing)) from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder, not {is_what}; name a file in it") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}; check its permissions") from None
    if len(data) > max_bytes:
        limit = f"{max_bytes >> 20} MB" if max_bytes >> 20 else f"{max_bytes >> 10} kB"
        raise InputError(f"{path}: larger than {limit}, too large for {is_what}; is it the right file?")
    return data


def read_text(
    path: Path, *, is_what: str = "a file of clicks or pairs", max_bytes: int = MAX_TEXT_BYTES, if_missing: str = ""
) -> str:
    """Read a small text file; the arguments and errors are those of `read_input`.

    Raises:
        InputError: it cannot be read, or is not text.
    """
    return text_of(read_input(path, max_bytes=max_bytes, is_what=is_what, if_missing=if_missing), str(path), is_what)


def text_of(data: bytes, source: str, is_what: str) -> str:
    """Return the text of a file's content.

    Raises:
        InputError: it is not text.
    """
    try:
        return file_text(data)
    except UnicodeDecodeError:
        raise InputError(f"{source}: {no_text(data, is_what)}") from None


def is_known_binary(data: bytes) -> bool:
    """Return whether a file's first bytes are those of a kind that is no text."""
    return data.startswith(tuple(_BEGINNINGS))


def no_text(data: bytes, wanted: str) -> str:
    """Say that a file is not text, and what it is by its first bytes."""
    kind = next((kind for beginning, kind in _BEGINNINGS.items() if data.startswith(beginning)), "")
    is_what, _, step = kind.partition("; ")
    if not kind:
        return f"not a text file in UTF-8; give {wanted}, or save it as UTF-8"
    return f"not a text file but {is_what}; {step or f'give {wanted}'}"


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
    r"""Return strings, and lists and dicts of them, with everything that UTF-8 cannot hold shown as `\udcff`."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, dict):
        return {encodable(key): encodable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [encodable(item) for item in value]
    return value
