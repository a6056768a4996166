"""Which rows of a manifest may not have the fleet's prior that they name, looked at before any job runs."""

from pathlib import Path

from calib_core.errors import InputError
from cocalib.batch.manifest import Manifest, ManifestRow
from cocalib.solving.fleet_prior_file import FleetPriorFile

_MOST_NAMED = 5


def require_priors_of_others(manifest: Manifest) -> None:
    """Refuse a manifest whose rows name a prior that rests on their own vehicle, or that is of another type.

    Such a job would be refused, and that would take the place of the result that the vehicle has. A file that cannot be read is
    left to its job.

    Raises:
        InputError: names the rows.
    """
    read: dict[Path, FleetPriorFile | None] = {}
    refused = []
    for row in manifest.rows:
        if row.fleet_prior is not None:
            if row.fleet_prior not in read:
                read[row.fleet_prior] = _read(row.fleet_prior)
            reason = _reason(row, read[row.fleet_prior])
            refused += [(row, reason)] if reason else []
    if not refused:
        return
    named = ", ".join(f"{row.place} ({row.name})" for row, _ in refused[:_MOST_NAMED])
    more = f" and {len(refused) - _MOST_NAMED} more" if len(refused) > _MOST_NAMED else ""
    raise InputError(
        f"{manifest.source}: {named}{more}: fleet_prior: {refused[0][1]}; or name it only in the rows of new vehicles, best in "
        "a manifest of their own"
    )


def _read(path: Path) -> FleetPriorFile | None:
    try:
        return FleetPriorFile.read(path)
    except InputError:
        return None


def _reason(row: ManifestRow, prior: FleetPriorFile | None) -> str:
    if prior is None:
        return ""
    try:
        prior.require_of_type(row.vehicle_type)
        prior.require_not_of(row.vehicle)
    except InputError as error:
        return str(error)
    return ""
