"""Proposals as JSON: valid, the same each time, and with ids that confirming does not change."""

import json

import msgspec
import numpy as np

from calib_core.association.placements import Placement
from calib_core.geometry import RigidTransform
from calib_core.interchange.own.proposal_documents import ProposalsDocument
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.proposing import DwellView, PictureCandidate, Proposal, Proposals
from calib_core.proposing.proposals_json import ProposalSource, named_proposals, proposals_json

SOURCE = ProposalSource(("radar.bag",), "/image", ("/radar",), 0.24, ("c1",))


def placement(number: int, x_m: float) -> Placement:
    start = 10 * number * NS_PER_S
    return Placement(TimeNs(start), TimeNs(start + 4 * NS_PER_S), np.array([x_m, 1.0, 0.0]), 0.9)


def view(one: Placement) -> DwellView:
    return DwellView(one, np.zeros(0, np.int64), one.start, np.zeros((0, 0, 3), np.uint8), 1.0)


def proposal(one: Placement, confidence: float) -> Proposal:
    candidate = PictureCandidate(np.array([30.0, 40.0]), 0.5, 12.0)
    return Proposal(one, one.start, candidate.pixel_px, 0.5, confidence, (candidate,))


PLACEMENTS = (placement(1, 5.0), placement(1, 9.0), placement(2, 7.0))
VIEWS = tuple(map(view, PLACEMENTS))


def test_an_id_is_the_number_of_the_placement_whatever_else_is_proposed() -> None:
    first, second, third = (proposal(one, 0.9) for one in PLACEMENTS)
    assert [name for name, _ in named_proposals(Proposals((third, first, second)), VIEWS)] == ["p3", "p1", "p2"]
    assert [name for name, _ in named_proposals(Proposals((third,)), VIEWS)] == ["p3"]


def test_an_id_that_a_click_has_is_not_given_twice() -> None:
    named = named_proposals(Proposals((proposal(PLACEMENTS[0], 0.9),)), VIEWS, ["p1", "p1-proposed"])
    assert [name for name, _ in named] == ["p1-proposed-proposed"]


def test_the_document_follows_its_schema_and_unknown_figures_are_null() -> None:
    proposals = Proposals(
        (proposal(PLACEMENTS[2], 0.9),),
        ((PLACEMENTS[0], "nothing changed"),),
        RigidTransform(np.eye(3), np.zeros(3)),
        0.8,
        0.1,
        99,
    )
    text = proposals_json(proposals, VIEWS, SOURCE)
    assert text == proposals_json(proposals, VIEWS, SOURCE)
    document = json.loads(text)
    msgspec.convert(document, ProposalsDocument)
    (one,) = document["proposals"]
    assert one["click"] == {
        "id": "p3",
        "image_time": {"sec": 20, "nanosec": 0},
        "pixel_px": [30.0, 40.0],
        "sigma_px": 0.5,
        "mark": "snapped",
    }
    assert one["candidates"][0]["likeness"] is None
    assert one["placement"]["snr_db"] is None
    assert document["unproposed"][0]["reason"] == "nothing changed"
    assert document["camera_from_radar"]["agreement"] == 0.8


def test_without_a_mounting_there_is_none_in_the_document() -> None:
    assert json.loads(proposals_json(Proposals(()), VIEWS, SOURCE))["camera_from_radar"] is None
