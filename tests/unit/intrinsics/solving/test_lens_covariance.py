"""The stated covariance covers the truth: with independent corners, and with errors that a view's corners share."""

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.intrinsics.solving.adjustment import adjust, reduced
from calib_core.intrinsics.solving.lens_covariance import SharedCovariance, shared_covariance
from calib_core.intrinsics.solving.linearization import Freedom, linearize, stack_views
from calib_core.intrinsics.solving.starting import pose_views
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, Errors, drawn_views

CAMERA = CAMERAS["pinhole"]
FREEDOM = Freedom.of(CAMERA)


def fitted(seed: int, errors: Errors, count: int = 12) -> tuple[Camera, SharedCovariance]:
    stack = stack_views(drawn_views(CAMERA, count, seed, errors), BOARD.corners_m, SIZE_PX)
    state = adjust(pose_views(CAMERA, stack)[0], stack, FREEDOM)
    return state.camera, shared_covariance(reduced(linearize(state, stack, FREEDOM)))


@pytest.mark.parametrize("errors", [Errors(), Errors(0.05, shared_px=0.1), Errors(motion_px_per_s=60.0)])
def test_the_stated_sigma_covers_the_truth(errors: Errors) -> None:
    inside = []
    for seed in range(40):
        camera, covariance = fitted(seed, errors)
        off = np.abs(camera.parameters - CAMERA.parameters)
        inside.append(off < 1.96 * np.sqrt(np.diag(covariance.matrix)))
    assert 0.90 <= np.mean(inside) <= 0.99  # of 160 numbers, in fours from one fit; 0.95 and two standard errors


def test_errors_that_neighbours_share_make_the_sigma_larger_than_counting_corners_would() -> None:
    independent, shared = fitted(0, Errors(0.1)), fitted(0, Errors(0.01, shared_px=0.1))
    assert shared[1].matrix[0, 0] > 4.0 * independent[1].matrix[0, 0]


def test_a_number_far_from_zero_in_its_sigmas_is_unlikely_to_be_zero() -> None:
    covariance = SharedCovariance(np.diag([1.0, 4.0]), np.array([1e6, 5.0]))
    assert covariance.chances(np.array([1.96, 2.0 * 1.96])) == pytest.approx([0.05, 0.05], abs=1e-4)
    assert covariance.chances(np.array([20.0]), first=1)[0] < 1e-4
