"""What is shown over the picture: projection uncertainty, residuals, and halves of the views calibrated apart."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import CameraCovariance
from calib_core.geometry import rotation_exp
from calib_core.intrinsics import (
    CalibratedLens,
    IntrinsicsOptions,
    LensView,
    calibrate_lens,
    projection_uncertainty,
    residual_field,
    split_difference,
)
from calib_core.intrinsics.projection_uncertainty import far_point_slopes
from calib_core.measurements import Unsolvable
from tests.unit.intrinsics.corner_draws import CAMERAS, SIZE_PX, drawn_views, search_of


def calibrated(model: str, count: int = 12, *, truth: str = "") -> CalibratedLens:
    views = drawn_views(CAMERAS[truth or model], count, 9)
    lens = calibrate_lens(search_of(views), IntrinsicsOptions(model=model, board_shape="flat", robust=False))
    assert isinstance(lens, CalibratedLens), lens
    return lens


LENS = calibrated("pinhole")


def test_the_slopes_of_far_points_are_those_of_their_pixels() -> None:
    camera, pixels = CAMERAS["plumb_bob"], np.array([[100.0, 80.0], [900.0, 600.0]])
    rays = camera.rays(pixels)
    lens, turn = far_point_slopes(camera, pixels)
    for column in range(9):
        step = np.zeros(9)
        step[column] = 1e-5
        ahead, behind = (camera.with_parameters(camera.parameters + sign * step).project(rays) for sign in (1, -1))
        np.testing.assert_allclose(lens[:, :, column], (ahead - behind) / 2e-5, rtol=1e-5, atol=1e-5)
    for axis in range(3):
        ahead, behind = (camera.project(rays @ rotation_exp(sign * 1e-6 * np.eye(3)[axis]).T) for sign in (1, -1))
        np.testing.assert_allclose(turn[:, :, axis], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-3)


def test_the_projection_is_surest_where_corners_are_and_less_sure_at_the_edge() -> None:
    grid = projection_uncertainty(LENS, columns=9, rows=7)
    assert grid.sigma_px.shape == (7, 9)
    assert (grid.x_px[0], grid.x_px[-1], grid.y_px[-1]) == (0.0, SIZE_PX[0] - 1.0, SIZE_PX[1] - 1.0)
    assert grid.sigma_px.min() < 0.3 < 2.0 * np.median(grid.sigma_px) < 2.0 * grid.sigma_px.max()


def test_a_shift_of_the_principal_point_that_a_rotation_undoes_is_nearly_no_uncertainty() -> None:
    matrix = np.zeros((4, 4))
    matrix[2, 2] = 100.0  # 10 px
    camera = replace(LENS.camera, covariance=CameraCovariance(LENS.camera.parameter_names, matrix))
    assert np.median(projection_uncertainty(replace(LENS, camera=camera)).sigma_px) < 2.0


def test_residuals_of_the_true_model_are_noise() -> None:
    field = residual_field(LENS)
    assert not field.systematic
    assert abs(field.neighbour_correlation) < 0.15
    assert len(field.pixels_px) == len(field.residuals_px) == field.counts.sum() == 12 * 54
    assert field.sentence == "The residuals show no pattern that is more than noise."


def test_a_pattern_that_all_views_share_is_more_than_noise() -> None:
    def off(view: LensView) -> LensView:
        across = np.sin(view.corners.pixels_px / 150.0)
        return replace(view, residuals_px=view.residuals_px + 0.1 * across)

    field = residual_field(replace(LENS, views=tuple(off(view) for view in LENS.views)))
    assert field.systematic
    assert field.systematic_px == pytest.approx(0.1, abs=0.03)
    assert f"the views share a pattern of {field.systematic_px:.3f} px over the picture" in field.sentence


def test_residuals_of_a_model_that_is_too_simple_are_alike_in_neighbours() -> None:
    field = residual_field(calibrated("pinhole", 25, truth="plumb_bob"))
    assert field.neighbour_correlation > 0.5
    assert "neighbouring corners of a view err alike" in field.sentence


def test_halves_of_the_views_agree_for_the_true_model() -> None:
    agreeing = split_difference(LENS)
    assert not isinstance(agreeing, Unsolvable)
    assert agreeing.agrees
    assert agreeing.apart_px.shape == agreeing.expected_px.shape == (10, 16)


def test_seven_views_are_not_split() -> None:
    answer = split_difference(replace(LENS, views=LENS.views[:7]))
    assert isinstance(answer, Unsolvable)
    assert "7 views cannot be calibrated in halves, 8 can" in answer.reason


@pytest.mark.parametrize("columns", [2, 5])
def test_grids_have_the_wanted_size(columns: int) -> None:
    assert residual_field(LENS, columns=columns, rows=3).means_px.shape == (3, columns, 2)
