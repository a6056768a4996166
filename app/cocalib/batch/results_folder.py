"""The folder of results: one folder for each job, named by its digest, complete or absent."""

import errno
import hashlib
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from cocalib.batch.outcome import Outcome, OutcomeFile, read_outcome
from cocalib.batch.writers import Writer, is_abandoned

OUTCOME_FILE = "outcome.json"
LOG_FILE = "log.txt"
"""What only a developer needs; it differs from run to run, so the outcome does not list it."""
_RESULTS = "results"
_OCCUPIED = frozenset({errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR})
_ATTEMPTS = 50


@dataclass(frozen=True, slots=True)
class ResultsFolder:
    """Results that lie in a folder which drivers and workers share.

    A result is written under a hidden name and renamed as a whole. A power failure can still damage it, as the files are not
    flushed one by one: reading compares them with what the outcome lists, and a damaged result is no result.

    Attributes:
        path: holds `results/DIGEST/`.
    """

    path: Path

    def folder_of(self, digest: str) -> Path:
        """Return where the result of a job lies, or will lie."""
        return self.path / _RESULTS / digest

    def outcome(self, digest: str) -> Outcome | None:
        """Return what came of a job; None if it is to be run: it is not finished, damaged, or may go well another time."""
        folder = self.folder_of(digest)
        try:
            found = read_outcome((folder / OUTCOME_FILE).read_text(encoding="utf-8"))
            if found.digest != digest or not found.is_final:
                return None
            return found if all(_sha256(folder / file.name) == file.sha256 for file in found.files) else None
        except (OSError, ValueError, msgspec.DecodeError):
            return None

    @contextmanager
    def writing(self, digest: str) -> Iterator[Path]:
        """Give a folder to write a result into; it appears as a whole once the block has ended without an error.

        A final result that another process has written meanwhile stays; any other is replaced.

        Raises:
            OSError: it cannot be written.
        """
        writer = Writer.this()
        parent = self.folder_of(digest).parent
        parent.mkdir(parents=True, exist_ok=True)
        unfinished = parent / writer.folder_name(digest)
        unfinished.mkdir()
        try:
            yield unfinished
            self._put(unfinished, digest, writer)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)

    def remove_leftovers(self) -> int:
        """Remove what killed processes left unfinished; return how many folders."""
        parent = self.folder_of("")
        if not parent.is_dir():
            return 0
        left = [one for one in parent.iterdir() if one.name.startswith(".") and one.is_dir() and is_abandoned(one)]
        for folder in left:
            shutil.rmtree(folder, ignore_errors=True)
        return len(left)

    def _put(self, unfinished: Path, digest: str, writer: Writer) -> None:
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
            if old.is_dir():
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.unlink()
        raise OSError(errno.EBUSY, "other processes write it again and again", str(final))


def listed_files(folder: Path) -> tuple[OutcomeFile, ...]:
    """Return the files of a result with their sha256, in order of their names, without the outcome and the log."""
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return tuple(OutcomeFile(name, _sha256(folder / name)) for name in names if name not in (OUTCOME_FILE, LOG_FILE))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
