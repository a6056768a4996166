"""What changed in the pictures of dwells, in small drawn pictures with a known apex."""

import numpy as np
import pytest

from calib_core.proposing import DwellView, ViewProgress, dwell_views
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


def test_the_reflector_is_the_strongest_candidate_at_its_apex_and_only_frames_of_the_dwells_are_decoded() -> None:
    frames = DrawnFrames(ONE_BY_ONE)
    views = views_of(frames)
    assert max(first_errors_px(views, frames)) < 1.0
    assert all(view.candidates[0].has_apex and view.candidates[0].sigma_px < 1.0 for view in views)
    assert [list(view.frames) for view in views] == [sorted(set(view.frames)) for view in views]
    assert max(len(view.frames) for view in views) <= 7
    assert set(frames.asked) == {int(number) for view in views for number in view.frames}


def test_candidates_move_with_the_pictures() -> None:
    frames = DrawnFrames(ONE_BY_ONE, moved_px=(8, -4))
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_light_that_changes_moves_no_candidate() -> None:
    seconds = np.arange(50)
    bright = 0.85 * np.exp(0.2 * np.sin(seconds / 7.0))
    gains = [(0.95 * gain, gain, 1.06 * gain) for gain in bright.tolist()]
    gains[20:] = [(0.7 * b, 0.7 * g, 0.7 * r) for b, g, r in gains[20:]]
    frames = DrawnFrames(ONE_BY_ONE, gains=gains)
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_people_who_stand_or_pass_are_no_candidates_before_the_reflector() -> None:
    standing = [(8.0 * k, 8.0 * k + 7.0, left, 70, 32, 110) for k, left in enumerate([100, 40, 180, 30, 120])]
    passing = [(8.0 * k + 2.0, 8.0 * k + 3.0, 30 + 45 * k, 20, 40, 150) for k in range(5)]
    frames = DrawnFrames(ONE_BY_ONE, people=[*standing, *passing])
    assert max(first_errors_px(views_of(frames), frames)) < 1.0


def test_two_reflectors_that_stand_at_once_are_told_apart() -> None:
    places = [(60.3, 60.8), (150.6, 120.2), (250.1, 80.7), (100.4, 150.1), (210.8, 140.4), (40.2, 120.3)]
    dwells = tuple(DrawnDwell(8.0 * k, 8.0 * k + 14.0, apex_px) for k, apex_px in enumerate(places))
    frames = DrawnFrames(dwells)
    views = views_of(frames)
    assert max(first_errors_px(views, frames)) < 1.0
    assert all(len(view.stills) > 1 for view in views[1:-1])
    for view in views:
        assert all(other.strength < 0.5 * view.candidates[0].strength for other in view.candidates[1:])


def test_a_broken_frame_is_left_out() -> None:
    frames = DrawnFrames(ONE_BY_ONE, broken=frozenset({4, 6}))
    views = views_of(frames)
    assert not {4, 6} & set(views[0].frames.tolist())
    assert max(first_errors_px(views, frames)) < 1.0


def test_a_dwell_without_frames_has_no_candidate() -> None:
    frames = DrawnFrames(ONE_BY_ONE)
    later = placements_of([*ONE_BY_ONE, DrawnDwell(500.0, 506.0, (50.0, 50.0))])
    last = dwell_views(later, frames, CAMERA)[-1]
    assert not len(last.frames)
    assert not last.candidates
    assert later[-1].start <= last.image_time <= later[-1].end


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_dwells_show_no_change(count: int) -> None:
    assert not any(view.candidates for view in views_of(DrawnFrames(ONE_BY_ONE[:count])))


def test_progress_brings_candidates_early_and_can_be_stopped() -> None:
    frames, seen = DrawnFrames(ONE_BY_ONE), list[ViewProgress]()
    views = dwell_views(placements_of(ONE_BY_ONE), frames, CAMERA, progress=seen.append, stopped=lambda: len(seen) == 4)
    assert [one.done for one in seen] == [1, 2, 3, 4]
    assert all(view.candidates for view in seen[2].views)
    assert len(views) == 4


def test_pictures_of_dwells_long_ago_are_forgotten_and_their_candidates_kept() -> None:
    dwells = [DrawnDwell(8.0 * k, 8.0 * k + 2.5, (60.3 + 6.0 * k, 60.8 + 70.0 * (k % 2))) for k in range(27)]
    views = views_of(DrawnFrames(dwells))
    assert [bool(view.stills) for view in views] == [False] * 3 + [True] * 24
    assert all(view.candidates for view in views)
