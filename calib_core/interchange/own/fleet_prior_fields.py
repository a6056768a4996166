"""The prior of a fleet as keys of a file: its own, fleet-prior-1, or the calibration-1 of the vehicle that it was given to."""

from typing import Any

from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.documents import FleetAnswerDocument
from calib_core.interchange.own.fleet_prior_document import FleetPriorDocument
from calib_core.interchange.own.numbers import finite_or_none, nested
from calib_core.interchange.own.stated_covariance import stated_covariance
from calib_core.interchange.own.transform_document import transform_document, transform_of


def fleet_prior_fields(prior: FleetPrior) -> dict[str, Any]:
    """Return the keys that both documents have, in the order of their schemas."""
    return {
        "vehicle_type": prior.vehicle_type,
        "camera_from_radar": transform_document(prior.camera_from_radar),
        "covariance": nested(0.5 * (prior.covariance + prior.covariance.T) + 0.0),
        "vehicles": list(prior.vehicles),
        "left_out": list(prior.left_out),
        "widened": prior.widened if prior.widened != 1.0 else None,
        "freedom": finite_or_none(prior.freedom),
    }


def fleet_prior_of_fields(
    document: FleetPriorDocument | FleetAnswerDocument, *, source: str, place: str = ""
) -> FleetPrior:
    """Return the prior in a document.

    Args:
        document: as parsed.
        source: the name of the file in error messages.
        place: the key that holds it, with a dot behind it; "" at the top of the file.

    Raises:
        InputError: the transform or the covariance is none.
    """
    return FleetPrior(
        vehicle_type=document.vehicle_type,
        camera_from_radar=transform_of(document.camera_from_radar, source=source, place=f"{place}camera_from_radar"),
        covariance=stated_covariance(document.covariance, source=source, place=f"{place}covariance"),
        vehicles=tuple(document.vehicles),
        left_out=tuple(document.left_out),
        widened=1.0 if document.widened is None else document.widened,
        freedom=float("inf") if document.freedom is None else document.freedom,
    )
