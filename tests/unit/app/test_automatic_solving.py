"""Clicks placed without a person: which are whose, and what becomes of a pose that they contradict."""

from typing import Any

import numpy as np
import pytest

import app.automatic_solving as automatic_solving
from app.automatic_solving import place_clicks
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import PictureCandidate, Proposal, Proposals
from calib_core.proposing.automatic import AutomaticClicks

CAMERA = Camera("pinhole", 64, 48, np.array([[60.0, 0, 32], [0, 60, 24], [0, 0, 1]]), np.zeros(0))
OPTIONS = CalibrationOptions()
PERSON = ReflectorClick(TimeNs(5), "automatic-01", 3.0, 4.0)
PLACED = ReflectorClick(TimeNs(9), "automatic-01", 7.0, 8.0, sigma_px=0.4, mark="snapped")
RECORDING: Any = None
"""Never read: what would be found in it is given."""


def found(monkeypatch: pytest.MonkeyPatch, outcome: object, clicks: object = None) -> None:
    """Let the search find something, and take some of it as clicks."""
    monkeypatch.setattr(automatic_solving, "find_proposals", lambda *_, **__: outcome)
    monkeypatch.setattr(automatic_solving, "automatic_clicks", lambda *_, **__: clicks)


def one_proposal() -> Proposals:
    placement = Placement(TimeNs(8), TimeNs(10), np.array([5.0, 0.0, 0.0]), 0.9)
    candidate = PictureCandidate(np.array([7.0, 8.0]), 0.4, 20.0)
    return Proposals((Proposal(placement, TimeNs(9), candidate.pixel_px, 0.4, 0.99, (candidate,)),))


def test_a_persons_click_stays_and_an_automatic_one_of_the_same_id_is_renamed(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, ((), one_proposal()), AutomaticClicks((PLACED,), 0.97, "it fits"))
    placed = place_clicks(RECORDING, CAMERA, OPTIONS, confirmed=[PERSON])
    assert not isinstance(placed, Unsolvable)
    assert placed.clicks[0] == PERSON
    assert placed.unconfirmed is not None
    assert placed.unconfirmed.ids == ("automatic-01-auto",)
    assert placed.unconfirmed.confidence == 0.97
    assert (placed.clicks[1].id, placed.clicks[1].u_px, placed.clicks[1].mark) == ("automatic-01-auto", 7.0, "snapped")


def test_where_every_placement_is_clicked_nothing_is_unconfirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, ((), Proposals(())))
    placed = place_clicks(RECORDING, CAMERA, OPTIONS, confirmed=[PERSON])
    assert not isinstance(placed, Unsolvable)
    assert (placed.clicks, placed.unconfirmed) == ((PERSON,), None)


@pytest.mark.parametrize("at", ["search", "clicks"])
def test_a_refusal_is_handed_on(monkeypatch: pytest.MonkeyPatch, at: str) -> None:
    refusal = Unsolvable("not-confident", "chance would do nearly as well", "confirm some")
    found(monkeypatch, refusal if at == "search" else ((), one_proposal()), refusal)
    assert place_clicks(RECORDING, CAMERA, OPTIONS) is refusal
