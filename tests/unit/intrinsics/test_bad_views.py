"""Views and corners that do not belong to the others are named, and no others."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.intrinsics import BoardCorners, CalibratedLens, IntrinsicsOptions, calibrate_lens
from calib_core.intrinsics.adjustment import start
from calib_core.intrinsics.bad_views import judge_views, mirror_twins
from calib_core.intrinsics.linearization import stack_views
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, Errors, drawn_views, search_of

OPTIONS = IntrinsicsOptions(model="plumb_bob")


def calibrated(*views: BoardCorners, options: IntrinsicsOptions = OPTIONS) -> CalibratedLens:
    lens = calibrate_lens(search_of(views), options)
    assert isinstance(lens, CalibratedLens), lens
    return lens


def planted(view: BoardCorners, pixels_px: np.ndarray, name: str, blur_px: float = float("nan")) -> BoardCorners:
    return replace(view, index=100, name=name, pixels_px=pixels_px, blur_px=blur_px)


GOOD = drawn_views(CAMERAS["plumb_bob"], 12, 11)


@pytest.mark.parametrize(
    "errors", [Errors(), Errors(0.05, shared_px=0.1), Errors(motion_px_per_s=60.0), Errors(noise_px=0.0)]
)
def test_no_good_view_and_no_good_corner_is_dropped(errors: Errors) -> None:
    lens = calibrated(*drawn_views(CAMERAS["plumb_bob"], 15, 1, errors))
    assert lens.left_out == ()
    assert all(view.used.all() for view in lens.views)


def test_a_mirrored_picture_is_called_mirrored() -> None:
    camera = CAMERAS["plumb_bob"]
    off_middle = camera.with_parameters(camera.parameters - [0, 0, 80, 0, 0, 0, 0, 0, 0])
    good = drawn_views(off_middle, 12, 11)
    mirrored = good[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0]
    lens = calibrated(*good, planted(good[3], mirrored, "mirror"))
    assert [picture.name for picture in lens.left_out] == ["mirror"]
    assert lens.left_out[0].reason.startswith("mirrored: with left and right exchanged its corners fit to 0.1")


def test_a_board_with_markers_is_never_called_mirrored() -> None:
    camera = CAMERAS["plumb_bob"]
    views = drawn_views(camera.with_parameters(camera.parameters - [0, 0, 80, 0, 0, 0, 0, 0, 0]), 12, 11)
    views = [*views, planted(views[3], views[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0], "flipped")]
    stack = stack_views(views, BOARD.corners_m, SIZE_PX)
    state = start("plumb_bob", stack)
    assert state is not None
    for possible in (True, False):
        reason = judge_views(views, stack, state, may_be_mirrored=possible).reasons[-1]
        assert reason.startswith("mirrored") is possible


def test_of_two_mirror_images_the_mirrored_one_is_named_though_the_lens_is_symmetric() -> None:
    camera = CAMERAS["plumb_bob"]
    middle = 0.5 * (SIZE_PX[0] - 1.0)
    parameters = camera.parameters.copy()
    parameters[2], parameters[7] = middle + 4.0, 0.0
    good = drawn_views(camera.with_parameters(parameters), 12, 11)
    twin = good[3].pixels_px * [-1.0, 1.0] + [2.0 * middle, 0.0]
    lens = calibrated(*good, planted(good[3], twin, "mirror"))
    assert [picture.name for picture in lens.left_out] == ["mirror"]
    assert lens.left_out[0].reason.startswith("mirrored: ")


def test_two_views_taken_apart_that_look_like_mirror_images_are_both_used() -> None:
    good = drawn_views(CAMERAS["plumb_bob"], 12, 11)
    other = good[3].pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0]
    apart = np.random.default_rng(2).normal(0.0, 1.5, 2)
    stack = stack_views([good[3], planted(good[3], other + apart, "apart")], BOARD.corners_m, SIZE_PX)
    assert mirror_twins(stack, 0.2) == ()
    copied = stack_views([good[3], planted(good[3], other + 0.02, "copied")], BOARD.corners_m, SIZE_PX)
    assert mirror_twins(copied, 0.2) == ((0, 1),)


def test_a_board_with_other_squares_is_called_another_board() -> None:
    camera = CAMERAS["plumb_bob"]
    pose = calibrated(*GOOD).views[2].camera_from_board
    other = camera.project(pose @ (BOARD.corners_m * [1.0, 1.2, 1.0]))
    lens = calibrated(*GOOD, planted(GOOD[2], other, "other"))
    assert [picture.name for picture in lens.left_out] == ["other"]
    assert lens.left_out[0].reason.startswith("another board: its corners fit to")
    assert "0.83 times as wide as high" in lens.left_out[0].reason


def test_a_wrong_detection_fits_no_pose() -> None:
    lens = calibrated(*GOOD, planted(GOOD[4], np.roll(GOOD[4].pixels_px, 1, axis=0), "rolled"))
    assert [picture.name for picture in lens.left_out] == ["rolled"]
    assert "another board, or a wrong detection" in lens.left_out[0].reason


def test_a_blurred_view_is_called_blurred() -> None:
    rng = np.random.default_rng(8)
    sharp = [replace(view, blur_px=0.9) for view in GOOD]
    blurred = [
        planted(view, view.pixels_px + rng.normal(0.0, 0.3, (54, 2)), f"blurred {n}", 3.0)
        for n, view in enumerate(GOOD[:3])
    ]
    lens = calibrated(*sharp, *blurred)
    assert [picture.name for picture in lens.left_out] == ["blurred 0", "blurred 1", "blurred 2"]
    assert "blurred: edges are 3.0 px wide, those of the others 0.9 px" in lens.left_out[0].reason


def test_a_corner_that_jumped_by_a_square_is_left_out_and_its_view_kept() -> None:
    pixels = GOOD[5].pixels_px.copy()
    pixels[20] = pixels[21]
    lens = calibrated(*GOOD[:5], replace(GOOD[5], pixels_px=pixels), *GOOD[6:])
    assert lens.left_out == ()
    assert np.flatnonzero(~lens.views[5].used).tolist() == [20]
    assert all(view.used.all() for row, view in enumerate(lens.views) if row != 5)
    assert lens.rms_px < 0.15


def test_with_robust_off_every_view_and_corner_counts() -> None:
    pixels = GOOD[5].pixels_px.copy()
    pixels[20] = pixels[21]
    views = (*GOOD[:5], replace(GOOD[5], pixels_px=pixels), *GOOD[6:])
    lens = calibrated(*views, options=IntrinsicsOptions(model="plumb_bob", robust=False))
    assert all(view.used.all() for view in lens.views)
    assert lens.rms_px > 0.5


def test_views_with_some_of_the_corners_are_used() -> None:
    some = replace(GOOD[0], corner_ids=np.arange(10, 40), pixels_px=GOOD[0].pixels_px[10:40])
    lens = calibrated(some, *GOOD[1:])
    assert lens.left_out == ()
    assert len(lens.views[0].residuals_px) == 30
