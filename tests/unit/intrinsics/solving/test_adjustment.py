"""The adjustment of lens, poses and board: its slopes, and OpenCV as the reference."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.intrinsics.solving.adjustment import adjust, reduced
from calib_core.intrinsics.solving.linearization import (
    Freedom,
    LensState,
    ViewStack,
    linearize,
    possible_warps,
    residuals_of,
    stack_views,
)
from calib_core.intrinsics.solving.starting import pose_views, start
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, drawn_views


def stacked(model: str, count: int = 8, seed: int = 1) -> ViewStack:
    return stack_views(drawn_views(CAMERAS[model], count, seed), BOARD.corners_m, SIZE_PX)


@pytest.mark.parametrize("model", CAMERAS)
def test_the_slopes_are_those_of_the_residuals(model: str) -> None:
    stack, camera = stacked(model, 3), CAMERAS[model]
    warp = possible_warps(BOARD.corners_m)
    posed, _ = pose_views(camera, stack)
    state = LensState(camera, posed.rotations, posed.translations_m, np.array([1e-3, -5e-4, 3e-4, 1e-3]))
    at = linearize(state, stack, Freedom.of(camera, warp=warp))
    count = len(camera.parameters)

    def moved(step: np.ndarray) -> np.ndarray:
        other = camera.with_parameters(camera.parameters + step[:count])
        pose = np.tile(step[count + 4 :], (len(stack), 1))
        return residuals_of(state.moved(other, pose, state.amounts + step[count : count + 4]), stack, warp)

    slopes = np.concatenate([at.shared, at.poses], axis=1)
    for row in range(count + 10):
        step = np.zeros(count + 10)
        step[row] = 1e-3 if row < 4 else 1e-6
        numeric = (moved(step) - moved(-step)) / (2.0 * step[row])
        np.testing.assert_allclose(
            slopes[:, row], numeric.reshape(len(stack), -1), rtol=1e-5, atol=1e-4 * np.abs(numeric).max()
        )


def test_the_optimum_is_that_of_opencv() -> None:
    stack = stacked("plumb_bob", 10)
    stack = replace(stack, pixels_px=stack.pixels_px.astype(np.float32))  # as OpenCV takes them
    first = start("plumb_bob", stack)
    assert first is not None
    ours = adjust(first, stack, Freedom.of(first.camera))
    board = [BOARD.corners_m.astype(np.float32)] * len(stack)
    seen = [np.ascontiguousarray(view.T, dtype=np.float32) for view in stack.pixels_px]
    rms, matrix, distortion, *_ = cv2.calibrateCamera(board, seen, SIZE_PX, None, None, criteria=(3, 300, 1e-16))
    assert np.sqrt(stack.mean_square(residuals_of(ours, stack)).mean()) == pytest.approx(rms, rel=1e-6)
    np.testing.assert_allclose(ours.camera.matrix_px, matrix, rtol=1e-6)
    np.testing.assert_allclose(ours.camera.distortion, distortion.ravel(), rtol=1e-3, atol=1e-6)


def test_at_the_optimum_no_free_number_has_a_gradient() -> None:
    stack = stacked("equidistant")
    first = start("equidistant", stack)
    assert first is not None
    freedom = Freedom.of(first.camera)
    at = reduced(linearize(adjust(first, stack, freedom), stack, freedom))
    scale = np.sqrt(np.diag(at.information.sum(axis=0)))
    assert np.abs(at.gradients.sum(axis=0) / scale).max() < 1e-4


def test_rational_coefficients_that_the_views_leave_free_stay_small() -> None:
    stack = stacked("plumb_bob", 8)
    first = start("rational_polynomial", stack)
    assert first is not None
    free = Freedom(np.eye(12))
    pulled = Freedom.of(first.camera)
    alone, held = adjust(first, stack, free), adjust(first, stack, pulled)
    assert np.abs(held.camera.distortion[-3:]).max() < 1.0
    squares = [stack.mean_square(residuals_of(state, stack)).mean() for state in (alone, held)]
    assert squares[0] <= squares[1] < 1.001 * squares[0]


def test_square_pixels_have_one_focal_length() -> None:
    camera = CAMERAS["pinhole"]
    equal = camera.with_parameters(np.array([900.0, 900.0, 650.0, 350.0]))
    stack = stack_views(drawn_views(equal, 8, 1), BOARD.corners_m, SIZE_PX)
    posed, _ = pose_views(camera, stack)
    state = adjust(
        LensState(equal, posed.rotations, posed.translations_m), stack, Freedom.of(camera, square_pixels=True)
    )
    assert state.camera.matrix_px[0, 0] == state.camera.matrix_px[1, 1]
    assert state.camera.matrix_px[0, 0] == pytest.approx(900.0, abs=3.0)
    assert np.abs(state.camera.matrix_px[:2, 2] - [650.0, 350.0]).max() < 5.0


def test_a_corner_without_weight_changes_nothing() -> None:
    stack = stacked("pinhole")
    state, _ = pose_views(CAMERAS["pinhole"], stack)
    weights = stack.weights.copy()
    weights[2, 7] = 0.0
    pixels = stack.pixels_px.copy()
    pixels[2, :, 7] += 300.0
    moved = ViewStack(stack.board_m, pixels, stack.corner_ids, weights, SIZE_PX)
    freedom = Freedom.of(state.camera)
    one, other = adjust(state, stack.weighted(weights), freedom), adjust(state, moved, freedom)
    np.testing.assert_array_equal(one.camera.parameters, other.camera.parameters)
