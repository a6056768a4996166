"""All sessions as one flat table, as CSV."""

import csv
import io
import math
from collections.abc import Iterator
from typing import Any

from calib_core.fleet import Transition
from calib_core.geometry import quaternion_wxyz_from_matrix
from cocalib.fleet.records import FleetRecord, SessionRecord

_TEXT = (
    "vehicle",
    "session",
    "vehicle_type",
    "status",
    "reason",
    "verdict",
    "radar_serial",
    "camera_serial",
    "digest",
)
_REAL = (
    "sigma_deg",
    "sigma_cm",
    "aed_px",
    "qw",
    "qx",
    "qy",
    "qz",
    "x_m",
    "y_m",
    "z_m",
)
_CHANGE = (
    *("rotation_deg", "rotation_sigma_deg", "position_cm", "position_sigma_cm", "picture_px", "picture_sigma_px"),
    *("squared", "limit"),
)
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""With what spreadsheets begin a formula."""
_LISTS = ("covariance", "change", "change_covariance")


def csv_bytes(fleet: FleetRecord) -> bytes:
    """Write a row for each result, the superseded ones last; lists are numbers with spaces in between."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _columns(), lineterminator="\n")
    writer.writeheader()
    for row in _rows(fleet):
        writer.writerow({name: _cell(value) for name, value in row.items()})
    return text.getvalue().encode()


def _columns() -> list[str]:
    change = ("change_from", "change_outcome", *(f"change_{one}" for one in _CHANGE))
    before = (*_TEXT, "recorded_ns", "pairs", "superseded", *_REAL, "covariance")
    return [*before, *change, "change", "change_covariance"]


def _rows(fleet: FleetRecord) -> Iterator[dict[str, Any]]:
    for vehicle in fleet.vehicles:
        for record in vehicle.sessions:
            yield _row(record, vehicle.transition_to(record.name))
    for record in fleet.superseded:
        yield _row(record, None) | {"superseded": True}


def _row(record: SessionRecord, change: Transition | None) -> dict[str, Any]:
    """Return every column of a result; None where nothing is known."""
    outcome = record.outcome
    names = (*_TEXT, "recorded_ns", "pairs", "sigma_deg", "sigma_cm", "aed_px")
    row: dict[str, Any] = dict.fromkeys(_columns())
    row |= {name: getattr(outcome, name) for name in names} | {"superseded": False}
    if record.pose is not None:
        pose = record.pose.camera_from_radar
        numbers = [*quaternion_wxyz_from_matrix(pose.rotation).tolist(), *pose.translation_m.tolist()]
        row |= dict(zip(("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"), numbers, strict=True))
        row |= {"covariance": record.pose.covariance.ravel().tolist()}
    if change is not None:
        figures = {f"change_{one}": getattr(change, one) for one in _CHANGE}
        row |= {name: value if math.isfinite(value) else None for name, value in figures.items()}
        row |= {"change_from": change.before.session, "change_outcome": change.outcome}
        row |= {"change": change.change.tolist(), "change_covariance": change.covariance.ravel().tolist()}
    return row


def _cell(value: Any) -> Any:
    """Return a cell of a CSV file; a text that a spreadsheet would take for a formula begins with an apostrophe."""
    if isinstance(value, list):
        return " ".join(map(repr, value))
    if isinstance(value, str) and value.startswith(_FORMULA) and not _is_number(value):
        return f"'{value}"
    return value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
