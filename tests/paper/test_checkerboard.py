"""The checkerboard of the paper in the frames of a recording."""

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Unsolvable
from calib_core.paper.other_methods import find_board, find_corners

CAMERA = Camera(
    "plumb_bob",
    960,
    540,
    np.array([[700.0, 0.0, 480.0], [0.0, 700.0, 270.0], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.02, 0.0, 0.0]),
)
COLUMNS, ROWS, SQUARE_M = 7, 4, 0.3
CORNERS_M = SQUARE_M * np.array([[column, row, 0.0] for row in range(ROWS) for column in range(COLUMNS)])
CAMERA_FROM_BOARD = RigidTransform(rotation_exp(np.array([0.2, -0.35, 0.05])), np.array([-0.9, -0.4, 3.5]))
CORNERS_PX = CAMERA.project(CAMERA_FROM_BOARD @ CORNERS_M)


def picture(camera_from_board: RigidTransform = CAMERA_FROM_BOARD) -> np.ndarray:
    """Draw a board of 8 x 5 squares with a white rim, by the ray of each pixel."""
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    rays = CAMERA.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    board_from_camera = camera_from_board.inverse()
    origin, heading = board_from_camera.translation_m, rays @ board_from_camera.rotation.T
    at = (origin + heading * (-origin[2] / heading[:, 2])[:, None])[:, :2] / SQUARE_M
    square = np.floor(at).astype(int)
    inside = (at >= -1.0).all(axis=1) & (at[:, 0] < COLUMNS) & (at[:, 1] < ROWS)
    grey = np.where(inside & (square.sum(axis=1) % 2 == 0), 20, 220)
    return np.repeat(grey.reshape(v.shape)[..., None], 3, axis=2).astype(np.uint8)


class Frames:
    def __init__(self, pictures: list[np.ndarray]) -> None:
        self.image_times = np.arange(len(pictures), dtype=np.int64)
        self._pictures = pictures

    def image(self, index: int, /) -> np.ndarray:
        return self._pictures[index]


def unsolvable(outcome: object) -> Unsolvable:
    assert isinstance(outcome, Unsolvable), outcome
    return outcome


def test_the_board_is_found_in_pictures_where_it_was_drawn() -> None:
    corners = find_corners(picture(), COLUMNS, ROWS)
    ordered = corners if np.linalg.norm(corners[0] - CORNERS_PX[0]) < 5.0 else corners[::-1]
    assert np.sqrt(np.square(ordered - CORNERS_PX).sum(axis=1).mean()) < 0.2  # edges are drawn to whole pixels


def test_the_board_is_looked_for_all_over_the_recording() -> None:
    blank = np.full((CAMERA.height_px, CAMERA.width_px, 3), 128, dtype=np.uint8)
    corners = find_board(Frames([blank, blank, picture(), blank]), COLUMNS, ROWS)
    assert not isinstance(corners, Unsolvable)
    assert corners.shape == (28, 2)


@pytest.mark.parametrize("frames", [Frames([]), Frames([np.full((540, 960, 3), 128, dtype=np.uint8)]), object()])
def test_no_board_found_says_how_many_frames_were_searched(frames: object) -> None:
    outcome = unsolvable(find_board(frames, COLUMNS, ROWS))
    assert outcome.code == "no-board"
    assert f"none of {len(getattr(frames, 'image_times', []))} frames" in outcome.reason
    assert "inner corners" in outcome.hint


def test_a_board_that_moves_is_refused_in_words() -> None:
    moved = RigidTransform(CAMERA_FROM_BOARD.rotation, CAMERA_FROM_BOARD.translation_m + np.array([0.2, 0.0, 0.0]))
    outcome = unsolvable(find_board(Frames([picture(), picture(moved)]), COLUMNS, ROWS))
    assert outcome.code == "board-moved"
    moved_px = np.linalg.norm(CAMERA.project(moved @ CORNERS_M) - CORNERS_PX, axis=1).max()
    assert f"moves by {moved_px:.0f} px" in outcome.reason
