"""What a command writes: one rule for every output, and each file is whole or not there at all.

- Never a file that is read, by whatever name: `keep` says which those are.
- A foreign file, or one of another kind, is replaced only with --force, and not below a folder that is read.
- A link is followed if what it leads to passes the same rule; one that leads nowhere is refused.
- A pipe or a device is written to, never replaced; a disk is refused.
"""

import errno
import os
import secrets
import shutil
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from calib_core.errors import InputError
from calib_core.file_tag import OTHER_KIND, kind_of

_PATIENCE_S = 2.0
_END_BYTES = 1 << 14
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_kept: ContextVar[tuple[Path, ...]] = ContextVar("kept", default=())
_forced: ContextVar[bool] = ContextVar("forced", default=False)


@contextmanager
def keeping(paths: Iterable[Path], *, force: bool) -> Iterator[None]:
    """Keep files from being written over while a command runs.

    Args:
        paths: files and folders that it reads.
        force: whether files of other programs may be replaced.
    """
    kept, forced = _kept.set(tuple(paths)), _forced.set(force)
    try:
        yield
    finally:
        _kept.reset(kept)
        _forced.reset(forced)


def keep(paths: Iterable[Path]) -> None:
    """Keep more files and folders that are read from being written over."""
    _kept.set((*_kept.get(), *paths))


def writable(path: Path, kind: str | None = OTHER_KIND) -> Path:
    """Return where an output goes if it may be written there, by the rule above.

    Args:
        path: as the user names it.
        kind: of what is to be written; None for any kind of ours.

    Raises:
        InputError: it may not.
        OSError: it cannot be examined.
    """
    if path.is_symlink() and not path.exists():
        raise InputError(f"{path}: is a link that leads to nothing; remove it, or name another file")
    target = path.resolve()
    try:
        there = path.stat()
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; create it first") from None
        return target
    if fault := _fault(target, there, kind):
        raise InputError(f"{path}: {fault}")
    return target if stat.S_ISREG(there.st_mode) else path


def _fault(target: Path, there: os.stat_result, kind: str | None) -> str:
    """Say why what is there may not be written over; "" if it may."""
    if any(_is_same(there, kept) for kept in _kept.get()):
        return "is also an input, which is never changed; choose another name for the output"
    if stat.S_ISDIR(there.st_mode):
        return "is a folder; name a file in it"
    if stat.S_ISBLK(there.st_mode):
        return "is a disk; name a file"
    if not stat.S_ISREG(there.st_mode) or not there.st_size or _is_ours(target, kind):
        return ""
    if any(kept.is_dir() and target.is_relative_to(kept.resolve()) for kept in _kept.get()):
        return "holds something else, in a folder that is read; choose another name"
    if not _forced.get():
        return "holds something else, which is not overwritten; choose another name, or replace it with --force"
    return ""


def require_writable(path: Path) -> None:
    """Refuse an output that may not be written, before the work for it begins.

    Raises:
        InputError: it may not.
    """
    with _explained(path):
        writable(path, None)


def _is_same(there: os.stat_result, kept: Path) -> bool:
    try:
        return not kept.is_dir() and os.path.samestat(there, kept.stat())
    except OSError:
        return False


def _is_ours(target: Path, kind: str | None) -> bool:
    with target.open("rb") as file:
        ends = file.read(_END_BYTES)
        file.seek(max(len(ends), target.stat().st_size - _END_BYTES))
        found = kind_of(ends + file.read(_END_BYTES))
    return bool(found) and kind in (None, found)


def write_whole(path: Path, content: str | bytes, *, again: bool = False) -> None:
    """Write a file in one step, durable across a crash: a reader finds the old or the new content, never a part.

    Args:
        path: of the file.
        content: of it.
        again: it is a file that was read and is changed on demand: it keeps its mode and owner, and a read-only one is refused.

    Raises:
        InputError: it may not or cannot be written; the old file stays.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    with _explained(path):
        if again:
            _rewrite(path.resolve(), data)
            return
        target = writable(path, kind_of(data))
        if target.exists() and not target.is_file():
            _write_into(target, data)
        else:
            replace_file(target, data)


def write_all(files: Mapping[Path, bytes]) -> None:
    """Write files that belong together: all, or none if one of them may not or cannot be written.

    Raises:
        InputError: one may not or cannot be written.
    """
    if len(files) == 1:  # which may be a pipe
        ((path, data),) = files.items()
        write_whole(path, data)
        return
    with ExitStack() as parts:
        for path, data in files.items():
            parts.enter_context(whole_path(path, kind_of(data))).write_bytes(data)


@contextmanager
def writing_whole(path: Path) -> Iterator[BinaryIO]:
    """Write a file of any size in one step: it takes its name once it is complete, and nothing is left if it is not.

    Raises:
        InputError: it may not or cannot be written; the old file stays.
    """
    with whole_path(path) as temporary, temporary.open("wb", buffering=1 << 20) as file:
        yield file


@contextmanager
def whole_path(path: Path, kind: str = OTHER_KIND) -> Iterator[Path]:
    """Yield a name to write a file to by other means, with its suffix; it takes its own name as in `writing_whole`.

    Args:
        path: of the file.
        kind: of what is to be written.

    Raises:
        InputError: it may not or cannot be written; the old file stays.
    """
    with _explained(path):
        target = _regular(path, kind)
        temporary = target.with_name(f".{target.stem}.{secrets.token_hex(6)}.part{target.suffix}")
        try:
            temporary.touch(exist_ok=False)
            yield temporary
            with temporary.open("rb") as file:
                os.fsync(file.fileno())
            temporary.replace(_regular(path, kind))
        finally:
            temporary.unlink(missing_ok=True)
        _sync_folder(target.parent)


def _regular(path: Path, kind: str) -> Path:
    target = writable(path, kind)
    if target.exists() and not target.is_file():
        raise InputError(f"{path}: is not a regular file; name a file")
    return target


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to write into, whose content moves to a new or empty folder at the end; nothing is left if that fails.

    Raises:
        InputError: there is something else of its name, or it cannot be written.
    """
    if os.path.lexists(path) and not (path.is_dir() and not any(path.iterdir())):
        raise InputError(f"{path}: not an empty folder; choose an empty or a new one")
    made = [one for one in (path, *path.parents) if not one.exists()]
    part = path / f".{secrets.token_hex(6)}.part"
    with _explained(path):
        try:
            part.mkdir(parents=True)
            yield part
            for inner in sorted(part.iterdir()):
                inner.rename(path / inner.name)
        finally:
            shutil.rmtree(part, ignore_errors=True)
            for folder in made:
                if folder.is_dir() and not any(folder.iterdir()):
                    folder.rmdir()


def require_room(path: Path, size_bytes: float) -> None:
    """Refuse an output for which there is too little room on its disk.

    Args:
        path: of the file or folder.
        size_bytes: about what it needs.

    Raises:
        InputError: less is free.
    """
    place = next(parent for parent in path.absolute().parents if parent.is_dir())
    free_bytes = shutil.disk_usage(path if path.is_dir() else place).free
    if free_bytes < size_bytes:
        raise InputError(
            f"{path}: needs about {size_bytes / 1e9:.3g} GB, and {free_bytes / 1e9:.3g} GB are free there; free some space, "
            "or write to another disk"
        )


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Say which output could not be written, and why."""
    try:
        yield
    except OSError as error:
        step = "; nothing was left behind. Free some space, or write to another disk" if error.errno in _FULL else ""
        raise InputError(f"{path}: cannot be written: {error.strerror or error}{step}") from error


def replace_file(path: Path, data: bytes, *, like: os.stat_result | None = None) -> None:
    """Replace or create a file of ours in one step, durable across a crash; a link is replaced, not followed.

    Args:
        path: of the file.
        data: its content.
        like: whose mode and owner it gets; None for those of a new file.

    Raises:
        OSError: it cannot be written; the old file stays.
    """
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


def _rewrite(path: Path, data: bytes) -> None:
    before = path.stat()
    if not before.st_mode & 0o222 or not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "is read-only; make it writable, or write a copy: --out FILE", str(path))
    replace_file(path, data, like=before)


def _take_over(path: Path, like: os.stat_result) -> None:
    """Give a file the owner and mode of another."""
    own = path.stat()
    if (own.st_uid, own.st_gid) != (like.st_uid, like.st_gid):
        os.chown(path, like.st_uid, like.st_gid)
    path.chmod(stat.S_IMODE(like.st_mode))


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
