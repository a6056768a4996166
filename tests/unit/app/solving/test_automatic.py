"""Clicks placed without a person: which are whose, and what becomes of a pose that they contradict."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cocalib.solving.automatic as automatic_solving
from benchmarks.simulated_pairs import simulate_pairs
from calib_core.association.placements import Placement
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.proposing import ImageCandidate, Proposal, Proposals
from calib_core.proposing.automatic import AutomaticClicks
from calib_core.results import UnconfirmedClicks
from calib_core.results.actions import MeasureCameraPosition
from calib_core.words.outcomes import outcome_remark
from cocalib.solving.automatic import PlacedClicks, place_clicks, solve_placed_clicks

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
    candidate = ImageCandidate(np.array([7.0, 8.0]), 0.4, 20.0)
    return Proposals((Proposal(placement, TimeNs(9), candidate.pixel_px, 0.4, 0.99, (candidate,)),))


def test_a_persons_click_stays_and_an_automatic_one_of_the_same_id_is_renamed(monkeypatch):
    found(monkeypatch, ((), one_proposal()), AutomaticClicks((PLACED,), 0.97, {}))
    placed = place_clicks(RECORDING, CAMERA, OPTIONS, confirmed=[PERSON])
    assert placed.clicks == (PERSON, replace(PLACED, id="automatic-01-auto"))
    assert (placed.unconfirmed.ids, placed.unconfirmed.confidence) == (("automatic-01-auto",), 0.97)
    found(monkeypatch, ((), Proposals(())))
    placed = place_clicks(RECORDING, CAMERA, OPTIONS, confirmed=[PERSON])
    assert (placed.clicks, placed.unconfirmed) == ((PERSON,), None), "every placement is clicked"


@pytest.mark.parametrize("at", ["search", "clicks"])
def test_a_refusal_is_handed_on(monkeypatch, at):
    refusal = Unsolvable.reported("not-confident", "chance would do nearly as well", "confirm some")
    found(monkeypatch, refusal if at == "search" else ((), one_proposal()), refusal)
    assert place_clicks(RECORDING, CAMERA, OPTIONS) is refusal


@pytest.mark.parametrize(
    ("away_m", "measured", "nobody", "is_refused"),
    [(0.0, False, True, False), (1.0, False, True, True), (1.0, True, True, False), (1.0, False, False, False)],
    ids=["near", "far", "far-by-tape", "far-by-a-person"],
)
def test_a_camera_that_would_be_far_away_needs_a_tape_or_a_person(away_m, measured, nobody, is_refused, monkeypatch):
    """What is carried along beside the reflector looks like a camera that is mounted elsewhere."""
    simulated = simulate_pairs(20, rng=np.random.default_rng(8), noise="imaging")
    options = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.0), 2.0)))
    solved = calibrate_pairs(simulated.pairs, simulated.camera, options if measured else OPTIONS)
    pose = solved.camera_from_radar
    moved = RigidTransform(pose.rotation, pose.translation_m + np.array([away_m, 0.0, 0.0]))
    monkeypatch.setattr(
        automatic_solving, "solve_clicks", lambda *_, **__: replace(solved, camera_from_radar=moved, warnings=())
    )
    placed = PlacedClicks((PLACED,), UnconfirmedClicks((PLACED.id,), 0.99) if nobody else None)
    outcome = solve_placed_clicks(RECORDING, placed, simulated.camera, options if measured else OPTIONS)
    assert isinstance(outcome, Unsolvable) is is_refused
    if isinstance(outcome, Unsolvable):
        assert outcome.code == "not-confident"
        assert outcome_remark(outcome).action == MeasureCameraPosition()
