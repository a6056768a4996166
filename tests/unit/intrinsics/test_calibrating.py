"""Calibrating a lens: what is stated of each view, and what is said if the views do not suffice."""

import re
from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import Camera, CameraCovariance
from calib_core.geometry import RigidTransform, rotation_exp, rotation_from_euler
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import Coverage, view_coverage
from calib_core.intrinsics.image_maps import far_point_slopes, projection_uncertainty, residual_field
from calib_core.intrinsics.split_difference import split_difference
from calib_core.measurements import Unsolvable
from calib_core.synthetic.rig import typical_camera
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, drawn_views, search_of

PINHOLE = "pinhole"
VIEWS = drawn_views(CAMERAS["pinhole"], 10, 21)


def calibrated(*views: BoardCorners) -> CalibratedLens:
    lens = calibrate_lens(search_of(views), PINHOLE)
    assert isinstance(lens, CalibratedLens), lens
    return lens


def test_each_view_states_its_pose_its_residuals_and_its_error_if_left_out():
    lens = calibrated(*VIEWS)
    for view in lens.views:
        projected = lens.camera.project(view.camera_from_board @ BOARD.corners_m)
        np.testing.assert_allclose(view.residuals_px, projected - view.corners.pixels_px, atol=1e-9)
        assert view.rms_px == pytest.approx(np.sqrt(np.square(view.residuals_px).sum(axis=1).mean()))
        assert view.rms_px < view.held_out_rms_px < 1.5 * view.rms_px
    assert lens.rms_px == pytest.approx(np.sqrt(np.mean([view.rms_px**2 for view in lens.views])))
    assert lens.rms_px < lens.held_out_rms_px < 0.16


def test_the_same_views_give_the_same_bytes():
    one, other = calibrated(*VIEWS), calibrated(*VIEWS)
    assert one.camera.parameters.tobytes() == other.camera.parameters.tobytes()
    assert one.camera.covariance.matrix.tobytes() == other.camera.covariance.matrix.tobytes()
    assert (one.choice, one.warnings) == (other.choice, other.warnings)


def test_two_views_are_too_few():
    answer = calibrate_lens(search_of(VIEWS[:2]), PINHOLE)
    assert answer.code == "few-views"
    assert (answer.facts["views"], answer.facts["needed"]) == (2, 3)


def test_views_from_one_direction_leave_the_focal_length_open():
    rng, views = np.random.default_rng(1), []
    for index in range(10):
        shift = np.array([*rng.uniform(-0.2, 0.1, 2), rng.uniform(0.5, 0.9)])
        turn = rotation_exp(np.array([0.0, 0.0, rng.normal(0.0, 0.1)]))
        pixels = CAMERAS["pinhole"].project(BOARD.corners_m @ turn.T + shift) + rng.normal(0.0, 0.2, (54, 2))
        views.append(BoardCorners(index, str(index), None, SIZE_PX, np.arange(54), pixels))
    answer = calibrate_lens(search_of(tuple(views)), PINHOLE)
    assert isinstance(answer, Unsolvable), answer.camera.covariance
    assert answer.code == "parallel-views"
    assert answer.facts["turned_deg"] < 20.0


def test_corners_that_nothing_explains_are_no_calibration():
    rng = np.random.default_rng(2)
    noise = tuple(replace(view, pixels_px=rng.uniform(0.0, 700.0, (54, 2))) for view in VIEWS)
    answer = calibrate_lens(search_of(noise))
    assert isinstance(answer, Unsolvable), answer
    assert answer.code in ("no-lens", "few-views", "parallel-views")


def test_a_image_of_another_size_is_left_out_by_name():
    lens = calibrated(*VIEWS[:9], replace(VIEWS[9], size_px=(640, 480)))
    (image,) = lens.left_out
    assert (image.name, re.findall(r"\d+", image.reason)) == ("view 9", ["640", "480", "1280", "720"])


def test_a_corner_of_the_image_without_views_is_warned_about():
    left = [view for view in drawn_views(CAMERAS["pinhole"], 60, 3) if view.pixels_px[:, 0].max() < 700.0]
    assert len(left) >= 5
    assert "little-covered" in {warning.code for warning in calibrated(*left).warnings}


def test_a_cancelled_calibration_says_so_and_named_its_steps():
    steps: list[str] = []
    answer = calibrate_lens(search_of(VIEWS), PINHOLE, progress=steps.append, stopped=lambda: len(steps) == 2)
    assert answer.code == "stopped"
    assert steps == ["comparing the views", "choosing a lens model"]


def test_images_that_were_resized_out_of_proportion_show_in_the_focal_lengths():
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
def test_a_view_that_cannot_be_posed_is_left_out_by_name(ids, reason):
    partial = replace(VIEWS[9], corner_ids=ids, pixels_px=VIEWS[9].pixels_px[ids])
    (image,) = calibrated(*VIEWS[:9], partial).left_out
    assert (image.name, image.reason) == ("view 9", reason)


def test_one_view_given_many_times_is_no_calibration():
    answer = calibrate_lens(search_of(tuple(replace(VIEWS[0], index=index) for index in range(6))), PINHOLE)
    assert isinstance(answer, Unsolvable), answer.camera.parameters
    assert answer.code == "parallel-views"


# What views cover, and which view is missing.


CAMERA = typical_camera("plumb_bob", width_px=1280, height_px=720)
MIDDLE = BOARD.corners_m.mean(axis=0)


def seen(
    pan_deg: float = 0.0,
    tip_deg: float = 0.0,
    at: tuple[float, float, float] = (0.0, 0.0, 0.5),
    camera: Camera = CAMERA,
):
    """Return a view of the board turned about its upright and its level axis, with its middle at a point [m]."""
    turned = rotation_from_euler(*np.deg2rad([tip_deg, pan_deg, 0.0]))
    pose = RigidTransform(turned, np.array(at) - turned @ MIDDLE)
    pixels = camera.project(pose @ BOARD.corners_m)
    return BoardCorners(0, "view", None, (camera.width_px, camera.height_px), np.arange(54), pixels)


def covered(*views: BoardCorners) -> Coverage:
    return view_coverage(views, BOARD, (1280, 720))


@pytest.mark.parametrize(
    ("pan_deg", "tip_deg", "faces"),
    [(0.0, 0.0, "square on"), (35.0, 0.0, "left"), (-35.0, 0.0, "right"), (0.0, 35.0, "down"), (0.0, -35.0, "up")],
)
@pytest.mark.parametrize("at", [(0.0, 0.0, 0.5), (0.15, -0.05, 0.5), (-0.1, 0.08, 0.7)])
def test_a_tilt_is_named_by_where_the_board_faces(pan_deg, tip_deg, faces, at):
    sideways = float(np.degrees(np.arctan2(at[0], at[2])))
    upward = float(np.degrees(np.arctan2(at[1], at[2])))
    tilts = covered(seen(pan_deg + sideways, tip_deg - upward, at)).tilts
    assert tilts[faces] == 1
    assert sum(tilts.values()) == 1


def test_the_face_of_the_board_is_where_its_normal_points():
    view = seen(35.0)
    left, right = view.pixels_px[:9:8], view.pixels_px[-9::8]
    heights = np.abs(right[:, 1] - left[:, 1])
    assert heights[1] != pytest.approx(heights[0], rel=0.05)  # one side is nearer
    nearer_right = heights[1] > heights[0]
    assert covered(view).tilts["left" if nearer_right else "right"] == 1


def test_distance_is_told_by_the_share_of_the_image():
    assert covered(seen(at=(0, 0, 0.25))).distances["near"] == 1
    assert covered(seen(at=(0, 0, 0.45))).distances["middle"] == 1
    assert covered(seen(at=(0, 0, 0.9))).distances["far"] == 1


def test_what_is_missing_is_said_until_nothing_is():
    few = covered(seen())
    assert "1 views of" in few.missing[0]
    assert any("upper left corner" in sentence for sentence in few.missing)
    assert any("board faces left" in sentence for sentence in few.missing)
    every = [
        seen(pan, tip, (x, y, z))
        for x, y in ((-0.2, -0.1), (0.2, -0.1), (-0.2, 0.1), (0.2, 0.1), (0.0, 0.0))
        for pan, tip, z in ((35, 0, 0.35), (-35, 0, 0.35), (0, 35, 0.35), (0, -35, 0.35), (0, 0, 0.22))
    ]
    assert covered(*every).missing == ()
    assert covered(*every).share > 0.7


def test_counts_are_those_of_all_corners():
    coverage = covered(seen(), seen(35.0))
    assert coverage.counts.sum() == 108
    assert covered().share == 0.0


# What is shown over the image: projection uncertainty, residuals, and halves of the views calibrated apart.


def calibrated_over_the_image(model: str, count: int = 12, *, truth: str = "") -> CalibratedLens:
    views = drawn_views(CAMERAS[truth or model], count, 9)
    lens = calibrate_lens(search_of(views), model)
    assert isinstance(lens, CalibratedLens), lens
    return lens


@pytest.fixture(scope="module")
def lens() -> CalibratedLens:
    return calibrated_over_the_image("pinhole")


def test_the_slopes_of_far_points_are_those_of_their_pixels():
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


def test_the_projection_is_surest_where_corners_are_and_less_sure_at_the_edge(lens):
    grid = projection_uncertainty(lens, columns=9, rows=7)
    assert grid.sigma_px.shape == (7, 9)
    assert (grid.x_px[0], grid.x_px[-1], grid.y_px[-1]) == (0.0, SIZE_PX[0] - 1.0, SIZE_PX[1] - 1.0)
    assert grid.sigma_px.min() < 0.3 < 2.0 * np.median(grid.sigma_px) < 2.0 * grid.sigma_px.max()


def test_a_shift_of_the_principal_point_that_a_rotation_undoes_is_nearly_no_uncertainty(lens):
    matrix = np.zeros((4, 4))
    matrix[2, 2] = 100.0  # 10 px
    camera = replace(lens.camera, covariance=CameraCovariance(lens.camera.parameter_names, matrix))
    assert np.median(projection_uncertainty(replace(lens, camera=camera)).sigma_px) < 2.0


def test_residuals_of_the_true_model_are_noise(lens):
    field = residual_field(lens)
    assert not field.systematic
    assert abs(field.neighbour_correlation) < 0.15
    assert field.counts.sum() == 12 * 54
    assert not field.neighbours_alike


def test_a_pattern_that_all_views_share_is_more_than_noise(lens):
    def off(view: LensView) -> LensView:
        across = np.sin(view.corners.pixels_px / 150.0)
        return replace(view, residuals_px=view.residuals_px + 0.1 * across)

    field = residual_field(replace(lens, views=tuple(off(view) for view in lens.views)))
    assert field.systematic
    assert field.systematic_px == pytest.approx(0.1, abs=0.03)


@pytest.mark.slow
def test_residuals_of_a_model_that_is_too_simple_are_alike_in_neighbours():
    field = residual_field(calibrated_over_the_image("pinhole", 25, truth="plumb_bob"))
    assert field.neighbour_correlation > 0.5
    assert field.neighbours_alike


def test_halves_of_the_views_agree_for_the_true_model(lens):
    agreeing = split_difference(lens)
    assert not isinstance(agreeing, Unsolvable)
    assert agreeing.agrees
    assert agreeing.apart_px.shape == agreeing.expected_px.shape == (10, 16)


def test_seven_views_are_not_split(lens):
    answer = split_difference(replace(lens, views=lens.views[:7]))
    assert answer == Unsolvable("few-views", {"views": 7, "needed": 8, "halves": True})


@pytest.mark.parametrize("columns", [2, 5])
def test_grids_have_the_wanted_size(columns, lens):
    assert residual_field(lens, columns=columns, rows=3).means_px.shape == (3, columns, 2)
