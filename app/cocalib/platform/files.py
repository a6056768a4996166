"""Files that a user names: what is written is whole, so that a reader never finds a part of it."""

import errno
import os
import secrets
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_PATIENCE_S = 2.0


def rewrite_whole(path: Path, data: bytes) -> None:
    """Replace a file as `write_whole` does, and keep its mode and owner.

    Raises:
        OSError: it is read-only, or cannot be written or given to its owner; the old file stays.
    """
    before = path.stat()
    if not before.st_mode & 0o222 or not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "is read-only; make it writable, or write a copy: --out FILE", str(path))
    write_whole(path, data, like=before)


def write_whole(path: Path, data: bytes, *, like: os.stat_result | None = None) -> None:
    """Replace or create a file in one step, durable across a crash.

    A symbolic link is followed. A device or a pipe is written to, never replaced.

    Args:
        path: of the file.
        data: its content.
        like: whose mode and owner it gets; None for those of a new file.

    Raises:
        OSError: it cannot be written; the old file stays.
    """
    path = path.resolve()
    if path.exists() and not path.is_file() and not path.is_dir():
        _write_into(path, data)
        return
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder; name a file in it", str(path))
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, f"the folder {path.parent} does not exist; create it", str(path))
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(6)}")
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if like is not None:
            _take_over(temporary, like)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _take_over(path: Path, like: os.stat_result) -> None:
    """Give a file the owner and mode of another."""
    own = path.stat()
    if (own.st_uid, own.st_gid) != (like.st_uid, like.st_gid):
        os.chown(path, like.st_uid, like.st_gid)
    path.chmod(stat.S_IMODE(like.st_mode))


@contextmanager
def writing_whole(path: Path) -> Iterator[BinaryIO]:
    """Write a file of any size in one step: it takes its name once it is complete, and nothing is left if it is not.

    A symbolic link is followed.

    Raises:
        OSError: it cannot be written; the old file stays.
    """
    with whole_path(path) as temporary, temporary.open("wb", buffering=1 << 20) as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def whole_path(path: Path) -> Iterator[Path]:
    """Yield a name to write a file to by other means; it takes its own name at the end, and nothing is left if that fails.

    A symbolic link is followed. The name yielded has the suffix of the file's own.

    Raises:
        OSError: it cannot be written; the old file stays.
    """
    path = path.resolve()
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "is not a regular file; name a file", str(path))
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, f"the folder {path.parent} does not exist; create it", str(path))
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(6)}.part{path.suffix}")
    try:
        temporary.touch(exist_ok=False)
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _write_into(path: Path, data: bytes) -> None:
    """Write to a device or a pipe; one that nobody reads is refused after a while, not waited for for ever."""
    until_s = time.monotonic() + _PATIENCE_S
    while True:
        try:
            descriptor = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
            break
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() > until_s:  # its reader may have been started together with us
                raise OSError(errno.ENXIO, "nobody reads from this pipe or socket; name a file", str(path)) from error
            time.sleep(0.02)
    with os.fdopen(descriptor, "wb") as file:
        os.set_blocking(descriptor, True)
        file.write(data)


def _sync_folder(folder: Path) -> None:
    """Flush the folder, so that the file's name is as durable as its content; Windows needs no such step."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
