"""Proposals: what the machine offers a person to confirm, and what it knows of the pose by then."""

from dataclasses import dataclass

from calib_core.arrays import Vector2, frozen_array
from calib_core.association.placements import Placement
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.proposing.picture_candidates import PictureCandidate


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Where the reflector probably stands in the pictures of one placement.

    Attributes:
        placement: the radar's.
        image_time: stamp of the frame in which it is shown.
        pixel_px: (2,) what the picture shows, never what the radar predicts.
        sigma_px: standard deviation of that pixel per axis, if it is the reflector.
        confidence: probability that it is the reflector, 0 to 1.
        candidates: all places in question, `pixel_px` first.
        reason: why the confidence is low, as a clause; "" if it is not.
    """

    placement: Placement
    image_time: TimeNs
    pixel_px: Vector2
    sigma_px: float
    confidence: float
    candidates: tuple[PictureCandidate, ...]
    reason: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pixel_px", frozen_array(self.pixel_px, (2,)))


@dataclass(frozen=True, slots=True, eq=False)
class Proposals:
    """All proposals of a recording, the most confident first.

    Attributes:
        ranked: at most one per placement.
        unproposed: placements without a proposal, each with the reason.
        camera_from_radar: a rough pose that the proposals agree on; None if there is none.
        agreement: share of the placements' weight that agrees on it, 0 to 1.
        rival_agreement: the same for the best pose that differs clearly.
        trials: how many poses were tried.
    """

    ranked: tuple[Proposal, ...]
    unproposed: tuple[tuple[Placement, str], ...] = ()
    camera_from_radar: RigidTransform | None = None
    agreement: float = 0.0
    rival_agreement: float = 0.0
    trials: int = 0
