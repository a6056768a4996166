"""The jobs of a simulated fleet, from its manifest."""

import hashlib
import tomllib
from pathlib import Path
from typing import Any

from app.batch.job import Job, job_of
from app.batch.manifest import ManifestRow
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions

__all__ = ["fleet_jobs"]


def fleet_jobs(manifest: Path) -> tuple[Job, ...]:
    """Read the manifest that `simulated_fleet` wrote."""
    tables = tomllib.loads(manifest.read_text(encoding="utf-8"))["session"]
    return tuple(job_of(_row(manifest.parent, table), _sha256) for table in tables)


def _row(folder: Path, table: dict[str, Any]) -> ManifestRow:
    x, y, z = table["camera_position_m"]
    position = CameraPositionPrior((x, y, z), table["camera_position_sigma_m"])
    return ManifestRow(
        table["vehicle"],
        table["session"],
        (folder / table["recording"],),
        vehicle_type=table["vehicle_type"],
        radar_serial=table["radar_serial"],
        camera_serial=table["camera_serial"],
        clicks=folder / table["clicks"] if "clicks" in table else None,
        options=CalibrationOptions(solving=SolvingOptions(camera_position=position)),
    )


def _sha256(path: Path) -> str:
    content = hashlib.sha256()
    for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
        content.update(file.read_bytes())
    return content.hexdigest()
