"""A job: a row of the manifest with what its result depends on, as one digest."""

import dataclasses
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.batch.manifest import ManifestRow
from app.resources import version

__all__ = ["Job", "job_of"]

_RESULT_VERSION = 1
"""Counts up when the same inputs give other files."""
_DIGITS = 32


@dataclass(frozen=True, slots=True)
class Job:
    """A session to be calibrated.

    Attributes:
        row: of the manifest.
        digest: of everything that the result depends on: the contents of all inputs, the settings, the program's version.
    """

    row: ManifestRow
    digest: str


def job_of(row: ManifestRow, digest_of_file: Callable[[Path], str]) -> Job:
    """Return the job of a row. Where files lie does not matter, only their names and contents.

    Args:
        row: of the manifest.
        digest_of_file: returns the sha256 of a file's content, or of a folder's; it may keep it.

    Raises:
        OSError: an input cannot be read.
    """
    settings: dict[str, Any] = {
        key: value for key, value in dataclasses.asdict(row).items() if key not in ("place", "recording")
    }
    files = {"recording": row.recording, "clicks": row.clicks, "camera": row.camera, "boxes": row.boxes}
    for key, given in files.items():
        paths = given if isinstance(given, tuple) else () if given is None else (given,)
        settings[key] = [(path.name, digest_of_file(path)) for path in paths]
    content = json.dumps([_RESULT_VERSION, version(), settings], sort_keys=True, default=str)
    return Job(row, hashlib.sha256(content.encode()).hexdigest()[:_DIGITS])
