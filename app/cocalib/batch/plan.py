"""What the latest batch of each manifest wanted: its sessions in order, each with the digest of its job; beside the results.

Results alone do not say which of two jobs of a session counts (the inputs may have been changed and changed back), which
sessions have no result yet, and which results belong to a name that was mistyped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Literal

import msgspec
from msgspec import Struct

from calib_core.errors import CalibrationError
from calib_core.parsing import json_form
from cocalib.batch.job import Job
from cocalib.batch.results_folder import ResultsFolder

PLANS: Final = "manifests"
_SCHEMA: Final = "cocalib/batch-plan-1"


class PlannedSession(Struct, frozen=True, forbid_unknown_fields=True):
    """A session of a manifest."""

    vehicle: str
    session: str
    digest: str


class PlanDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """The sessions of a manifest, in its order, when a batch was last started with it."""

    schema: Literal["cocalib/batch-plan-1"]
    started: str
    """ISO 8601, UTC."""
    sessions: list[PlannedSession]


@dataclass(frozen=True, slots=True)
class Plan:
    """What all manifests want together.

    Attributes:
        digests: of the job of each session, by vehicle and session; of one that several manifests name, as the latest batch
            wants it.
        unread: of each record of a manifest that cannot be read, why, and what to do.
    """

    digests: Mapping[tuple[str, str], str]
    unread: tuple[str, ...] = ()


def write_plan(folder: Path, manifest: Path, jobs: Sequence[Job]) -> None:
    """Write what a batch wants; the parts of a batch all write the same.

    Args:
        folder: of the results.
        manifest: its name tells it from others.
        jobs: of all its sessions.

    Raises:
        CalibrationError: what has its name is not a regular file, or its folder is a link.
        OSError: it cannot be written.
    """
    sessions = [PlannedSession(job.row.vehicle, job.row.session, job.digest) for job in jobs]
    document = PlanDocument(_SCHEMA, datetime.now(UTC).isoformat(), sessions)
    data = msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"
    ResultsFolder(folder).write(PLANS, f"{manifest.name}.json", data=data)


def read_plans(folder: Path) -> Plan:
    """Return what all manifests of a folder want.

    Args:
        folder: of the results.
    """
    read, hint = partial(json_form, form=PlanDocument), "run the batch of its manifest again"
    documents, unread = [], []
    for path in sorted((folder / PLANS).glob("*.json")):
        try:
            document = ResultsFolder(folder).read_as(read, PLANS, path.name, schema=_SCHEMA, hint=hint)
            documents += [document] if document is not None else []
        except CalibrationError as error:
            unread.append(str(error))
    documents.sort(key=lambda document: document.started)
    digests = {(row.vehicle, row.session): row.digest for document in documents for row in document.sessions}
    return Plan(digests, tuple(unread))
