"""Proposals of where the reflector stood: what a page asks for, and what it is sent."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import msgspec

from calib_core.measurements import Stamp

Stage: TypeAlias = Literal["off", "looking", "comparing", "ready", "failed"]


class ProposingSwitch(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="propose"):
    """Proposals are wanted, or not wanted any more."""

    on: bool


@dataclass(frozen=True, slots=True)
class ProposalPlace:
    """A place in the picture where the reflector may stand.

    Attributes:
        u_px: column.
        v_px: row.
        sigma_px: standard deviation of that pixel per axis, if it is the reflector.
    """

    u_px: float
    v_px: float
    sigma_px: float


@dataclass(frozen=True, slots=True)
class ProposalRow:
    """Where the reflector probably stands in the pictures of a placement.

    Attributes:
        placement: its number among the placements, from 0.
        frame: in which it is shown.
        image_time: stamp of that frame.
        width_px: of the reflector there.
        confidence: probability that the first place is the reflector, 0 to 1.
        reason: why the confidence is low, as a clause; "" if it is not.
        places: what the picture shows, the most probable first.
    """

    placement: int
    frame: int
    image_time: Stamp
    width_px: float
    confidence: float
    reason: str
    places: tuple[ProposalPlace, ...]


@dataclass(frozen=True, slots=True)
class UnproposedRow:
    """A placement without a proposal.

    Attributes:
        placement: its number among the placements, from 0.
        reason: why there is none, as a clause.
    """

    placement: int
    reason: str


@dataclass(frozen=True, slots=True)
class ProposalNews:
    """The proposals as far as they can be made, and how far they are.

    Attributes:
        on: whether proposals are wanted.
        stage: what is being done.
        done: placements whose pictures were looked at, or compared with what was clicked.
        count: of all.
        problem: why there are none; "" if nothing is wrong.
        hint: what to do about it.
        rows: the most confident first; placements that have a click are left out.
        unproposed: placements for which nothing can be proposed.
    """

    on: bool
    stage: Stage
    done: int
    count: int
    problem: str
    hint: str
    rows: tuple[ProposalRow, ...] = ()
    unproposed: tuple[UnproposedRow, ...] = ()
