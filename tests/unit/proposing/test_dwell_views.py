"""What changed in the images of dwells, in small drawn images with a known apex."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.proposing import DwellView, ViewProgress, dwell_views
from calib_core.proposing.appearance import Appearance, appearance_of, with_appearance
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.still_images import stack_median
from tests.unit.proposing.drawn_dwells import CAMERA, DrawnDwell, DrawnFrames, placements_of

ONE_BY_ONE = tuple(
    DrawnDwell(8.0 * k, 8.0 * k + 6.0, apex_px)
    for k, apex_px in enumerate([(60.3, 60.8), (150.6, 120.2), (250.1, 80.7), (100.4, 150.1), (210.8, 140.4)])
)


def views_of(frames: DrawnFrames) -> tuple[DwellView, ...]:
    return dwell_views(placements_of(frames.dwells), frames, CAMERA)


def first_errors_px(views: tuple[DwellView, ...], frames: DrawnFrames) -> list[float]:
    moved = np.array(frames.moved_px)
    return [
        float(np.hypot(*(view.candidates[0].pixel_px - dwell.apex_px - moved)))
        for view, dwell in zip(views, frames.dwells, strict=True)
    ]


def test_the_reflector_is_the_strongest_candidate_at_its_apex_and_only_frames_of_the_dwells_are_decoded():
    frames = DrawnFrames(ONE_BY_ONE)
    views = views_of(frames)
    assert max(first_errors_px(views, frames)) < 1.0
    assert all(view.candidates[0].has_apex and view.candidates[0].sigma_px < 1.0 for view in views)
    assert [list(view.frames) for view in views] == [sorted(set(view.frames)) for view in views]
    assert max(len(view.frames) for view in views) <= 7
    assert set(frames.asked) == {int(number) for view in views for number in view.frames}


def test_candidates_move_with_the_images():
    frames = DrawnFrames(ONE_BY_ONE, moved_px=(8, -4))
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_light_that_changes_moves_no_candidate():
    seconds = np.arange(50)
    bright = 0.85 * np.exp(0.2 * np.sin(seconds / 7.0))
    gains = [(0.95 * gain, gain, 1.06 * gain) for gain in bright.tolist()]
    gains[20:] = [(0.7 * b, 0.7 * g, 0.7 * r) for b, g, r in gains[20:]]
    frames = DrawnFrames(ONE_BY_ONE, gains=gains)
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_people_who_stand_or_pass_are_no_candidates_before_the_reflector():
    standing = [(8.0 * k, 8.0 * k + 7.0, left, 70, 32, 110) for k, left in enumerate([100, 40, 180, 30, 120])]
    passing = [(8.0 * k + 2.0, 8.0 * k + 3.0, 30 + 45 * k, 20, 40, 150) for k in range(5)]
    frames = DrawnFrames(ONE_BY_ONE, people=[*standing, *passing])
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_two_reflectors_that_stand_at_once_are_told_apart():
    places = [(60.3, 60.8), (150.6, 120.2), (250.1, 80.7), (100.4, 150.1), (210.8, 140.4), (40.2, 120.3)]
    dwells = tuple(DrawnDwell(8.0 * k, 8.0 * k + 14.0, apex_px) for k, apex_px in enumerate(places))
    frames = DrawnFrames(dwells)
    views = views_of(frames)
    assert max(first_errors_px(views, frames)) < 1.0
    assert all(len(view.stills) > 1 for view in views[1:-1])
    for view in views:
        assert all(other.strength < 0.5 * view.candidates[0].strength for other in view.candidates[1:])


def test_a_broken_frame_is_left_out():
    frames = DrawnFrames(ONE_BY_ONE, broken=frozenset({4, 6}))
    views = views_of(frames)
    assert not {4, 6} & set(views[0].frames.tolist())
    assert max(first_errors_px(views, frames)) < 1.0


def test_a_dwell_without_frames_has_no_candidate():
    frames = DrawnFrames(ONE_BY_ONE)
    later = placements_of([*ONE_BY_ONE, DrawnDwell(500.0, 506.0, (50.0, 50.0))])
    last = dwell_views(later, frames, CAMERA)[-1]
    assert not len(last.frames)
    assert not last.candidates
    assert later[-1].start <= last.image_time <= later[-1].end


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_dwells_show_no_change(count):
    assert not any(view.candidates for view in views_of(DrawnFrames(ONE_BY_ONE[:count])))


def test_progress_brings_candidates_early_and_can_be_stopped():
    frames, seen = DrawnFrames(ONE_BY_ONE), list[ViewProgress]()
    views = dwell_views(placements_of(ONE_BY_ONE), frames, CAMERA, progress=seen.append, stopped=lambda: len(seen) == 4)
    assert [one.done for one in seen] == [1, 2, 3, 4]
    assert [bool(view.candidates) for view in views] == [True] * 4 + [False] * (len(views) - 4)


@pytest.mark.slow
def test_images_of_dwells_long_ago_are_forgotten_and_their_candidates_kept():
    dwells = [DrawnDwell(8.0 * k, 8.0 * k + 2.5, (60.3 + 6.0 * k, 60.8 + 70.0 * (k % 2))) for k in range(27)]
    views = views_of(DrawnFrames(dwells))
    assert [bool(view.stills) for view in views] == [False] * 3 + [True] * 24
    assert all(view.candidates for view in views)


# The look of a confirmed reflector, found again where it is nearer or farther.


LOOKED_AT = DrawnFrames(
    tuple(
        DrawnDwell(8.0 * k, 8.0 * k + 6.0, apex_px, range_m)
        for k, (apex_px, range_m) in enumerate(
            [((60.3, 60.8), 3.0), ((150.6, 120.2), 4.0), ((250.1, 80.7), 5.0), ((100.4, 150.1), 6.0)]
        )
    )
)


@pytest.fixture(scope="module")
def views() -> tuple[DwellView, ...]:
    return dwell_views(placements_of(LOOKED_AT.dwells), LOOKED_AT, CAMERA)


def look_at(view: DwellView, pixel_px: tuple[float, float]) -> Appearance:
    look = appearance_of(view, LOOKED_AT, np.array(pixel_px))
    assert look is not None
    return look


def rough(view: DwellView, apex_px: tuple[float, float]) -> DwellView:
    """A view whose stronger candidate is a wrong one, and whose right one is a blob."""
    wrong = ImageCandidate(np.array([180.0, 40.0]), 3.0, 30.0)
    right = ImageCandidate(np.array(apex_px) + np.array([0.2 * view.width_px, -0.25 * view.width_px]), 3.0, 20.0)
    return replace(view, candidates=(wrong, right))


def test_the_look_is_found_at_every_range_and_below_a_pixel(views):
    look = look_at(views[0], LOOKED_AT.dwells[0].apex_px)
    blobs = [rough(view, dwell.apex_px) for view, dwell in zip(views, LOOKED_AT.dwells, strict=True)]
    for view, dwell in zip(with_appearance(blobs, [look], LOOKED_AT, CAMERA), LOOKED_AT.dwells, strict=True):
        best = view.candidates[0]
        assert np.hypot(*(best.pixel_px - dwell.apex_px)) < 1.0
        assert best.likeness > 0.6
        assert all(other.likeness < best.likeness for other in view.candidates[1:])


@pytest.mark.slow
@pytest.mark.parametrize("thought_m", [0.08, 0.24, 0.6])
def test_a_click_shows_how_wide_the_reflector_is(thought_m):
    seen = dwell_views(placements_of(LOOKED_AT.dwells), LOOKED_AT, CAMERA, reflector_m=thought_m)
    look = look_at(seen[0], LOOKED_AT.dwells[0].apex_px)
    assert look.larger * thought_m == pytest.approx(0.24, rel=0.4)
    assert look.larger == 1.0 or thought_m != 0.24
    for view, dwell in zip(with_appearance(seen, [look], LOOKED_AT, CAMERA), LOOKED_AT.dwells, strict=True):
        assert np.hypot(*(view.candidates[0].pixel_px - dwell.apex_px)) < 1.0


def test_a_click_beside_the_apex_is_carried_as_it_is(views):
    low_px = 0.3
    clicked = np.array(LOOKED_AT.dwells[0].apex_px) + np.array([0.0, low_px * views[0].width_px])
    look = appearance_of(views[0], LOOKED_AT, clicked)
    assert not look.at_apex
    view = with_appearance([rough(views[1], LOOKED_AT.dwells[1].apex_px)], [look], LOOKED_AT, CAMERA)[0]
    wanted = np.array(LOOKED_AT.dwells[1].apex_px) + np.array([0.0, low_px * view.width_px])
    assert np.hypot(*(view.candidates[0].pixel_px - wanted)) < 1.5


def test_without_a_look_nothing_changes(views):
    assert with_appearance(views, [], LOOKED_AT, CAMERA) == views


def test_a_dwell_whose_frames_cannot_be_read_has_no_look(views):
    broken = replace(LOOKED_AT, broken=frozenset(views[0].frames.tolist()))
    assert appearance_of(views[0], broken, np.array(LOOKED_AT.dwells[0].apex_px)) is None


# The median of a few images against NumPy's.


@given(st.integers(1, 14), st.integers(0, 2**32 - 1), st.sampled_from([np.uint8, np.uint16]))
def test_the_median_is_numpys(count, seed, kind):
    stack = np.random.default_rng(seed).integers(0, 255, (count, 4, 5, 3)).astype(kind)
    assert np.abs(stack_median(list(stack)) - np.median(stack, axis=0)).max() <= 0.5
