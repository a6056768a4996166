"""A job: a row of the manifest with what its result depends on, as one digest."""

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from typing import Any

from cocalib.batch.inputs import inputs_of, state_of
from cocalib.batch.manifest import ManifestRow
from cocalib.platform.resources import version

_RESULT_VERSION = 2
"""Counts up when the same inputs give other files."""
_DIGITS = 32
_SINGLE = ("clicks", "camera", "boxes")


@dataclass(frozen=True, slots=True)
class Job:
    """A session to be calibrated.

    Attributes:
        row: of the manifest, with absolute paths.
        digest: of everything that the result depends on: the state of all inputs, the settings, the program's version.
        state: of the inputs when the digest was made; empty if nobody looked.
    """

    row: ManifestRow
    digest: str
    state: str = ""


def job_of(row: ManifestRow) -> Job:
    """Return the job of a row. Where files lie does not matter, only their names and contents.

    An input that cannot be read makes another digest than any content: running the job says what is wrong.
    """
    single = {name: path.absolute() for name in _SINGLE if (path := getattr(row, name))}
    row = dataclasses.replace(row, recording=tuple(path.absolute() for path in row.recording), **single)
    state = state_of(inputs_of(row))
    paths = {"place", "recording", *_SINGLE}
    settings: dict[str, Any] = {key: value for key, value in dataclasses.asdict(row).items() if key not in paths}
    content = json.dumps([_RESULT_VERSION, version(), settings, state], sort_keys=True, default=str)
    return Job(row, hashlib.sha256(content.encode()).hexdigest()[:_DIGITS], state)
