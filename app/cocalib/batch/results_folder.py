"""The folder of results: one folder for each job, named by its digest, complete or absent."""

import errno
import hashlib
import os
import re
import secrets
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Self, TypeVar

from calib_core.errors import InputError
from cocalib.batch.outcome import Outcome, OutcomeFile, read_outcome
from cocalib.session.file.guarded_folder import GuardedFolder

_Content = TypeVar("_Content")

OUTCOME_FILE = "outcome.json"
LOG_FILE = "log.txt"
"""What only a developer needs; it differs from run to run, so the outcome does not list it."""
RESULTS = "results"
_OCCUPIED = frozenset({errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR})
_ATTEMPTS = 50
_ADVICE = "name another folder of results"
_UNFINISHED = re.compile(
    r"\.(?P<digest>[^.]+)\.(?P<place>[0-9a-f]{12})-(?P<process>\d+)-(?P<begin>\d+)\.(?P<token>[0-9a-f]+)"
)
_PATIENCE_S = 3600.0
"""A result is written in seconds, once everything in it is computed."""


@dataclass(frozen=True, slots=True)
class ResultsFolder:
    """Results that lie in a folder which drivers and workers share, with what else the program keeps there.

    Below the folder no link is followed, and only regular files are read and written: whoever can write there could put a link to
    a file elsewhere, a pipe or a device under the name of one.

    A result is written under a hidden name and renamed as a whole. A power failure can still damage it, as the files are not
    flushed one by one: reading compares them with what the outcome lists, and a damaged result is no result.

    Attributes:
        path: holds `results/DIGEST/`.
    """

    path: Path

    def folder_of(self, digest: str) -> Path:
        """Return where the result of a job lies, or will lie."""
        return self.path / RESULTS / digest

    def outcome(self, digest: str) -> Outcome | None:
        """Return what came of a job; None if it is to be run: it is not finished, damaged, or may go well another time.

        Raises:
            CalibrationError: one of its files is no regular file, or a folder above it is a link; nothing was changed.
        """
        try:
            outcome = read_outcome((self.read(RESULTS, digest, OUTCOME_FILE) or b"").decode())
            if outcome.digest != digest or not outcome.is_final:
                return None
            return outcome if all(self._sha256(digest, file.name) == file.sha256 for file in outcome.files) else None
        except (OSError, ValueError, InputError):
            return None

    def read_as(self, parse: Callable[[str], _Content], *names: str, schema: str, hint: str) -> _Content | None:
        """Return what a file states; None if there is none.

        Args:
            parse: reads its text, or raises InputError.
            names: of the folders below this one, and its own.
            schema: that it should have.
            hint: what to do about a file that is something else.

        Raises:
            CalibrationError: it cannot be read.
        """
        place = "/".join(names)
        try:
            content = self.read(*names)
            return None if content is None else parse(content.decode())
        except OSError as error:
            raise InputError(f"{place}: {error.strerror or error}; check its permissions") from error
        except (UnicodeDecodeError, InputError) as error:
            raise InputError(f"{place}: is no {schema}: {error}; {hint}") from error

    def read(self, *names: str) -> bytes | None:
        """Return the content of a file, by the names of the folders below this one and its own; None if there is none.

        Raises:
            CalibrationError: it is not a regular file, or a folder above it is a link; it was not read.
            OSError: it cannot be read.
        """
        try:
            with self._open_below(*names[:-1]) as folder:
                return folder.read(names[-1])
        except (FileNotFoundError, NotADirectoryError):
            return None

    def write(self, *names: str, data: bytes) -> None:
        """Create or replace a file in one step, and the folders above it.

        Args:
            names: of the folders below this one, and its own.
            data: its content.

        Raises:
            CalibrationError: what has this name is not a regular file, or a folder above it is a link; nothing was written.
            OSError: it cannot be written.
        """
        with self._open_below(*names[:-1], create=True) as folder:
            folder.replace(names[-1], data)

    @contextmanager
    def _open_below(self, *names: str, create: bool = False) -> Iterator[GuardedFolder]:
        """Open a folder below this one; none of the names may be a link."""
        here = self.path.resolve()
        if not create:
            here.stat()
        with ExitStack() as opened:
            folder = opened.enter_context(closing(GuardedFolder(here, create=create, shared=True, advice=_ADVICE)))
            for name in names:
                folder = opened.enter_context(closing(folder.subfolder(name, create=create)))
            yield folder

    @contextmanager
    def writing(self, digest: str) -> Iterator[Path]:
        """Give a folder to write a result into; it appears as a whole once the block has ended without an error.

        A final result that another process has written meanwhile stays; any other is replaced.

        Raises:
            CalibrationError: the folder for it is a link.
            OSError: it cannot be written.
        """
        writer = Writer.this()
        with self._open_below(RESULTS, create=True):
            parent = self.folder_of(digest).parent
        unfinished = parent / writer.folder_name(digest)
        unfinished.mkdir()
        try:
            yield unfinished
            self._put_in_place(unfinished, digest, writer)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)

    def remove_leftovers(self) -> int:
        """Remove what killed processes left unfinished; return how many folders.

        Raises:
            CalibrationError: the folder for results is a link.
        """
        parent = self.folder_of("")
        if not parent.is_dir():
            return 0
        with self._open_below(RESULTS):
            left = [
                one for one in parent.iterdir() if one.name.startswith(".") and _is_folder(one) and is_abandoned(one)
            ]
            for folder in left:
                shutil.rmtree(folder, ignore_errors=True)
        return len(left)

    def _put_in_place(self, unfinished: Path, digest: str, writer: "Writer") -> None:
        """Give a result its name. A folder of that name is moved away first; another process may do the same."""
        final = self.folder_of(digest)
        for _ in range(_ATTEMPTS):
            try:
                unfinished.rename(final)
                return
            except OSError as error:
                if error.errno not in _OCCUPIED:
                    raise
            if self.outcome(digest) is not None:
                return
            old = final.parent / writer.folder_name(digest)
            try:
                final.rename(old)
            except FileNotFoundError:
                continue
            if _is_folder(old):
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.unlink()
        raise OSError(errno.EBUSY, "other processes write it again and again", str(final))

    def _sha256(self, digest: str, name: str) -> str:
        *folders, last = name.split("/")
        with (
            self._open_below(RESULTS, digest, *folders) as folder,
            os.fdopen(folder.open(last, os.O_RDONLY), "rb") as file,
        ):
            return _sha256(file)


def listed_files(folder: Path) -> tuple[OutcomeFile, ...]:
    """Return the files of a result with their sha256, in order of their names, without the outcome and the log."""
    found = []
    for path in sorted(folder.rglob("*"), key=lambda path: path.relative_to(folder).as_posix()):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and name not in (OUTCOME_FILE, LOG_FILE):
            with path.open("rb") as file:
                found.append(OutcomeFile(name, _sha256(file)))
    return tuple(found)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _sha256(file: BufferedReader) -> str:
    return hashlib.file_digest(file, "sha256").hexdigest()


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
    named = _UNFINISHED.fullmatch(folder.name)
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
    return hashlib.sha256(f"{boot} {space}".encode()).hexdigest()[:12]


def _begin(process: int) -> int | None:
    """Return when a process began; None if there is none of this number."""
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return int(status.rpartition(")")[2].split()[19])
