"""What changed in the images of dwells, in small drawn images with a known apex."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import CalibrationError
from calib_core.proposing import DwellView, ViewProgress, dwell_views
from calib_core.proposing.appearance import Appearance, appearance_of, with_appearance
from calib_core.proposing.dwell_views import averaged_over_dwell, reflector_width_px
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.still_images import frames_within, stack_median
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


APEX_PX = np.array([150.3, 100.8])
FRAMES = DrawnFrames((DrawnDwell(0.0, 6.0, (150.3, 100.8), 3.0),))
PLACEMENT = placements_of(FRAMES.dwells)[0]
NUMBERS = frames_within(PLACEMENT, FRAMES.image_times)
CLICKED = int(NUMBERS[3])


@dataclass
class Shaken:
    """The same frames, each shifted by whole pixels of its own, and noisy."""

    shifts_px: dict[int, tuple[int, int]] = field(default_factory=dict)
    sigma_grey: float = 0.0

    @property
    def image_times(self) -> np.ndarray:
        return FRAMES.image_times

    def image(self, index: int, /) -> np.ndarray:
        column, row = self.shifts_px.get(index, (0, 0))
        moved = np.roll(FRAMES.image(index), (row, column), axis=(0, 1))
        noise = np.random.default_rng(index).normal(0.0, self.sigma_grey, moved.shape)
        return np.asarray((moved + noise).clip(0.0, 255.0).astype(np.uint8))


def view(numbers: np.ndarray = NUMBERS) -> DwellView:
    width_px = reflector_width_px(PLACEMENT, CAMERA, 0.24)
    time = FRAMES.image_times[CLICKED]
    return DwellView(PLACEMENT, NUMBERS, time, np.zeros((0, 0, 3), np.uint8), 1.0, width_px=width_px, clear=numbers)


@pytest.mark.parametrize("off_px", [(0.5, -0.4), (-1.8, 1.5), (3.0, 2.0)])
def test_a_click_near_the_apex_is_averaged_over_all_clear_frames(off_px):
    found = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + off_px)
    assert found.frames == len(NUMBERS)
    assert np.hypot(*(found.pixel_px - APEX_PX)) < min(0.3, np.hypot(*off_px))


def test_the_answer_does_not_depend_on_the_click():
    one = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([1.0, 1.0]))
    other = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX - np.array([1.3, 0.4]))
    assert np.hypot(*(one.pixel_px - other.pixel_px)) < 0.05


def test_noise_is_averaged_but_never_below_what_all_frames_share():
    noisy = Shaken(sigma_grey=8.0)
    alone = averaged_over_dwell(view(NUMBERS[:0]), noisy, CLICKED, APEX_PX)
    averaged = averaged_over_dwell(view(), noisy, CLICKED, APEX_PX)
    assert (alone.frames, averaged.frames) == (1, len(NUMBERS))
    assert np.hypot(*(averaged.pixel_px - APEX_PX)) < np.hypot(*(alone.pixel_px - APEX_PX)) + 0.02
    assert averaged.sigma_px > 0.12


def test_a_shaking_camera_is_followed_and_widens_the_sigma():
    shifts_px = {int(number): ((-1) ** k, (k % 3) - 1) for k, number in enumerate(NUMBERS)} | {CLICKED: (0, 0)}
    found = averaged_over_dwell(view(), Shaken(shifts_px), CLICKED, APEX_PX + np.array([0.5, 0.5]))
    still = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([0.5, 0.5]))
    mean_px = APEX_PX + np.mean([shifts_px[int(number)] for number in NUMBERS], axis=0)
    assert np.hypot(*(found.pixel_px - mean_px)) < 0.3
    assert found.sigma_px > 1.5 * still.sigma_px


def test_frames_of_another_image_do_not_enter():
    shifts_px = {int(number): (25, 0) for number in NUMBERS[4:]}
    found = averaged_over_dwell(view(), Shaken(shifts_px), CLICKED, APEX_PX)
    assert found.frames == 4
    assert np.hypot(*(found.pixel_px - APEX_PX)) < 0.3


def test_frames_in_which_somebody_stands_before_it_do_not_enter():
    hidden = replace(FRAMES, people=[(3.0, 6.0, 120, 60, 60, 80)])
    found = averaged_over_dwell(view(), hidden, int(NUMBERS[0]), APEX_PX)
    assert found.frames == int((NUMBERS < 6).sum())


def test_a_frame_that_cannot_be_read_is_left_out_unless_it_was_clicked():
    broken = replace(FRAMES, broken=frozenset({int(NUMBERS[0])}))
    found = averaged_over_dwell(view(), broken, CLICKED, APEX_PX)
    assert found.frames == len(NUMBERS) - 1
    with pytest.raises(CalibrationError):
        averaged_over_dwell(view(), broken, int(NUMBERS[0]), APEX_PX)


def test_where_no_apex_is_the_click_is_all_there_is():
    assert averaged_over_dwell(view(), FRAMES, CLICKED, np.array([280.0, 180.0])) is None
    assert averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([0.0, 9.0])) is None


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
