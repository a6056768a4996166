"""The adjustment of lens, poses and board: its slopes, and OpenCV as the reference."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.intrinsics import BoardCorners
from calib_core.intrinsics.adjustment import SharedCovariance, adjust, pose_views, reduced, shared_covariance, start
from calib_core.intrinsics.linearization import (
    Freedom,
    LensState,
    ViewStack,
    linearize,
    possible_warps,
    residuals_of,
    stack_views,
)
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, Errors, drawn_views


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


@pytest.mark.parametrize("model", CAMERAS)
def test_from_the_start_an_adjustment_reaches_the_noise(model: str) -> None:
    stack = stack_views(drawn_views(CAMERAS[model], 12, 4), BOARD.corners_m, SIZE_PX)
    first = start(model, stack)
    assert first is not None
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.sqrt(stack.mean_square(residuals_of(state, stack)).mean()) < 0.145
    assert state.camera.matrix_px[0, 0] == pytest.approx(CAMERAS[model].matrix_px[0, 0], rel=0.01)


def test_a_fisheye_of_200_degrees_is_found() -> None:
    matrix = np.array([[280.0, 0.0, 500.0], [0.0, 281.0, 490.0], [0.0, 0.0, 1.0]])
    camera = Camera("equidistant", 1000, 1000, matrix, np.array([0.01, -0.004, 0.001, -0.0001]))
    rng, board_m = np.random.default_rng(3), BOARD.corners_m - BOARD.corners_m.mean(axis=0)
    views = []
    for index in range(16):
        angle, around = rng.uniform(0.0, 1.6), 2.0 * np.pi * index / 16
        look = rotation_exp(angle * np.array([-np.sin(around), np.cos(around), 0.0]))
        turn = look @ rotation_exp(rng.uniform(-0.5, 0.5, 3))
        pixels = camera.project(board_m @ turn.T + look @ [0.0, 0.0, 0.25])
        views.append(
            BoardCorners(index, str(index), None, (1000, 1000), np.arange(54), pixels + rng.normal(0, 0.1, (54, 2)))
        )
    stack = stack_views(views, BOARD.corners_m, (1000, 1000))
    first = start("equidistant", stack)
    assert first is not None
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.abs(state.camera.parameters[:4] - camera.parameters[:4]).max() < 0.5
    most = max(np.degrees(np.arccos(state.camera.rays(view.pixels_px)[:, 2])).max() for view in views)
    assert most > 90.0


def test_poses_without_noise_are_exact() -> None:
    camera = CAMERAS["plumb_bob"]
    stack = stack_views(drawn_views(camera, 5, 2, Errors(noise_px=0.0)), BOARD.corners_m, SIZE_PX)
    state, posed = pose_views(camera, stack)
    assert posed.corner_counts.tolist() == [54] * 5
    assert np.abs(residuals_of(state, stack)).max() < 1e-6


def test_a_third_of_views_that_show_something_else_does_not_mislead_the_start() -> None:
    views = drawn_views(CAMERAS["plumb_bob"], 12, 6)
    rng = np.random.default_rng(0)
    strange = [
        BoardCorners(12 + n, f"strange {n}", None, SIZE_PX, np.arange(54), rng.uniform(0, 700, (54, 2)))
        for n in range(5)
    ]
    first = start("plumb_bob", stack_views([*views, *strange], BOARD.corners_m, SIZE_PX))
    assert first is not None
    assert first.camera.matrix_px[0, 0] == pytest.approx(900.0, rel=0.01)


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
