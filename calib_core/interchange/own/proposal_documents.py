"""The keys of proposals-1: what the machine found in a recording, for a person or a script to confirm."""

from typing import Annotated, Final, Literal

from msgspec import Meta, Struct

from calib_core.interchange.own.documents import ClickDocument, Matrix33
from calib_core.json_forms import Count, Measured, Pixel, Position, Positive
from calib_core.measurements import TimeNs

PROPOSALS_SCHEMA: Final = "cocalib/proposals-1"

_Share = Annotated[float, Meta(ge=0.0, le=1.0)]


class DwellDocument(Struct, frozen=True):
    """A placement as the radar saw it; score and the mean SNR of its returns, null if the radar reports none."""

    start: TimeNs
    end: TimeNs
    position_radar_m: Position
    range_m: Measured
    score: _Share
    snr_db: Measured | None = None


class ImageCandidateDocument(Struct, frozen=True):
    """A place in the image; strength of the change there in standard deviations; likeness to the confirmed reflector."""

    pixel_px: Pixel
    sigma_px: Positive
    strength: Measured
    likeness: Measured | None = None


class ProposalDocument(Struct, frozen=True):
    """Where the reflector probably stands in one placement.

    confidence is the probability that it is the reflector; reason says why it is low, or is "". click is what to copy into
    clicks-1 once somebody has confirmed it.
    """

    id: str
    placement: DwellDocument
    confidence: _Share
    reason: str
    click: ClickDocument
    candidates: list[ImageCandidateDocument]


class UnproposedDocument(Struct, frozen=True):
    """A placement without a proposal, and why."""

    placement: DwellDocument
    reason: str


class RoughMountingDocument(Struct, frozen=True):
    """The rough pose that the proposals agree on, with the share of the placements that agree, and that of its best rival."""

    rotation: Matrix33
    translation_m: Position
    agreement: _Share
    rival_agreement: _Share
    trials: Count


class ProposalsDocument(Struct, frozen=True):
    """Proposals for all placements of a recording, the most confident first. confirmed are the ids of the given clicks."""

    schema: Literal["cocalib/proposals-1"]
    recording: list[str]
    image_topic: str | None
    radar_topics: list[str]
    reflector_m: Positive
    confirmed: list[str]
    proposals: list[ProposalDocument]
    unproposed: list[UnproposedDocument]
    camera_from_radar: RoughMountingDocument | None = None
