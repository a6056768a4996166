"""Searching a recording for proposals: what it asks for, when it stops, and which dwell a confirmed click shows."""

from collections.abc import Iterator

import numpy as np
import pytest

import cocalib.proposing.finding as finding
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import NS_PER_S, RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, PictureCandidate, ViewProgress
from cocalib.proposing import find_proposals, proposed_again

CAMERA = Camera("pinhole", 64, 48, np.array([[60.0, 0, 32], [0, 60, 24], [0, 0, 1]]), np.zeros(0))
OPTIONS = CalibrationOptions()


class Frames:
    """Grey frames at ten a second, and no radar: it must not be read if the placements are known."""

    def __init__(self, length_s: int = 40) -> None:
        self.image_times = np.arange(0, length_s * NS_PER_S, NS_PER_S // 10)

    def image(self, index: int, /) -> np.ndarray:
        return np.full((48, 64, 3), 90, np.uint8)

    def radar_windows(self) -> Iterator[RadarScans]:
        raise AssertionError("the placements are known")


def placement(start_s: float, end_s: float, x_m: float = 5.0) -> Placement:
    return Placement(TimeNs(int(start_s * NS_PER_S)), TimeNs(int(end_s * NS_PER_S)), np.array([x_m, 0.0, 0.0]), 0.9)


PLACEMENTS = tuple(placement(start_s, start_s + 5.0) for start_s in (1.0, 9.0, 17.0, 25.0))


def test_without_intrinsics_that_is_what_is_said() -> None:
    outcome = find_proposals(Frames(), None, OPTIONS, placements=PLACEMENTS)
    assert isinstance(outcome, Unsolvable)
    assert outcome.code == "no-camera"


def test_known_placements_are_not_searched_for_again() -> None:
    told: list[ViewProgress | str] = []
    outcome = find_proposals(Frames(), CAMERA, OPTIONS, placements=PLACEMENTS, progress=told.append)
    assert not isinstance(outcome, Unsolvable)
    views, proposals = outcome
    assert [view.placement for view in views] == list(PLACEMENTS)
    assert len(proposals.ranked) + len(proposals.unproposed) == len(PLACEMENTS)
    assert [one.done for one in told if isinstance(one, ViewProgress)] == [1, 2, 3, 4]


def test_placements_of_which_only_some_have_frames_are_all_shown() -> None:
    outcome = find_proposals(Frames(length_s=20), CAMERA, OPTIONS, placements=PLACEMENTS)
    assert not isinstance(outcome, Unsolvable)
    assert [len(view.frames) > 0 for view in outcome[0]] == [True, True, True, False]


@pytest.mark.parametrize("after", [0, 2])
def test_a_search_that_is_stopped_proposes_nothing(after: int) -> None:
    seen: list[ViewProgress | str] = []
    outcome = find_proposals(
        Frames(), CAMERA, OPTIONS, placements=PLACEMENTS, progress=seen.append, stopped=lambda: len(seen) >= after
    )
    assert isinstance(outcome, Unsolvable)
    assert outcome.code == "stopped"
    assert len(seen) == after


def view_of(one: Placement, pixel_px: tuple[float, float]) -> DwellView:
    candidate = PictureCandidate(np.array(pixel_px), 1.0, 20.0)
    frames = np.arange(int(one.start) * 10 // NS_PER_S, int(one.end) * 10 // NS_PER_S)
    return DwellView(one, frames, one.start, np.full((48, 64, 3), 90, np.uint8), 1.0, (candidate,))


def test_a_click_shows_the_dwell_whose_candidate_is_nearer_when_two_reflectors_stood_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one, other = view_of(placement(1, 6), (10.0, 10.0)), view_of(placement(2, 7, x_m=9.0), (50.0, 30.0))
    later = view_of(placement(20, 25), (49.0, 29.0))
    looked_at: list[DwellView] = []

    def look(view: DwellView, frames: object, pixel_px: np.ndarray) -> None:
        looked_at.append(view)

    monkeypatch.setattr(finding, "look_of", look)
    click = ReflectorClick(TimeNs(3 * NS_PER_S), "c", 48.0, 30.0)
    left_out = ReflectorClick(TimeNs(22 * NS_PER_S), "x", 49.0, 29.0, excluded=True)
    elsewhere = ReflectorClick(TimeNs(15 * NS_PER_S), "e", 49.0, 29.0)
    proposed_again([one, other, later], Frames(), CAMERA, OPTIONS, confirmed=[click, left_out, elsewhere])
    assert looked_at == [other]
