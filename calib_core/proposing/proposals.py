"""Proposals: what the machine offers a person to confirm, and what it knows of the pose by then; for programs as proposals-1."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from calib_core.arrays import Vector2, freeze
from calib_core.association.placements import Placement
from calib_core.input_files import encodable
from calib_core.interchange.own.documents import ClickDocument, finite_or_none
from calib_core.interchange.own.proposal_documents import (
    DwellDocument,
    ImageCandidateDocument,
    ProposalDocument,
    ProposalsDocument,
    RoughMountingDocument,
    UnproposedDocument,
)
from calib_core.interchange.syntax.strict_json import builtins_of, json_text
from calib_core.measurements import TimeNs
from calib_core.proposing.chance import Chance
from calib_core.proposing.dwell_views import DwellView
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.pose_agreement import PoseAgreement


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Where the reflector probably stands in the images of one placement.

    Attributes:
        placement: the radar's.
        image_time: stamp of the frame in which it is shown.
        pixel_px: (2,) what the image shows, never what the radar predicts.
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
    candidates: tuple[ImageCandidate, ...]
    reason: str = ""

    def __post_init__(self) -> None:
        freeze(self, pixel_px=(2,))


@dataclass(frozen=True, slots=True)
class Slip:
    """A click that is probably wrong: the images and the other placements show the reflector beside it.

    Attributes:
        click: its id.
        off_px: how far away they show it.
    """

    click: str
    off_px: float


@dataclass(frozen=True, slots=True, eq=False)
class Proposals:
    """All proposals of a recording, the most confident first.

    Attributes:
        ranked: at most one per placement.
        unproposed: placements without a proposal, each with the reason.
        agreement: the rough pose that they agree on; None if there is none.
        chance: how far chance goes.
        reflectors: probability that what stood there is a reflector and not a person.
        slips: confirmed clicks that are probably wrong.
    """

    ranked: tuple[Proposal, ...]
    unproposed: tuple[tuple[Placement, str], ...] = ()
    agreement: PoseAgreement | None = None
    chance: Chance | None = None
    reflectors: float = 1.0
    slips: tuple[Slip, ...] = ()


def named_proposals(
    proposals: Proposals, views: Sequence[DwellView], taken: Sequence[str] = ()
) -> tuple[tuple[str, Proposal], ...]:
    """Return the proposals as ranked, each with an id: the number of its placement, which confirmed clicks do not change.

    Args:
        proposals: of these views.
        views: of all placements.
        taken: ids of clicks that exist already.
    """
    number = {view.placement: count for count, view in enumerate(views, start=1)}
    named = []
    for proposal in proposals.ranked:
        name = f"p{number[proposal.placement]}"
        while name in taken:
            name += "-proposed"
        named.append((name, proposal))
    return tuple(named)


def proposals_json(proposals: Proposals, views: Sequence[DwellView], source: ProposalsDocument) -> str:
    """Write proposals-1 text; the same proposals give the same bytes.

    Args:
        proposals: of these views.
        views: of all placements of a recording.
        source: what they were made from; the rest of it is filled in.
    """
    document = replace(
        source,
        proposals=[_proposal(name, one) for name, one in named_proposals(proposals, views, source.confirmed)],
        unproposed=[UnproposedDocument(_dwell(placement), reason) for placement, reason in proposals.unproposed],
        camera_from_radar=None if proposals.agreement is None else _mounting(proposals.agreement),
    )
    return json_text(encodable(builtins_of(document)))


def _proposal(name: str, proposal: Proposal) -> ProposalDocument:
    click = ClickDocument(
        name, proposal.image_time, _pixel(proposal.pixel_px), sigma_px=proposal.sigma_px, mark="snapped"
    )
    return ProposalDocument(
        name,
        _dwell(proposal.placement),
        proposal.confidence,
        proposal.reason,
        click,
        [_candidate(candidate) for candidate in proposal.candidates],
    )


def _dwell(placement: Placement) -> DwellDocument:
    x_m, y_m, z_m = placement.position_radar_m.tolist()
    return DwellDocument(
        placement.start,
        placement.end,
        (x_m, y_m, z_m),
        float(np.linalg.norm(placement.position_radar_m)),
        placement.score,
        finite_or_none(placement.snr_db),
    )


def _candidate(candidate: ImageCandidate) -> ImageCandidateDocument:
    return ImageCandidateDocument(
        _pixel(candidate.pixel_px), candidate.sigma_px, candidate.strength, finite_or_none(candidate.likeness)
    )


def _mounting(agreement: PoseAgreement) -> RoughMountingDocument:
    pose = agreement.camera_from_radar
    rows: Sequence[Sequence[float]] = pose.rotation.tolist()
    one, two, three = ((a, b, c) for a, b, c in rows)
    x_m, y_m, z_m = pose.translation_m.tolist()
    return RoughMountingDocument(
        (one, two, three), (x_m, y_m, z_m), agreement.share, agreement.rival_share, agreement.trials
    )


def _pixel(pixel_px: np.ndarray) -> tuple[float, float]:
    return float(pixel_px[0]), float(pixel_px[1])
