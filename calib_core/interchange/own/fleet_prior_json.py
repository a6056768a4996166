"""Write and read fleet-prior-1, the file in which a fleet hands its prior to the next vehicle."""

import msgspec

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.fleet_prior_document import FLEET_PRIOR_SCHEMA, FleetPriorDocument
from calib_core.interchange.own.numbers import finite_or_none, nested
from calib_core.interchange.own.stated_covariance import stated_covariance
from calib_core.interchange.own.transform_document import transform_document, transform_of
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.strict_json import parse_document

__all__ = ["read_fleet_prior", "write_fleet_prior"]


def write_fleet_prior(prior: FleetPrior) -> str:
    """Write fleet-prior-1 text; the same prior gives the same bytes."""
    document = FleetPriorDocument(
        schema=FLEET_PRIOR_SCHEMA,
        vehicle_type=prior.vehicle_type,
        camera_from_radar=transform_document(prior.camera_from_radar),
        covariance=nested(0.5 * (prior.covariance + prior.covariance.T) + 0.0),
        vehicles=list(prior.vehicles),
        left_out=list(prior.left_out),
        widened=prior.widened if prior.widened != 1.0 else None,
        freedom=finite_or_none(prior.freedom),
    )
    content = msgspec.to_builtins(document)
    return json_text({key: value for key, value in content.items() if value is not None})


def read_fleet_prior(text: str, source: str = "fleet prior") -> FleetPrior:
    """Read fleet-prior-1 text.

    Args:
        text: the file's content.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, FleetPriorDocument, source=source)
    _refuse_repeated(document, source=source)
    return FleetPrior(
        vehicle_type=document.vehicle_type,
        camera_from_radar=transform_of(document.camera_from_radar, source=source, place="camera_from_radar"),
        covariance=stated_covariance(document.covariance, source=source),
        vehicles=tuple(document.vehicles),
        left_out=tuple(document.left_out),
        widened=1.0 if document.widened is None else document.widened,
        freedom=float("inf") if document.freedom is None else document.freedom,
    )


def _refuse_repeated(document: FleetPriorDocument, *, source: str) -> None:
    seen: set[str] = set()
    for name in (*document.vehicles, *document.left_out):
        if name in seen:
            raise InputError(f"{source}: vehicles and left_out: {name!r} occurs twice; name each vehicle once")
        seen.add(name)
