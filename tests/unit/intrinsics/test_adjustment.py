"""The adjustment of lens, poses and board: its slopes, and OpenCV as the reference."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.intrinsics.adjustment import SharedCovariance, adjust, pose_views, reduced, shared_covariance, start
from calib_core.intrinsics.bad_views import judge_views, mirror_twins
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.linearization import (
    Freedom,
    LensState,
    ViewStack,
    linearize,
    possible_warps,
    residuals_of,
    stack_views,
)
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, Errors, drawn_views, search_of


def stacked(model: str, count: int = 8, seed: int = 1) -> ViewStack:
    return stack_views(drawn_views(CAMERAS[model], count, seed), BOARD.corners_m, SIZE_PX)


@pytest.mark.parametrize("model", CAMERAS)
def test_the_slopes_are_those_of_the_residuals(model):
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


def test_the_optimum_is_that_of_opencv():
    stack = stacked("plumb_bob", 10)
    stack = replace(stack, pixels_px=stack.pixels_px.astype(np.float32))  # as OpenCV takes them
    first = start("plumb_bob", stack)
    ours = adjust(first, stack, Freedom.of(first.camera))
    board = [BOARD.corners_m.astype(np.float32)] * len(stack)
    seen = [np.ascontiguousarray(view.T, dtype=np.float32) for view in stack.pixels_px]
    rms, matrix, distortion, *_ = cv2.calibrateCamera(board, seen, SIZE_PX, None, None, criteria=(3, 300, 1e-16))
    assert np.sqrt(stack.mean_square(residuals_of(ours, stack)).mean()) == pytest.approx(rms, rel=1e-6)
    np.testing.assert_allclose(ours.camera.matrix_px, matrix, rtol=1e-6)
    np.testing.assert_allclose(ours.camera.distortion, distortion.ravel(), rtol=1e-3, atol=1e-6)


def test_at_the_optimum_no_free_number_has_a_gradient():
    stack = stacked("equidistant")
    first = start("equidistant", stack)
    freedom = Freedom.of(first.camera)
    at = reduced(linearize(adjust(first, stack, freedom), stack, freedom))
    scale = np.sqrt(np.diag(at.information.sum(axis=0)))
    assert np.abs(at.gradients.sum(axis=0) / scale).max() < 1e-4


def test_rational_coefficients_that_the_views_leave_free_stay_small():
    stack = stacked("plumb_bob", 8)
    first = start("rational_polynomial", stack)
    free = Freedom(np.eye(12))
    pulled = Freedom.of(first.camera)
    alone, held = adjust(first, stack, free), adjust(first, stack, pulled)
    assert np.abs(held.camera.distortion[-3:]).max() < 1.0
    squares = [stack.mean_square(residuals_of(state, stack)).mean() for state in (alone, held)]
    assert squares[0] <= squares[1] < 1.001 * squares[0]


def test_a_corner_without_weight_changes_nothing():
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
def test_from_the_start_an_adjustment_reaches_the_noise(model):
    stack = stack_views(drawn_views(CAMERAS[model], 12, 4), BOARD.corners_m, SIZE_PX)
    first = start(model, stack)
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.sqrt(stack.mean_square(residuals_of(state, stack)).mean()) < 0.145
    assert state.camera.matrix_px[0, 0] == pytest.approx(CAMERAS[model].matrix_px[0, 0], rel=0.01)


def test_a_fisheye_of_200_degrees_is_found():
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
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.abs(state.camera.parameters[:4] - camera.parameters[:4]).max() < 0.5
    most = max(np.degrees(np.arccos(state.camera.rays(view.pixels_px)[:, 2])).max() for view in views)
    assert most > 90.0


def test_poses_without_noise_are_exact():
    camera = CAMERAS["plumb_bob"]
    stack = stack_views(drawn_views(camera, 5, 2, Errors(noise_px=0.0)), BOARD.corners_m, SIZE_PX)
    state, posed = pose_views(camera, stack)
    assert posed.corner_counts.tolist() == [54] * 5
    assert np.abs(residuals_of(state, stack)).max() < 1e-6


def test_a_third_of_views_that_show_something_else_does_not_mislead_the_start():
    views = drawn_views(CAMERAS["plumb_bob"], 12, 6)
    rng = np.random.default_rng(0)
    strange = [
        BoardCorners(12 + n, f"strange {n}", None, SIZE_PX, np.arange(54), rng.uniform(0, 700, (54, 2)))
        for n in range(5)
    ]
    first = start("plumb_bob", stack_views([*views, *strange], BOARD.corners_m, SIZE_PX))
    assert first.camera.matrix_px[0, 0] == pytest.approx(900.0, rel=0.01)


CAMERA = CAMERAS["pinhole"]
FREEDOM = Freedom.of(CAMERA)


def fitted(seed: int, errors: Errors, count: int = 12) -> tuple[Camera, SharedCovariance]:
    stack = stack_views(drawn_views(CAMERA, count, seed, errors), BOARD.corners_m, SIZE_PX)
    state = adjust(pose_views(CAMERA, stack)[0], stack, FREEDOM)
    return state.camera, shared_covariance(reduced(linearize(state, stack, FREEDOM)))


@pytest.mark.slow
@pytest.mark.parametrize("errors", [Errors(), Errors(0.05, shared_px=0.1), Errors(motion_px_per_s=60.0)])
def test_the_stated_sigma_covers_the_truth(errors):
    inside = []
    for seed in range(40):
        camera, covariance = fitted(seed, errors)
        off = np.abs(camera.parameters - CAMERA.parameters)
        inside.append(off < 1.96 * np.sqrt(np.diag(covariance.matrix)))
    assert 0.90 <= np.mean(inside) <= 0.99  # of 160 numbers, in fours from one fit; 0.95 and two standard errors


def test_errors_that_neighbours_share_make_the_sigma_larger_than_counting_corners_would():
    independent, shared = fitted(0, Errors(0.1)), fitted(0, Errors(0.01, shared_px=0.1))
    assert shared[1].matrix[0, 0] > 4.0 * independent[1].matrix[0, 0]


def test_a_number_far_from_zero_in_its_sigmas_is_unlikely_to_be_zero():
    covariance = SharedCovariance(np.diag([1.0, 4.0]), np.array([1e6, 5.0]))
    assert covariance.chances(np.array([1.96, 2.0 * 1.96])) == pytest.approx([0.05, 0.05], abs=1e-4)
    assert covariance.chances(np.array([20.0]), first=1)[0] < 1e-4


# A board that is bent or printed too long is found and taken into account; a flat one stays flat.


def calibrated(errors: Errors, seed: int = 5) -> CalibratedLens:
    lens = calibrate_lens(search_of(drawn_views(CAMERAS["plumb_bob"], 14, seed, errors)), "plumb_bob")
    assert isinstance(lens, CalibratedLens), lens
    return lens


def test_a_bent_board_is_measured_and_does_not_bend_the_lens():
    lens = calibrated(Errors(bend_m=0.0014))
    (warning,) = [warning for warning in lens.warnings if warning.code == "bent-board"]
    ((bend_mm, _),) = warning.facts["bends_mm"].values()
    assert abs(bend_mm) == pytest.approx(1.3, abs=0.1)
    assert warning.facts["modelled"]
    middle = lens.board_shape_m[4] - (lens.board_shape_m[0] + lens.board_shape_m[8]) / 2.0
    assert 1e3 * middle[2] == pytest.approx(1.4, abs=0.06)
    assert lens.camera.matrix_px[0, 0] == pytest.approx(900.0, rel=0.004)


def test_squares_that_are_longer_one_way_are_measured():
    lens = calibrated(Errors(stretch=0.02))
    (warning,) = [warning for warning in lens.warnings if warning.code == "unequal-squares"]
    assert warning.facts["stretch"] == pytest.approx(0.02, abs=0.002)
    assert np.ptp(lens.board_shape_m[:, 0]) == pytest.approx(1.02 * np.ptp(BOARD.corners_m[:, 0]), rel=1e-3)


def test_a_flat_board_stays_as_stated():
    lens = calibrated(Errors())
    np.testing.assert_array_equal(lens.board_shape_m, BOARD.corners_m)
    assert not {warning.code for warning in lens.warnings} & {"bent-board", "unequal-squares"}


def test_motion_under_a_rolling_shutter_is_told_from_noise():
    still, moving = calibrated(Errors(0.05, shared_px=0.1)), calibrated(Errors(motion_px_per_s=300.0))
    assert "skewed-views" not in {warning.code for warning in still.warnings}
    assert "skewed-views" in {warning.code for warning in moving.warnings}


# The lens model that is chosen is the one the views were made with, unless a simpler one predicts as well.


@pytest.mark.slow
@pytest.mark.parametrize("model", CAMERAS)
def test_the_true_model_is_chosen_with_a_reason(model):
    lens = calibrate_lens(search_of(drawn_views(CAMERAS[model], 16, 5)))
    assert isinstance(lens, CalibratedLens), lens
    assert lens.camera.model == model
    assert lens.choice.startswith(model)
    assert [trial.model for trial in lens.trials] == ["pinhole", "plumb_bob", "equidistant", "rational_polynomial"]
    (chosen,) = [trial for trial in lens.trials if trial.model == model]
    assert (chosen.worse_by, chosen.standard_error, chosen.fault) == (0.0, 0.0, "")
    assert all(trial.held_out_rms_px > trial.rms_px for trial in lens.trials if not trial.fault)
    assert lens.left_out == ()


# Views and corners that do not belong to the others are named, and no others.


def solved(*views: BoardCorners) -> CalibratedLens:
    lens = calibrate_lens(search_of(views), "plumb_bob")
    assert isinstance(lens, CalibratedLens), lens
    return lens


def planted(view: BoardCorners, pixels_px: np.ndarray, name: str, blur_px: float = float("nan")) -> BoardCorners:
    return replace(view, index=100, name=name, pixels_px=pixels_px, blur_px=blur_px)


GOOD = drawn_views(CAMERAS["plumb_bob"], 12, 11)


@pytest.mark.slow
@pytest.mark.parametrize(
    "errors", [Errors(), Errors(0.05, shared_px=0.1), Errors(motion_px_per_s=60.0), Errors(noise_px=0.0)]
)
def test_no_good_view_and_no_good_corner_is_dropped(errors):
    lens = solved(*drawn_views(CAMERAS["plumb_bob"], 15, 1, errors))
    assert lens.left_out == ()
    assert all(view.used.all() for view in lens.views)


def test_a_mirrored_image_is_called_mirrored():
    camera = CAMERAS["plumb_bob"]
    off_middle = camera.with_parameters(camera.parameters - [0, 0, 80, 0, 0, 0, 0, 0, 0])
    good = drawn_views(off_middle, 12, 11)
    mirrored = good[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0]
    lens = solved(*good, planted(good[3], mirrored, "mirror"))
    assert [image.name for image in lens.left_out] == ["mirror"]
    assert lens.left_out[0].reason.startswith("mirrored: ")


def test_a_board_with_markers_is_never_called_mirrored():
    camera = CAMERAS["plumb_bob"]
    views = drawn_views(camera.with_parameters(camera.parameters - [0, 0, 80, 0, 0, 0, 0, 0, 0]), 12, 11)
    views = [*views, planted(views[3], views[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0], "flipped")]
    stack = stack_views(views, BOARD.corners_m, SIZE_PX)
    state = start("plumb_bob", stack)
    assert state is not None
    for possible in (True, False):
        reason = judge_views(views, stack, state, may_be_mirrored=possible).reasons[-1]
        assert reason.startswith("mirrored") is possible


def test_of_two_mirror_images_the_mirrored_one_is_named_though_the_lens_is_symmetric():
    camera = CAMERAS["plumb_bob"]
    middle = 0.5 * (SIZE_PX[0] - 1.0)
    parameters = camera.parameters.copy()
    parameters[2], parameters[7] = middle + 4.0, 0.0
    good = drawn_views(camera.with_parameters(parameters), 12, 11)
    twin = good[3].pixels_px * [-1.0, 1.0] + [2.0 * middle, 0.0]
    lens = solved(*good, planted(good[3], twin, "mirror"))
    assert [image.name for image in lens.left_out] == ["mirror"]
    assert lens.left_out[0].reason.startswith("mirrored: ")


def test_two_views_taken_apart_that_look_like_mirror_images_are_both_used():
    good = drawn_views(CAMERAS["plumb_bob"], 12, 11)
    other = good[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0]
    apart = np.random.default_rng(2).normal(0.0, 1.5, 2)
    stack = stack_views([good[3], planted(good[3], other + apart, "apart")], BOARD.corners_m, SIZE_PX)
    assert mirror_twins(stack, 0.2) == ()
    copied = stack_views([good[3], planted(good[3], other + 0.02, "copied")], BOARD.corners_m, SIZE_PX)
    assert mirror_twins(copied, 0.2) == ((0, 1),)


@pytest.mark.slow
def test_a_board_with_other_squares_is_called_another_board():
    camera = CAMERAS["plumb_bob"]
    pose = solved(*GOOD).views[2].camera_from_board
    other = camera.project(pose @ (BOARD.corners_m * [1.0, 1.2, 1.0]))
    lens = solved(*GOOD, planted(GOOD[2], other, "other"))
    assert [image.name for image in lens.left_out] == ["other"]
    assert lens.left_out[0].reason.startswith("another board: ")
    assert "0.83 times as wide" in lens.left_out[0].reason


def test_a_wrong_detection_fits_no_pose():
    lens = solved(*GOOD, planted(GOOD[4], np.roll(GOOD[4].pixels_px, 1, axis=0), "rolled"))
    assert [image.name for image in lens.left_out] == ["rolled"]
    assert "another board, or" in lens.left_out[0].reason


def test_a_blurred_view_is_called_blurred():
    rng = np.random.default_rng(8)
    sharp = [replace(view, blur_px=0.9) for view in GOOD]
    blurred = [
        planted(view, view.pixels_px + rng.normal(0.0, 0.3, (54, 2)), f"blurred {n}", 3.0)
        for n, view in enumerate(GOOD[:3])
    ]
    lens = solved(*sharp, *blurred)
    assert [image.name for image in lens.left_out] == ["blurred 0", "blurred 1", "blurred 2"]
    assert re.findall(r"[\d.]+ px", lens.left_out[0].reason)[:2] == ["3.0 px", "0.9 px"]
    assert lens.left_out[0].reason.startswith("blurred: ")


def test_a_corner_that_jumped_by_a_square_is_left_out_and_its_view_kept():
    pixels = GOOD[5].pixels_px.copy()
    pixels[20] = pixels[21]
    lens = solved(*GOOD[:5], replace(GOOD[5], pixels_px=pixels), *GOOD[6:])
    assert lens.left_out == ()
    assert np.flatnonzero(~lens.views[5].used).tolist() == [20]
    assert all(view.used.all() for row, view in enumerate(lens.views) if row != 5)
    assert lens.rms_px < 0.15


def test_views_with_some_of_the_corners_are_used():
    some = replace(GOOD[0], corner_ids=np.arange(10, 40), pixels_px=GOOD[0].pixels_px[10:40])
    lens = solved(some, *GOOD[1:])
    assert lens.left_out == ()
    assert len(lens.views[0].residuals_px) == 30
