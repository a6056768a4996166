"""The keys of fleet-prior-1: what a fleet says about its next vehicle."""

from typing import Annotated, Final, Literal

from msgspec import Meta, Struct

from calib_core.interchange.own.documents import Freedom, Matrix66, Name, TransformDocument, Widened

FLEET_PRIOR_SCHEMA: Final = "cocalib/fleet-prior-1"


class FleetPriorDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """The mean pose of a vehicle type, and the covariance (dt, dtheta) [m, rad] of a further vehicle about it.

    vehicles are the names of those it rests on, left_out of those that were not counted. widened is the factor by which the
    covariance is wider because the scatter was estimated, with that many degrees of freedom.
    """

    schema: Literal["cocalib/fleet-prior-1"]
    vehicle_type: Name
    camera_from_radar: TransformDocument
    covariance: Matrix66
    vehicles: Annotated[list[Name], Meta(min_length=1)]
    left_out: list[Name] = []
    widened: Widened | None = None
    freedom: Freedom | None = None
