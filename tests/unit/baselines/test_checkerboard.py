"""CCM: the reflector on the corners of a checkerboard, registered with where the camera sees them."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.baselines.checkerboard import calibrate_on_board
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Candidate, Pair, Unsolvable
from calib_core.options import BoardOptions, CalibrationOptions
from calib_core.results import Calibration
from calib_core.vision.checkerboard import board_corners, find_corners, view_of_board
from cocalib.board_search import find_board

CAMERA = Camera(
    "plumb_bob",
    960,
    540,
    np.array([[700.0, 0.0, 480.0], [0.0, 700.0, 270.0], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.02, 0.0, 0.0]),
)
BOARD = BoardOptions(columns=7, rows=4, square_m=0.3)
OPTIONS = CalibrationOptions(method="ccm", board=BOARD)
CORNERS_M = board_corners(7, 4, 0.3)
CAMERA_FROM_BOARD = RigidTransform(rotation_exp(np.array([0.2, -0.35, 0.05])), np.array([-0.9, -0.4, 3.5]))
CORNERS_PX = CAMERA.project(CAMERA_FROM_BOARD @ CORNERS_M)
CAMERA_FROM_RADAR = RigidTransform(
    np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]) @ rotation_exp(np.array([0.02, 0.05, -0.03])),
    np.array([0.05, 0.1, 0.0]),
)


def pairs_at(corners: list[int], noise_m: float = 0.0) -> list[Pair]:
    rng = np.random.default_rng(8)
    points = CAMERA_FROM_RADAR.inverse() @ (CAMERA_FROM_BOARD @ CORNERS_M[corners])
    points = points + noise_m * rng.standard_normal(points.shape)
    sigma = np.array([0.03, 0.01, 0.02])
    return [
        Pair(f"c{k}", CORNERS_PX[k] + rng.uniform(-2.0, 2.0, 2), (Candidate(point, sigma, np.eye(3)),))
        for k, point in zip(corners, points, strict=True)
    ]


def picture(camera_from_board: RigidTransform = CAMERA_FROM_BOARD) -> np.ndarray:
    """Draw a board of 8 x 5 squares with a white rim, by the ray of each pixel."""
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    rays = CAMERA.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    board_from_camera = camera_from_board.inverse()
    origin, heading = board_from_camera.translation_m, rays @ board_from_camera.rotation.T
    at = (origin + heading * (-origin[2] / heading[:, 2])[:, None])[:, :2] / BOARD.square_m
    square = np.floor(at).astype(int)
    inside = (at >= -1.0).all(axis=1) & (at[:, 0] < BOARD.columns) & (at[:, 1] < BOARD.rows)
    grey = np.where(inside & (square.sum(axis=1) % 2 == 0), 20, 220)
    return np.repeat(grey.reshape(v.shape)[..., None], 3, axis=2).astype(np.uint8)


class Frames:
    def __init__(self, pictures: list[np.ndarray]) -> None:
        self.image_times = np.arange(len(pictures), dtype=np.int64)
        self._pictures = pictures

    def image(self, index: int, /) -> np.ndarray:
        return self._pictures[index]


def solved(outcome: Calibration | Unsolvable) -> Calibration:
    assert isinstance(outcome, Calibration), outcome
    return outcome


def unsolvable(outcome: object) -> Unsolvable:
    assert isinstance(outcome, Unsolvable), outcome
    return outcome


def test_exact_radar_positions_on_the_corners_give_the_exact_pose() -> None:
    result = solved(calibrate_on_board(pairs_at([0, 6, 21, 27, 10]), CORNERS_PX, CAMERA, OPTIONS))
    assert result.camera_from_radar.as_matrix() == pytest.approx(CAMERA_FROM_RADAR.as_matrix(), abs=1e-6)
    assert np.isnan(result.covariance).all()


def test_the_board_is_found_in_pictures_and_its_pose_is_the_drawn_one() -> None:
    corners = find_corners(picture(), BOARD.columns, BOARD.rows)
    assert corners is not None
    ordered = corners if np.linalg.norm(corners[0] - CORNERS_PX[0]) < 5.0 else corners[::-1]
    assert np.sqrt(np.square(ordered - CORNERS_PX).sum(axis=1).mean()) < 0.2  # edges are drawn to whole pixels
    view = view_of_board(ordered, BOARD.columns, BOARD.rows, BOARD.square_m, CAMERA)
    assert view is not None
    assert np.linalg.norm(view.corners_camera_m - CAMERA_FROM_BOARD @ CORNERS_M, axis=1).max() < 0.02


def test_the_condition_number_and_what_is_left_are_always_stated() -> None:
    result = solved(calibrate_on_board(pairs_at(list(range(28)), 0.1), CORNERS_PX, CAMERA, OPTIONS))
    (warning,) = (one for one in result.warnings if one.code == "board-geometry")
    assert "registered on 28 corners of a board 3." in warning.message
    assert "condition number" in warning.message
    assert 10 < int(warning.message.split(", ")[-1].split(" cm")[0]) < 25  # 10 cm per axis


def test_clicks_beside_the_board_judge_but_do_not_take_part() -> None:
    on = pairs_at([0, 6, 21, 27, 10])
    beside = replace(on[4], id="floor", pixel_px=np.array([100.0, 500.0]))
    with_it = solved(calibrate_on_board([*on, beside], CORNERS_PX, CAMERA, OPTIONS))
    without = solved(calibrate_on_board(on, CORNERS_PX, CAMERA, OPTIONS))
    assert np.array_equal(with_it.camera_from_radar.as_matrix(), without.camera_from_radar.as_matrix())
    assert with_it.metrics.n == 6
    assert any(one.code == "beside-board" and "(floor)" in one.message for one in with_it.warnings)


def test_fewer_than_three_corners_are_refused_in_words() -> None:
    outcome = unsolvable(calibrate_on_board(pairs_at([0, 6, 6]), CORNERS_PX, CAMERA, OPTIONS))
    assert outcome.code == "too-few-corners"
    assert "2 of at least 3 required corners" in outcome.reason


def test_corners_of_one_row_are_refused_in_words() -> None:
    outcome = unsolvable(calibrate_on_board(pairs_at([0, 2, 4, 6]), CORNERS_PX, CAMERA, OPTIONS))
    assert outcome.code == "points-in-one-line"
    assert "two rows and two columns" in outcome.hint


def test_corners_behind_the_camera_are_refused_in_words() -> None:
    far_outside = CORNERS_PX + 1e5
    assert unsolvable(calibrate_on_board(pairs_at([0, 6, 21]), far_outside, CAMERA, OPTIONS)).code == "board-not-seen"


def test_pairs_without_pictures_are_refused_in_words() -> None:
    outcome = unsolvable(calibrate_pairs(pairs_at([0, 6, 21]), CAMERA, OPTIONS))
    assert outcome.code == "no-board"
    assert "pictures" in outcome.reason


def test_the_board_is_looked_for_all_over_the_recording() -> None:
    blank = np.full((CAMERA.height_px, CAMERA.width_px, 3), 128, dtype=np.uint8)
    corners = find_board(Frames([blank, blank, picture(), blank]), BOARD)
    assert not isinstance(corners, Unsolvable)
    assert corners.shape == (28, 2)


@pytest.mark.parametrize("frames", [Frames([]), Frames([np.full((540, 960, 3), 128, dtype=np.uint8)]), object()])
def test_no_board_found_says_how_many_frames_were_searched(frames: object) -> None:
    outcome = unsolvable(find_board(frames, BOARD))
    assert outcome.code == "no-board"
    assert f"none of {len(getattr(frames, 'image_times', []))} frames" in outcome.reason
    assert "--board.columns" in outcome.hint


def test_a_board_that_moves_is_refused_in_words() -> None:
    moved = RigidTransform(CAMERA_FROM_BOARD.rotation, CAMERA_FROM_BOARD.translation_m + np.array([0.2, 0.0, 0.0]))
    outcome = unsolvable(find_board(Frames([picture(), picture(moved)]), BOARD))
    assert outcome.code == "board-moved"
    moved_px = np.linalg.norm(CAMERA.project(moved @ CORNERS_M) - CORNERS_PX, axis=1).max()
    assert f"moves by {moved_px:.0f} px" in outcome.reason
