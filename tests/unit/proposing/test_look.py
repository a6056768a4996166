"""The look of a confirmed reflector, found again where it is nearer or farther."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.proposing import DwellView, dwell_views
from calib_core.proposing.look import Look, look_of, with_look
from calib_core.proposing.picture_candidates import PictureCandidate
from tests.unit.proposing.drawn_dwells import CAMERA, DrawnDwell, DrawnFrames, placements_of

FRAMES = DrawnFrames(
    tuple(
        DrawnDwell(8.0 * k, 8.0 * k + 6.0, apex_px, range_m)
        for k, (apex_px, range_m) in enumerate(
            [((60.3, 60.8), 3.0), ((150.6, 120.2), 4.0), ((250.1, 80.7), 5.0), ((100.4, 150.1), 6.0)]
        )
    )
)


@pytest.fixture(scope="module")
def views() -> tuple[DwellView, ...]:
    return dwell_views(placements_of(FRAMES.dwells), FRAMES, CAMERA)


def look_at(view: DwellView, pixel_px: tuple[float, float]) -> Look:
    look = look_of(view, FRAMES, np.array(pixel_px))
    assert look is not None
    return look


def rough(view: DwellView, apex_px: tuple[float, float]) -> DwellView:
    """A view whose stronger candidate is a wrong one, and whose right one is a blob."""
    wrong = PictureCandidate(np.array([180.0, 40.0]), 3.0, 30.0)
    right = PictureCandidate(np.array(apex_px) + np.array([0.2 * view.width_px, -0.25 * view.width_px]), 3.0, 20.0)
    return replace(view, candidates=(wrong, right))


def test_the_look_is_found_at_every_range_and_below_a_pixel(views: tuple[DwellView, ...]) -> None:
    look = look_at(views[0], FRAMES.dwells[0].apex_px)
    blobs = [rough(view, dwell.apex_px) for view, dwell in zip(views, FRAMES.dwells, strict=True)]
    for view, dwell in zip(with_look(blobs, [look], FRAMES, CAMERA), FRAMES.dwells, strict=True):
        best = view.candidates[0]
        assert np.hypot(*(best.pixel_px - dwell.apex_px)) < 1.0
        assert best.likeness > 0.6
        assert all(other.likeness < best.likeness for other in view.candidates[1:])


def test_a_click_beside_the_apex_is_carried_as_it_is(views: tuple[DwellView, ...]) -> None:
    low_px = 0.3
    clicked = np.array(FRAMES.dwells[0].apex_px) + np.array([0.0, low_px * views[0].width_px])
    look = look_of(views[0], FRAMES, clicked)
    assert look is not None
    assert not look.at_apex
    view = with_look([rough(views[1], FRAMES.dwells[1].apex_px)], [look], FRAMES, CAMERA)[0]
    wanted = np.array(FRAMES.dwells[1].apex_px) + np.array([0.0, low_px * view.width_px])
    assert np.hypot(*(view.candidates[0].pixel_px - wanted)) < 1.5


def test_without_a_look_nothing_changes(views: tuple[DwellView, ...]) -> None:
    assert with_look(views, [], FRAMES, CAMERA) == views


def test_a_dwell_whose_frames_cannot_be_read_has_no_look(views: tuple[DwellView, ...]) -> None:
    broken = replace(FRAMES, broken=frozenset(views[0].frames.tolist()))
    assert look_of(views[0], broken, np.array(FRAMES.dwells[0].apex_px)) is None
