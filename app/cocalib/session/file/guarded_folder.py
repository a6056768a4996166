"""A folder whose files are opened without following links, and only if they are regular files of this user.

Whoever can write next to a recording can put a link, a pipe or someone else's file where a session file belongs. None of them
is read, written or waited for. Folders of results are read and written like this, too; their files may be of other users.
`FolderLock` lets one process have a session open: the operating system releases it when the process dies.
"""

import copy
import errno
import os
import secrets
import socket
import stat
import sys
from contextlib import suppress
from pathlib import Path

from calib_core.errors import CalibrationError


class SessionFileError(CalibrationError):
    """A session that cannot be opened, read or written; what is on disk is unchanged."""


_SAFELY = (
    getattr(os, "O_NOFOLLOW", 0)
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_CLOEXEC", 0)
    | getattr(os, "O_BINARY", 0)
)
_FOLDER = getattr(os, "O_DIRECTORY", 0) | _SAFELY
_BY_DESCRIPTOR = {os.open, os.stat, os.rename, os.unlink} <= os.supports_dir_fd and os.listdir in os.supports_fd
_MAX_BYTES = 1 << 28
_KINDS = {
    stat.S_IFLNK: "a symbolic link",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
    stat.S_IFREG: "a file",
}
_WINDOWS_LINKS = (getattr(stat, "IO_REPARSE_TAG_SYMLINK", -1), getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", -1))


class GuardedFolder:
    """A folder that stays the same one while it is open, even if its name is given to another."""

    def __init__(
        self, path: Path, *, create: bool = False, shared: bool = False, advice: str = "give another --session folder"
    ) -> None:
        """Open a folder.

        Args:
            path: the folder.
            create: make it if it is missing.
            shared: folder and files may be of other users, and have several names (hard links).
            advice: what else the user can do where a file is refused.

        Raises:
            SessionFileError: it is a link, no folder, of another user, missing, or cannot be created.
        """
        self.path, self._shared, self._advice = path, shared, advice
        self._descriptor: int | None = None
        try:
            if create and not os.path.lexists(path):
                path.mkdir(parents=True, exist_ok=True)
            if not shared and (fault := _folder_fault(path)):
                raise SessionFileError(f"{path}: {fault}")
            if _BY_DESCRIPTOR:
                self._descriptor = os.open(path, os.O_RDONLY | _FOLDER)
                if not shared and (fault := _foreign(os.fstat(self._descriptor))):  # exchanged in the meantime
                    self.close()
                    raise SessionFileError(f"{path}: {fault}")
        except OSError as error:
            what = "cannot be created" if create else "cannot be opened"
            raise SessionFileError(f"{path}: {what}: {error.strerror}; {advice}") from error

    def subfolder(self, name: str, *, create: bool = False) -> "GuardedFolder":
        """Open a folder in this one.

        Args:
            name: of the folder.
            create: make it if it is missing.

        Raises:
            SessionFileError: it is a link, or of another user.
            OSError: it is missing, no folder, or cannot be created.
        """
        if name in ("", ".", "..") or name != Path(name).name:
            raise self._refusal(name, "is not the name of a folder in it")
        if create:
            with suppress(FileExistsError):
                os.mkdir(self._at(name), dir_fd=self._descriptor)
        found = os.stat(self._at(name), dir_fd=self._descriptor, follow_symlinks=False)
        if _is_link(found):
            raise self._refusal(name, "is a symbolic link, which is not followed")
        if not self._shared and (fault := _foreign(found)):
            raise self._refusal(name, fault)
        below = copy.copy(self)
        below.path = self.path / name
        if self._descriptor is not None:
            below._descriptor = os.open(name, os.O_RDONLY | _FOLDER, dir_fd=self._descriptor)
        return below

    def open(self, name: str, flags: int) -> int:
        """Open a file of the folder and return its descriptor.

        Args:
            name: of the file.
            flags: as for os.open.

        Raises:
            SessionFileError: it is not a regular file of this user with one name; it was neither read nor written.
            OSError: it is missing or cannot be opened.
        """
        self._require_plain(name)
        descriptor = os.open(self._at(name), flags | _SAFELY, 0o666, dir_fd=self._descriptor)
        if fault := self._file_fault(os.fstat(descriptor)):
            os.close(descriptor)
            raise self._refusal(name, fault)
        return descriptor

    def read(self, name: str, *, at_most: int | None = None) -> bytes | None:
        """Return the content of a file; None if there is none.

        Args:
            name: of the file.
            at_most: read only so many bytes.

        Raises:
            SessionFileError: as for `open`, or it is too large.
            OSError: it cannot be read.
        """
        try:
            descriptor = self.open(name, os.O_RDONLY)
        except FileNotFoundError:
            return None
        try:
            return self.read_open(name, descriptor, at_most=at_most)
        finally:
            os.close(descriptor)

    def read_open(self, name: str, descriptor: int, *, at_most: int | None = None) -> bytes:
        """Return the content of an open file.

        Raises:
            SessionFileError: it is too large.
            OSError: it cannot be read.
        """
        if (size := os.fstat(descriptor).st_size) > _MAX_BYTES:
            raise self._refusal(name, f"has {size / 1e6:.0f} MB, which is too large")
        rest, parts = size if at_most is None else min(size, at_most), []
        os.lseek(descriptor, 0, os.SEEK_SET)
        while rest > 0 and (part := os.read(descriptor, rest)):
            parts.append(part)
            rest -= len(part)
        return b"".join(parts)

    def replace(self, name: str, data: bytes) -> None:
        """Create or replace a file in one step, durable across a crash.

        Raises:
            SessionFileError: what has this name now is not a regular file of this user.
            OSError: it cannot be written; the old file stays.
        """
        self._require_plain(name)
        temporary = f".{name}.{secrets.token_hex(6)}"
        self.create(temporary, data)
        try:
            os.replace(self._at(temporary), self._at(name), src_dir_fd=self._descriptor, dst_dir_fd=self._descriptor)
        except OSError:
            os.unlink(self._at(temporary), dir_fd=self._descriptor)
            raise
        self._sync()

    def create(self, name: str, data: bytes) -> None:
        """Write a new file.

        Raises:
            OSError: there is one, or it cannot be written; nothing is left of it.
        """
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _SAFELY
        descriptor = os.open(self._at(name), flags, 0o666, dir_fd=self._descriptor)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fsync(descriptor)
        except OSError:
            os.unlink(self._at(name), dir_fd=self._descriptor)
            raise
        finally:
            os.close(descriptor)

    def back_up(self, name: str) -> str | None:
        """Copy a file under the next free name, and return that; None if there is no such file.

        Raises:
            SessionFileError: as for `open`.
            OSError: it cannot be read or copied.
        """
        data = self.read(name)
        if data is None:
            return None
        number = 1
        while True:
            kept = f"{name}.backup-{number}"
            try:
                self.create(kept, data)
            except FileExistsError:
                number += 1
                continue
            self._sync()
            return kept

    def identity(self, name: str) -> tuple[int, ...] | None:
        """Return what changes when another program replaces or changes a file; None if there is none."""
        try:
            found = os.stat(self._at(name), dir_fd=self._descriptor, follow_symlinks=False)
        except OSError:
            return None
        return (found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)

    def is_in_place(self) -> bool:
        """Return whether the folder's path still leads to it."""
        try:
            here = self.path.lstat()
            opened = here if self._descriptor is None else os.fstat(self._descriptor)
        except OSError:
            return False
        return (here.st_dev, here.st_ino) == (opened.st_dev, opened.st_ino)

    def changed_at_s(self, name: str) -> float | None:
        """Return when a file was last changed, in seconds since the epoch; None if there is none."""
        try:
            return os.stat(self._at(name), dir_fd=self._descriptor, follow_symlinks=False).st_mtime
        except OSError:
            return None

    def has(self, name: str, descriptor: int) -> bool:
        """Return whether the folder's path still leads to it, and the name to the file that is open."""
        try:
            here, opened = (self.path / name).lstat(), os.fstat(descriptor)
        except OSError:
            return False
        return (here.st_dev, here.st_ino) == (opened.st_dev, opened.st_ino)

    def close(self) -> None:
        """Close the folder."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def _at(self, name: str) -> str:
        return name if self._descriptor is not None else str(self.path / name)

    def _require_plain(self, name: str) -> None:
        """Refuse what is certainly no session file before opening it; `open` checks again what it has opened."""
        try:
            found = os.stat(self._at(name), dir_fd=self._descriptor, follow_symlinks=False)
        except FileNotFoundError:
            return
        if fault := self._file_fault(found):
            raise self._refusal(name, fault)

    def _file_fault(self, found: os.stat_result) -> str:
        """Return why this is not a regular file of this user with one name; "" if it is."""
        if _is_link(found) or not stat.S_ISREG(found.st_mode):
            kind = "a symbolic link" if _is_link(found) else _KINDS.get(stat.S_IFMT(found.st_mode), "a device")
            return f"is {kind}, not a file"
        if self._shared:
            return ""
        if found.st_nlink > 1:
            return f"has {found.st_nlink} names (hard links), so that other places would change with it"
        return _foreign(found)

    def _refusal(self, name: str, fault: str) -> SessionFileError:
        return SessionFileError(
            f"{self.path / name}: {fault}; it was neither read nor changed. Move it out of the folder, or {self._advice}"
        )

    def _sync(self) -> None:
        """Flush the folder, so that a file's name is as durable as its content; Windows needs no such step."""
        if self._descriptor is not None:
            os.fsync(self._descriptor)


def _folder_fault(path: Path) -> str:
    """Return why a path is not a folder of this user, and what to do; "" if it is one.

    Raises:
        OSError: there is nothing, or it cannot be looked at.
    """
    found = os.lstat(path)
    if _is_link(found):
        return "is a symbolic link, which is not followed; give the folder itself with --session"
    if not stat.S_ISDIR(found.st_mode):
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    if fault := _foreign(found):
        return f"{fault}; copy it to a folder of your own, and give that with --session"
    return ""


def _is_link(found: os.stat_result) -> bool:
    return stat.S_ISLNK(found.st_mode) or getattr(found, "st_reparse_tag", 0) in _WINDOWS_LINKS


def _foreign(found: os.stat_result) -> str:
    """Return whose it is, if not this user's; Windows tells no owner here."""
    if not hasattr(os, "geteuid") or found.st_uid == os.geteuid():
        return ""
    return f"belongs to user {found.st_uid}, not to you (user {os.geteuid()})"


LOCK = "lock"
_LOCKED_BYTE = 1 << 20  # far past the text: Windows does not allow reading a locked byte


class FolderLock:
    """Holds `lock` in a folder from construction to `close`."""

    def __init__(self, folder: GuardedFolder) -> None:
        path = folder.path / LOCK
        try:
            self._descriptor = folder.open(LOCK, os.O_RDWR | os.O_CREAT)
        except OSError as error:
            raise SessionFileError(
                f"{path}: cannot be written: {error.strerror}; give another --session folder"
            ) from error
        try:
            _lock(self._descriptor)
        except OSError as error:
            holder = _holder(self._descriptor)
            os.close(self._descriptor)
            if not isinstance(error, BlockingIOError | PermissionError):
                raise SessionFileError(
                    f"{path}: this file system has no file locks: {error.strerror}; give a --session folder on a local disk"
                ) from error
            raise SessionFileError(
                f"{folder.path}: the session is already open in {holder}; "
                "use that page, close it, or give another --session folder"
            ) from None
        os.ftruncate(self._descriptor, 0)
        os.write(self._descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())

    def close(self) -> None:
        """Release the lock; the file stays, since deleting it would race with the next holder."""
        descriptor, self._descriptor = self._descriptor, -1  # never closed twice: the number may be reused
        if descriptor >= 0:
            os.close(descriptor)


def lock_holder(folder: GuardedFolder) -> str:
    """Return which process has the session open; "" if none has.

    Raises:
        SessionFileError: `lock` is not a regular file of this user.
        OSError: it cannot be opened.
    """
    try:
        descriptor = folder.open(LOCK, os.O_RDONLY)
    except FileNotFoundError:
        return ""
    try:
        _lock(descriptor)
    except OSError:
        return _holder(descriptor)
    else:
        return ""
    finally:
        os.close(descriptor)


def _holder(descriptor: int) -> str:
    text = os.read(descriptor, 200).decode("utf-8", "replace")
    return "".join(letter for letter in text if letter.isprintable()) or "another process"


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(descriptor, 0, os.SEEK_SET)

else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
