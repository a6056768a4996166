"""A board that is bent or printed too long is found and taken into account; a flat one stays flat."""

import numpy as np
import pytest

from calib_core.intrinsics import CalibratedLens, IntrinsicsOptions, calibrate_lens
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, Errors, drawn_views, search_of


def calibrated(errors: Errors, board_shape: str = "auto", seed: int = 5) -> CalibratedLens:
    options = IntrinsicsOptions(model="plumb_bob", board_shape=board_shape)
    lens = calibrate_lens(search_of(drawn_views(CAMERAS["plumb_bob"], 14, seed, errors)), options)
    assert isinstance(lens, CalibratedLens), lens
    return lens


def test_a_bent_board_is_measured_and_does_not_bend_the_lens() -> None:
    lens = calibrated(Errors(bend_m=0.0014))
    (warning,) = [warning for warning in lens.warnings if warning.code == "bent-board"]
    assert "the board is bent by 1.3" in warning.message
    assert "mm in the middle of its rows; it was taken into account" in warning.message
    middle = lens.board_shape_m[4] - (lens.board_shape_m[0] + lens.board_shape_m[8]) / 2.0
    assert 1e3 * middle[2] == pytest.approx(1.4, abs=0.06)
    assert lens.camera.matrix_px[0, 0] == pytest.approx(900.0, rel=0.004)


def test_squares_that_are_longer_one_way_are_measured() -> None:
    lens = calibrated(Errors(stretch=0.02))
    (warning,) = [warning for warning in lens.warnings if warning.code == "unequal-squares"]
    assert "% wider than high; it was taken into account" in warning.message
    assert np.ptp(lens.board_shape_m[:, 0]) == pytest.approx(1.02 * np.ptp(BOARD.corners_m[:, 0]), rel=1e-3)


def test_a_flat_board_stays_as_stated() -> None:
    lens = calibrated(Errors())
    np.testing.assert_array_equal(lens.board_shape_m, BOARD.corners_m)
    assert not {warning.code for warning in lens.warnings} & {"bent-board", "unequal-squares"}


def test_a_bend_that_must_not_be_modelled_is_warned_about_and_enters_the_sigma() -> None:
    lens = calibrated(Errors(bend_m=0.0014), "flat")
    assert any("it was not taken into account, because board_shape is flat" in one.message for one in lens.warnings)
    assert lens.camera.covariance is not None
    off_px = abs(lens.camera.matrix_px[0, 0] - 900.0)
    assert 5.0 < off_px < 1.96 * lens.camera.covariance.sigma("fx_px")


def test_motion_under_a_rolling_shutter_is_told_from_noise() -> None:
    still, moving = calibrated(Errors(0.05, shared_px=0.1)), calibrated(Errors(motion_px_per_s=300.0))
    assert "skewed-views" not in {warning.code for warning in still.warnings}
    (warning,) = [warning for warning in moving.warnings if warning.code == "skewed-views"]
    assert "a board that moved under a rolling shutter" in warning.message
