"""A click averaged over its dwell: what it gains, and when it stays alone."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from calib_core.errors import CalibrationError
from calib_core.proposing import DwellView
from calib_core.proposing.dwell_average import averaged_over_dwell
from calib_core.proposing.dwell_views import reflector_width_px
from calib_core.proposing.still_pictures import frames_within
from tests.unit.proposing.drawn_dwells import CAMERA, DrawnDwell, DrawnFrames, placements_of

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
def test_a_click_near_the_apex_is_averaged_over_all_clear_frames(off_px: tuple[float, float]) -> None:
    found = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + off_px)
    assert found is not None
    assert found.frames == len(NUMBERS)
    assert np.hypot(*(found.pixel_px - APEX_PX)) < min(0.3, np.hypot(*off_px))


def test_the_answer_does_not_depend_on_the_click() -> None:
    one = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([1.0, 1.0]))
    other = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX - np.array([1.3, 0.4]))
    assert one is not None
    assert other is not None
    assert np.hypot(*(one.pixel_px - other.pixel_px)) < 0.05


def test_noise_is_averaged_but_never_below_what_all_frames_share() -> None:
    noisy = Shaken(sigma_grey=8.0)
    alone = averaged_over_dwell(view(NUMBERS[:0]), noisy, CLICKED, APEX_PX)
    averaged = averaged_over_dwell(view(), noisy, CLICKED, APEX_PX)
    assert alone is not None
    assert averaged is not None
    assert (alone.frames, averaged.frames) == (1, len(NUMBERS))
    assert np.hypot(*(averaged.pixel_px - APEX_PX)) < np.hypot(*(alone.pixel_px - APEX_PX)) + 0.02
    assert averaged.sigma_px > 0.12


def test_a_shaking_camera_is_followed_and_widens_the_sigma() -> None:
    shifts_px = {int(number): ((-1) ** k, (k % 3) - 1) for k, number in enumerate(NUMBERS)} | {CLICKED: (0, 0)}
    found = averaged_over_dwell(view(), Shaken(shifts_px), CLICKED, APEX_PX + np.array([0.5, 0.5]))
    still = averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([0.5, 0.5]))
    assert found is not None
    assert still is not None
    mean_px = APEX_PX + np.mean([shifts_px[int(number)] for number in NUMBERS], axis=0)
    assert np.hypot(*(found.pixel_px - mean_px)) < 0.3
    assert found.sigma_px > 1.5 * still.sigma_px


def test_frames_of_another_picture_do_not_enter() -> None:
    shifts_px = {int(number): (25, 0) for number in NUMBERS[4:]}
    found = averaged_over_dwell(view(), Shaken(shifts_px), CLICKED, APEX_PX)
    assert found is not None
    assert found.frames == 4
    assert np.hypot(*(found.pixel_px - APEX_PX)) < 0.3


def test_frames_in_which_somebody_stands_before_it_do_not_enter() -> None:
    hidden = replace(FRAMES, people=[(3.0, 6.0, 120, 60, 60, 80)])
    found = averaged_over_dwell(view(), hidden, int(NUMBERS[0]), APEX_PX)
    assert found is not None
    assert found.frames == int((NUMBERS < 6).sum())


def test_a_frame_that_cannot_be_read_is_left_out_unless_it_was_clicked() -> None:
    broken = replace(FRAMES, broken=frozenset({int(NUMBERS[0])}))
    found = averaged_over_dwell(view(), broken, CLICKED, APEX_PX)
    assert found is not None
    assert found.frames == len(NUMBERS) - 1
    with pytest.raises(CalibrationError):
        averaged_over_dwell(view(), broken, int(NUMBERS[0]), APEX_PX)


def test_where_no_apex_is_the_click_is_all_there_is() -> None:
    assert averaged_over_dwell(view(), FRAMES, CLICKED, np.array([280.0, 180.0])) is None
    assert averaged_over_dwell(view(), FRAMES, CLICKED, APEX_PX + np.array([0.0, 9.0])) is None
