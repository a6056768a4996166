"""A job: a row of the manifest with what its result depends on, as one digest."""

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cocalib.batch.inputs import InputDigests, InputPath, inputs_of, state_of
from cocalib.batch.manifest import ManifestRow
from cocalib.platform.resources import version

_RESULT_VERSION = 2
"""Counts up when the same inputs give other files."""
_DIGITS = 32
_SINGLE = ("clicks", "camera", "boxes")
_UNREAD = "cannot be read"


@dataclass(frozen=True, slots=True)
class Job:
    """A session to be calibrated.

    Attributes:
        row: of the manifest, with absolute paths.
        digest: of everything that the result depends on: the contents of all inputs, the settings, the program's version.
        state: of the inputs when the digest was made: their sizes and times; empty if nobody looked.
    """

    row: ManifestRow
    digest: str
    state: str = ""


def jobs_of(
    rows: Sequence[ManifestRow], results: Path, progress: Callable[[int, int], None] | None = None
) -> tuple[Job, ...]:
    """Return the jobs of rows, in their order; only inputs that changed since the last time are read.

    Args:
        rows: of the manifest.
        results: the folder of results, where the digests of inputs are kept.
        progress: called with the bytes read and their number.

    Raises:
        OSError: the folder of results cannot be written.
    """
    digests = InputDigests(results, progress)
    digests.expect([one for row in rows for one in inputs_of(row)])
    try:
        return tuple(job_of(row, digests.digest) for row in rows)
    finally:
        digests.save()


def job_of(row: ManifestRow, digest_of: Callable[[InputPath], str]) -> Job:
    """Return the job of a row. Where files lie does not matter, only their names and contents.

    An input that cannot be read makes another digest than any content: running the job says what is wrong.

    Args:
        row: of the manifest.
        digest_of: returns the digest of an input's content; it may keep it.
    """
    row = _with_absolute_paths(row)
    inputs = inputs_of(row)
    state = state_of(inputs)
    paths = {"place", "recording", *_SINGLE}
    settings: dict[str, Any] = {key: value for key, value in dataclasses.asdict(row).items() if key not in paths}
    settings["inputs"] = [(one.role, one.name, _digest(one, digest_of)) for one in inputs]
    content = json.dumps([_RESULT_VERSION, version(), settings], sort_keys=True, default=str)
    return Job(row, hashlib.sha256(content.encode()).hexdigest()[:_DIGITS], state)


def _digest(given: InputPath, digest_of: Callable[[InputPath], str]) -> str:
    try:
        return digest_of(given)
    except OSError:
        return _UNREAD


def _with_absolute_paths(row: ManifestRow) -> ManifestRow:
    single = {name: path.absolute() for name in _SINGLE if (path := getattr(row, name))}
    return dataclasses.replace(row, recording=tuple(path.absolute() for path in row.recording), **single)
