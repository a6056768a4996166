"""Find where the reflector stood in a recording, for the command line and the page."""

from cocalib.proposing.finding import (
    REFLECTOR_M,
    RecordedFrames,
    beside_the_reflector,
    find_proposals,
    proposed_again,
    view_at,
)
from cocalib.proposing.job import ProposingJob, ProposingSnapshot, ProposingStage, ProposingWish

__all__ = [
    "REFLECTOR_M",
    "ProposingJob",
    "ProposingSnapshot",
    "ProposingStage",
    "ProposingWish",
    "RecordedFrames",
    "beside_the_reflector",
    "find_proposals",
    "proposed_again",
    "view_at",
]
