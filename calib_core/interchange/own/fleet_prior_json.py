"""Write and read fleet-prior-1, the file in which a fleet hands its prior to the next vehicle."""

import msgspec

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.fleet_prior_document import FLEET_PRIOR_SCHEMA, FleetPriorDocument
from calib_core.interchange.own.fleet_prior_fields import fleet_prior_fields, fleet_prior_of_fields
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.strict_json import parse_document

__all__ = ["read_fleet_prior", "write_fleet_prior"]


def write_fleet_prior(prior: FleetPrior) -> str:
    """Write fleet-prior-1 text; the same prior gives the same bytes."""
    document = FleetPriorDocument(schema=FLEET_PRIOR_SCHEMA, **fleet_prior_fields(prior))
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
    return fleet_prior_of_fields(document, source=source)


def _refuse_repeated(document: FleetPriorDocument, *, source: str) -> None:
    seen: set[str] = set()
    for name in (*document.vehicles, *document.left_out):
        if name in seen:
            raise InputError(f"{source}: vehicles and left_out: {name!r} occurs twice; name each vehicle once")
        seen.add(name)
