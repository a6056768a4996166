"""One process per session: a lock that the operating system releases when the process dies."""

import os
import socket
import sys

from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder

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
