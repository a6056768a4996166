"""Write and read fleet-prior-1, the file in which a fleet hands its prior to the next vehicle."""

import msgspec
import numpy as np

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.fleet_prior_document import FLEET_PRIOR_SCHEMA, FleetPriorDocument
from calib_core.interchange.own.fleet_prior_fields import fleet_prior_fields, fleet_prior_of_fields
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.strict_json import parse_document

_SIGMA_M, _SIGMA_RAD = (1e-4, 10.0), (1e-5, 1.6)
"""What a mounting is known to: a tenth of a millimetre to ten metres, and two arc seconds to a quarter turn."""


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
    prior = fleet_prior_of_fields(document, source=source)
    _refuse_implausible(prior, source=source)
    return prior


def _refuse_implausible(prior: FleetPrior, *, source: str) -> None:
    """Refuse a covariance in other units: it would pin the pose to the mean, or say nothing."""
    sigma = np.sqrt(np.diag(prior.covariance))
    limits = ((sigma[:3], *_SIGMA_M, "m"), (sigma[3:], *_SIGMA_RAD, "rad"))
    for values, least, most, unit in limits:
        for value in values.tolist():
            if not least <= value <= most:
                raise InputError(
                    f"{source}: covariance: a standard deviation of {value:.2g} {unit} is not how vehicles are mounted "
                    f"({least:g} to {most:g} {unit}); its diagonal is in m^2 and rad^2"
                )


def _refuse_repeated(document: FleetPriorDocument, *, source: str) -> None:
    seen: set[str] = set()
    for name in (*document.vehicles, *document.left_out):
        if name in seen:
            raise InputError(f"{source}: vehicles and left_out: {name!r} occurs twice; name each vehicle once")
        seen.add(name)
