"""Boards in rendered pictures, whose corners are known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera, CameraModel
from calib_core.intrinsics import Board
from calib_core.intrinsics.board_detection import blur_px, board_in, find_board
from calib_core.synthetic import typical_camera
from calib_core.synthetic.boards import BoardFilm, render_board, true_corners, waved_poses

CHECKERBOARD = Board("checkerboard", 9, 6, 0.02214)
CHARUCO = Board("charuco", 10, 7, 0.0225, 0.0168, "DICT_5X5_100")
APRILGRID = Board("aprilgrid", 6, 4, 0.03, 0.009, "DICT_APRILTAG_36h11")
FILM = BoardFilm(blur_px=0.7, noise_grey=2.0)


def camera_of(model: CameraModel = "plumb_bob") -> Camera:
    return typical_camera(model, width_px=1280, height_px=720)


def views(board: Board, film: BoardFilm, count: int, model: CameraModel = "plumb_bob", seed: int = 3):
    """Yield pictures and the true corners of each by id."""
    camera = camera_of(model)
    for number, pose in enumerate(waved_poses(np.random.default_rng(seed), board, camera, count)):
        yield render_board(board, camera, pose, film, seed=number), true_corners(board, camera, pose, film)


def apart(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return how far corners are from the truth, counted from whichever end of a checkerboard."""
    return min((found - true, found - true[::-1]), key=lambda difference: float(np.abs(difference).sum()))


@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
def test_corners_of_a_checkerboard_are_found_to_three_hundredths_of_a_pixel(model: CameraModel) -> None:
    errors = []
    for picture, true in views(CHECKERBOARD, FILM, 5, model):
        found = find_board(picture, CHECKERBOARD)
        assert found is not None
        errors.append(apart(found[1], true))
    assert np.sqrt(np.mean(np.square(errors))) < 0.03
    assert np.abs(errors).max() < 0.2


def test_light_that_falls_off_to_one_side_does_not_move_corners() -> None:
    film = replace(FILM, gradient=(0.35, -0.2), vignetting=0.4)
    errors = [
        apart(found[1], true)
        for picture, true in views(CHECKERBOARD, film, 4)
        if (found := find_board(picture, CHECKERBOARD))
    ]
    assert len(errors) == 4
    assert np.sqrt(np.mean(np.square(errors))) < 0.02
    assert np.abs(np.mean(np.concatenate(errors), axis=0)).max() < 0.006


@pytest.mark.parametrize("board", [CHARUCO, APRILGRID], ids=["charuco", "aprilgrid"])
def test_boards_with_markers_say_which_corner_is_which(board: Board) -> None:
    for picture, true in views(board, FILM, 2):
        found = find_board(picture, board)
        assert found is not None
        ids, pixels = found
        assert len(ids) > 0.7 * len(true)
        assert (np.diff(ids) > 0).all()
        assert np.sqrt(np.mean(np.square(pixels - true[ids]))) < 0.04
        assert np.abs(pixels - true[ids]).max() < 0.4


def test_tags_whose_outline_runs_into_the_squares_between_them_get_their_corners() -> None:
    """In small pictures the outline of a tag ends pixels away from its corner, for a third of the corners at once."""
    board = Board("aprilgrid", 6, 6, 0.03, 0.009, "DICT_APRILTAG_36h11")
    camera = typical_camera("plumb_bob", width_px=640, height_px=480)
    poses = list(waved_poses(np.random.default_rng(3), board, camera, 12))
    for number in (0, 9):
        picture = render_board(board, camera, poses[number], FILM, seed=number)
        found = find_board(picture, board)
        assert found is not None
        ids, pixels = found
        assert len(ids) >= 36
        assert np.abs(pixels - true_corners(board, camera, poses[number], FILM)[ids]).max() < 0.4


@pytest.mark.parametrize("board", [CHARUCO, APRILGRID], ids=["charuco", "aprilgrid"])
def test_a_part_of_a_board_with_markers_suffices(board: Board) -> None:
    picture, true = next(views(board, FILM, 1))
    hidden = picture.copy()
    hidden[:, : int(np.median(true[:, 0]))] = 120
    whole, part = find_board(picture, board), find_board(hidden, board)
    assert whole is not None
    assert part is not None
    assert 6 <= len(part[0]) < len(whole[0])
    assert np.abs(part[1] - true[part[0]]).max() < 0.5


def test_a_grid_of_opencvs_tags_is_found_though_they_are_turned() -> None:
    board = Board("aprilgrid", 3, 2, 0.05, 0.015, "DICT_APRILTAG_36h11")
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    picture = np.full((500, 700), 255, dtype=np.uint8)
    corners = board.corners_m[:, :2] * 3000.0 + 80.0
    for tag in range(6):
        left, top = corners[4 * tag].round().astype(int)
        picture[top : top + 150, left : left + 150] = cv2.aruco.generateImageMarker(dictionary, tag, 150, borderBits=2)
    found = find_board(picture, board)
    assert found is not None
    assert len(found[0]) == 24
    assert np.abs(found[1] - (corners[found[0]] - 0.5)).max() < 1.0


def test_a_checkerboard_is_numbered_with_a_right_hand() -> None:
    picture, _ = next(views(CHECKERBOARD, FILM, 1))
    for shown in (picture, cv2.rotate(picture, cv2.ROTATE_90_CLOCKWISE), cv2.rotate(picture, cv2.ROTATE_180)):
        found = find_board(shown, CHECKERBOARD)
        assert found is not None
        grid = found[1].reshape(6, 9, 2)
        along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        assert along[0] * down[1] - along[1] * down[0] > 0.0


def test_a_large_picture_is_searched_small_and_refined_large() -> None:
    camera = typical_camera("plumb_bob", width_px=2560, height_px=1440)
    pose = waved_poses(np.random.default_rng(4), CHECKERBOARD, camera, 1)[0]
    found = find_board(render_board(CHECKERBOARD, camera, pose, FILM, seed=1), CHECKERBOARD)
    assert found is not None
    assert np.abs(apart(found[1], true_corners(CHECKERBOARD, camera, pose, FILM))).max() < 0.15


def test_a_part_of_a_larger_board_is_not_the_board() -> None:
    picture, _ = next(views(CHECKERBOARD, FILM, 1))
    for columns, rows in ((8, 6), (10, 7)):
        assert find_board(picture, replace(CHECKERBOARD, columns=columns, rows=rows)) is None
    assert board_in(picture, replace(CHECKERBOARD, columns=10, rows=7)) == (9, 6)
    assert board_in(picture, CHECKERBOARD) is None


def test_no_board_is_found_where_there_is_none() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    stripes = np.tile(np.repeat(np.array([20, 230], dtype=np.uint8), 20), (480, 16))
    for picture in (noise, stripes, np.zeros((480, 640, 3), dtype=np.uint8)):
        for board in (CHECKERBOARD, CHARUCO, APRILGRID):
            assert find_board(picture, board) is None
        assert board_in(picture, CHECKERBOARD) is None


@pytest.mark.parametrize("board", [CHECKERBOARD, CHARUCO, APRILGRID], ids=["checkerboard", "charuco", "aprilgrid"])
def test_blur_is_measured_in_pixels(board: Board) -> None:
    measured = []
    for blur in (0.7, 1.4, 2.0):
        picture, true = next(views(board, BoardFilm(blur_px=blur), 1))
        measured.append(blur_px(picture, np.arange(len(true)), true, board))
    assert measured == sorted(measured)
    known = 3 if board is CHECKERBOARD else 1  # markers leave less room beside an edge than strong blur takes
    np.testing.assert_allclose(measured[:known], np.hypot([0.7, 1.4, 2.0], 0.5)[:known], rtol=0.2)


def test_motion_blurs_the_edges_across_it() -> None:
    picture, true = next(views(CHECKERBOARD, FILM, 1))
    ids = np.arange(len(true))
    still = blur_px(picture, ids, true, CHECKERBOARD)
    moved = cv2.blur(picture, (9, 1))
    assert blur_px(moved, ids, true, CHECKERBOARD) > 1.8 * still
    assert np.isnan(blur_px(np.full_like(picture, 90), ids, true, CHECKERBOARD))
