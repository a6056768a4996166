"""Outcome: what came of one job, as the file that every engine returns (cocalib/outcome-1)."""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct, field

from calib_core.parsing import json_form

OUTCOME_SCHEMA: Final = "cocalib/outcome-1"
Status = Literal["solved", "weak", "refused", "failed"]
"""A good or usable calibration; one not to rely on; the data give none; an input cannot be read or the program failed."""
_RELATIVE = r"^(?!\.{1,2}(/|$))[^/\\\x00]+(/(?!\.{1,2}(/|$))[^/\\\x00]+)*$"
"""Names with slashes in between, none of them `.` or `..`."""
StepState = Literal["done", "left out", "not available", "not asked", "failed"]


class OutcomeFile(Struct, frozen=True, forbid_unknown_fields=True):
    """A file beside the outcome, by its relative name, and its sha256."""

    name: Annotated[str, Meta(pattern=_RELATIVE)]
    sha256: str


class OutcomeRun(Struct, frozen=True, forbid_unknown_fields=True):
    """When and where the job ran; the only part that differs between two runs of the same job."""

    host: str
    started: str
    """ISO 8601, UTC."""
    seconds: float


class Outcome(Struct, frozen=True):
    """What came of one job."""

    schema: Literal["cocalib/outcome-1"]
    digest: str
    """Of the job."""
    vehicle: str
    session: str
    status: Status
    reason: str = ""
    """Why there is no calibration, or why it is weak."""
    hint: str = ""
    """What to do about it."""
    vehicle_type: str | None = None
    radar_serial: str | None = None
    camera_serial: str | None = None
    verdict: str | None = None
    """On the calibration; None without one."""
    recorded_ns: int | None = None
    """First stamp of the recording [ns]; None if it was not opened."""
    sigma_deg: float | None = None
    """Largest standard deviation of the rotation about an axis [deg]."""
    sigma_cm: float | None = None
    """Largest standard deviation of the position along an axis [cm]."""
    aed_px: float | None = None
    """Mean residual of the used pairs [px]."""
    pairs: int = 0
    """How many were used."""
    warnings: tuple[str, ...] = ()
    """Codes of the calibration's warnings, in order."""
    steps: dict[str, StepState] = field(default_factory=dict)
    """What came of evaluate, report and export; empty without a calibration."""
    files: tuple[OutcomeFile, ...] = ()
    """Beside the outcome, in order of their names."""
    run: OutcomeRun | None = None
    is_final: bool = True
    """Running the job again would give the same. Otherwise it is run again the next time: a file was not reached, memory was
    short, or the program failed."""
    step_reasons: dict[str, str] = field(default_factory=dict)
    """Why a step failed, by its name."""
    notes: tuple[str, ...] = ()
    """What the user may want to know, such as clicks that were moved to frames."""
    version: str = ""
    """Of the program."""


def outcome_text(outcome: Outcome) -> str:
    """Write outcome-1 JSON."""
    return msgspec.json.format(msgspec.json.encode(outcome), indent=1).decode() + "\n"


def read_outcome(text: str) -> Outcome:
    """Read outcome-1 JSON.

    Raises:
        InputError: it is something else.
    """
    return json_form(text, Outcome)
