"""Calibrating a lens: what is stated of each view, and what is said if the views do not suffice."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.geometry import rotation_exp
from calib_core.intrinsics import BoardCorners, CalibratedLens, IntrinsicsOptions, calibrate_lens
from calib_core.measurements import Unsolvable
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, drawn_views, search_of

PINHOLE = IntrinsicsOptions(model="pinhole")
VIEWS = drawn_views(CAMERAS["pinhole"], 10, 21)


def calibrated(*views: BoardCorners) -> CalibratedLens:
    lens = calibrate_lens(search_of(views), PINHOLE)
    assert isinstance(lens, CalibratedLens), lens
    return lens


def test_each_view_states_its_pose_its_residuals_and_its_error_if_left_out() -> None:
    lens = calibrated(*VIEWS)
    for view in lens.views:
        projected = lens.camera.project(view.camera_from_board @ BOARD.corners_m)
        np.testing.assert_allclose(view.residuals_px, projected - view.corners.pixels_px, atol=1e-9)
        assert view.rms_px == pytest.approx(np.sqrt(np.square(view.residuals_px).sum(axis=1).mean()))
        assert view.rms_px < view.held_out_rms_px < 1.5 * view.rms_px
    assert lens.rms_px == pytest.approx(np.sqrt(np.mean([view.rms_px**2 for view in lens.views])))
    assert lens.rms_px < lens.held_out_rms_px < 0.16


def test_the_same_views_give_the_same_bytes() -> None:
    one, other = calibrated(*VIEWS), calibrated(*VIEWS)
    assert one.camera.parameters.tobytes() == other.camera.parameters.tobytes()
    assert one.camera.covariance is not None
    assert other.camera.covariance is not None
    assert one.camera.covariance.matrix.tobytes() == other.camera.covariance.matrix.tobytes()
    assert (one.choice, one.warnings) == (other.choice, other.warnings)


def test_two_views_are_too_few() -> None:
    answer = calibrate_lens(search_of(VIEWS[:2]), PINHOLE)
    assert isinstance(answer, Unsolvable)
    assert (answer.code, answer.reason) == ("few-views", "2 usable views of the board, at least 3 are needed")


def test_views_from_one_direction_leave_the_focal_length_open() -> None:
    rng, views = np.random.default_rng(1), []
    for index in range(10):
        shift = np.array([*rng.uniform(-0.2, 0.1, 2), rng.uniform(0.5, 0.9)])
        turn = rotation_exp(np.array([0.0, 0.0, rng.normal(0.0, 0.1)]))
        pixels = CAMERAS["pinhole"].project(BOARD.corners_m @ turn.T + shift) + rng.normal(0.0, 0.2, (54, 2))
        views.append(BoardCorners(index, str(index), None, SIZE_PX, np.arange(54), pixels))
    answer = calibrate_lens(search_of(tuple(views)), PINHOLE)
    assert isinstance(answer, Unsolvable), answer.camera.covariance
    assert answer.code == "parallel-views"
    assert answer.reason.startswith("the board is turned by ")
    assert "turned by 30 to 45 deg to the left, right, up and down" in answer.hint


def test_corners_that_nothing_explains_are_no_calibration() -> None:
    rng = np.random.default_rng(2)
    noise = tuple(replace(view, pixels_px=rng.uniform(0.0, 700.0, (54, 2))) for view in VIEWS)
    answer = calibrate_lens(search_of(noise))
    assert isinstance(answer, Unsolvable), answer
    assert answer.code in ("no-lens", "few-views", "parallel-views")


def test_a_picture_of_another_size_is_left_out_by_name() -> None:
    lens = calibrated(*VIEWS[:9], replace(VIEWS[9], size_px=(640, 480)))
    (picture,) = lens.left_out
    assert (picture.name, picture.reason) == ("view 9", "it has 640 x 480 pixels, not 1280 x 720")


def test_a_corner_of_the_picture_without_views_is_warned_about() -> None:
    left = [view for view in drawn_views(CAMERAS["pinhole"], 60, 3) if view.pixels_px[:, 0].max() < 700.0]
    assert len(left) >= 5
    (warning,) = [warning for warning in calibrated(*left).warnings if warning.code == "little-covered"]
    assert "% of the picture; beyond them the lens is a guess" in warning.message


def test_a_cancelled_calibration_says_so_and_named_its_steps() -> None:
    steps: list[str] = []
    answer = calibrate_lens(search_of(VIEWS), PINHOLE, progress=steps.append, stopped=lambda: len(steps) == 2)
    assert isinstance(answer, Unsolvable)
    assert answer.code == "stopped"
    assert steps == ["comparing the views", "choosing a lens model"]


def test_pictures_that_were_resized_out_of_proportion_show_in_the_focal_lengths() -> None:
    squeezed = tuple(replace(view, pixels_px=view.pixels_px * [0.9, 1.0]) for view in VIEWS)
    codes = {warning.code for warning in calibrated(*squeezed).warnings}
    assert "unequal-focal-lengths" in codes


@pytest.mark.parametrize(
    ("ids", "reason"),
    [
        (np.arange(5), "only 5 corners of the board; a view needs 6"),
        (np.arange(9, 18), "its corners are on one line of the board"),
    ],
)
def test_a_view_that_cannot_be_posed_is_left_out_by_name(ids: np.ndarray, reason: str) -> None:
    partial = replace(VIEWS[9], corner_ids=ids, pixels_px=VIEWS[9].pixels_px[ids])
    (picture,) = calibrated(*VIEWS[:9], partial).left_out
    assert (picture.name, picture.reason) == ("view 9", reason)


def test_one_view_given_many_times_is_no_calibration() -> None:
    answer = calibrate_lens(search_of(tuple(replace(VIEWS[0], index=index) for index in range(6))), PINHOLE)
    assert isinstance(answer, Unsolvable), answer.camera.parameters
    assert answer.code == "parallel-views"
