"""The folder of results: one folder for each job, named by its digest, complete or absent."""

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from app.batch.outcome import Outcome, read_outcome

__all__ = ["OUTCOME_FILE", "ResultsFolder"]

OUTCOME_FILE = "outcome.json"
_RESULTS = "results"


@dataclass(frozen=True, slots=True)
class ResultsFolder:
    """Results that lie in a folder which driver and workers share.

    Attributes:
        path: holds `results/DIGEST/`.
    """

    path: Path

    def folder_of(self, digest: str) -> Path:
        """Return where the result of a job lies, or will lie."""
        return self.path / _RESULTS / digest

    def outcome(self, digest: str) -> Outcome | None:
        """Return what came of a job; None if it is not finished."""
        try:
            found = read_outcome((self.folder_of(digest) / OUTCOME_FILE).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, msgspec.DecodeError):
            return None
        return found if found.digest == digest else None

    @contextmanager
    def writing(self, digest: str) -> Iterator[Path]:
        """Give a folder to write a result into; it appears as a whole once the block has ended without an error.

        Raises:
            OSError: it cannot be written.
        """
        final = self.folder_of(digest)
        final.parent.mkdir(parents=True, exist_ok=True)
        unfinished = final.parent / f".{digest}.{secrets.token_hex(6)}"
        unfinished.mkdir()
        try:
            yield unfinished
            if final.is_dir():
                shutil.rmtree(final)
            unfinished.rename(final)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
