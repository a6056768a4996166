"""Views without pictures: poses as a person holds a board, and errors as asked for."""

import numpy as np
import pytest

from calib_core.geometry import rotation_angle_rad
from calib_core.intrinsics import Board
from calib_core.synthetic import typical_camera
from calib_core.synthetic.boards import (
    BoardFilm,
    CornerErrors,
    Waving,
    simulated_views,
    true_corners,
    waved_poses,
)

BOARD = Board("checkerboard", 9, 6, 0.02214)
CAMERA = typical_camera()


def test_a_waved_board_is_tilted_near_and_far_and_all_over_the_picture():
    poses = waved_poses(np.random.default_rng(1), BOARD, CAMERA, 30)
    pixels = np.concatenate([true_corners(BOARD, CAMERA, pose) for pose in poses])
    assert CAMERA.in_image(pixels).all()
    counts, _, _ = np.histogram2d(*pixels.T, bins=(8, 5), range=((0, 1280), (0, 720)))
    assert (counts > 0).mean() > 0.9
    depths = [float(pose.translation_m[2]) for pose in poses]
    assert max(depths) > 1.6 * min(depths)
    assert np.ptp([pose.rotation[0, 2] for pose in poses]) > 0.8


def test_a_badly_held_board_is_neither_tilted_nor_moved():
    held = Waving(tilt_deg=0.0, roll_deg=0.0, size=(0.4, 0.4), cover=0.3)
    poses = waved_poses(np.random.default_rng(1), BOARD, CAMERA, 10, held)
    rays = [(pose @ BOARD.corners_m).mean(axis=0) for pose in poses]
    assert np.ptp([float(np.linalg.norm(ray)) for ray in rays]) < 1e-9
    assert max(rotation_angle_rad(pose.rotation) for pose in poses) < np.deg2rad(25.0)
    pixels = np.concatenate([true_corners(BOARD, CAMERA, pose) for pose in poses])
    assert np.ptp(pixels, axis=0)[0] < 0.6 * 1280


def test_a_board_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="0 of 2 poses"):
        waved_poses(np.random.default_rng(1), BOARD, CAMERA, 2, Waving(size=(1.4, 1.5)))


def test_errors_are_as_large_as_asked_for():
    rng = np.random.default_rng(2)
    poses = waved_poses(rng, BOARD, CAMERA, 60)
    true = [true_corners(BOARD, CAMERA, pose) for pose in poses]

    def errors(asked: CornerErrors) -> np.ndarray:
        views = simulated_views(rng, BOARD, CAMERA, poses, asked)
        return np.array([view.pixels_px - pixels for view, pixels in zip(views, true, strict=True)])

    independent = errors(CornerErrors(0.1))
    assert independent.std() == pytest.approx(0.1, rel=0.05)
    assert abs(np.mean(independent[:, 1:] * independent[:, :-1])) < 0.001
    shared = errors(CornerErrors(0.0, shared_px=0.1))
    assert shared.std() == pytest.approx(0.1, rel=0.2)
    assert np.mean(shared[:, 1:9] * shared[:, :8]) > 0.85 * np.mean(np.square(shared))
    gross = errors(CornerErrors(0.0, outlier_share=0.05, outlier_px=20.0))
    assert np.mean(np.linalg.norm(gross, axis=2) > 0.5) == pytest.approx(0.05, abs=0.015)


def test_a_rolling_shutter_moves_the_corners_of_a_waved_board():
    poses = waved_poses(np.random.default_rng(3), BOARD, CAMERA, 5)
    waved = CornerErrors(0.0, speed_mps=0.2, turning_radps=0.5)
    for rolling_s, least, most in ((0.0, 0.0, 1e-9), (0.02, 0.3, 40.0)):
        film = BoardFilm(rolling_shutter_s=rolling_s)
        views = simulated_views(np.random.default_rng(4), BOARD, CAMERA, poses, waved, film)
        moved = max(
            np.abs(view.pixels_px - true_corners(BOARD, CAMERA, pose)).max()
            for view, pose in zip(views, poses, strict=True)
        )
        assert least <= moved <= most
