"""Corners of a board in random poses, as a known lens sees them; cheap enough to draw hundreds of sets."""

from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.intrinsics.board import board_of_size
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.coverage import BoardSearch

BOARD = board_of_size("9x6", 25.0)
SIZE_PX = (1280, 720)


def _camera(model: str, focal_px: float, *distortion: float) -> Camera:
    matrix = np.array([[focal_px, 0.0, 650.0], [0.0, 1.005 * focal_px, 350.0], [0.0, 0.0, 1.0]])
    return Camera(model, *SIZE_PX, matrix, np.array(distortion))


CAMERAS = {
    "pinhole": _camera("pinhole", 900.0),
    "plumb_bob": _camera("plumb_bob", 900.0, -0.28, 0.1, 0.0008, -0.0005, -0.02),
    "equidistant": _camera("equidistant", 420.0, -0.012, 0.006, -0.004, 0.0009),
    "rational_polynomial": _camera("rational_polynomial", 600.0, 0.5, 0.15, 0.0006, -0.0004, 0.01, 0.8, 0.3, 0.03),
}


@dataclass(frozen=True)
class Errors:
    """What is wrong with drawn corners."""

    noise_px: float = 0.1
    shared_px: float = 0.0
    """Of errors that neighbours in a view share, over about three squares."""
    motion_px_per_s: float = 0.0
    """Of the board, under a rolling shutter of 20 ms."""
    bend_m: float = 0.0
    stretch: float = 0.0


def drawn_views(camera: Camera, count: int, seed: int, errors: Errors | None = None) -> tuple[BoardCorners, ...]:
    """Draw views in which all corners are in the image."""
    rng, wrong = np.random.default_rng(seed), errors or Errors()
    board_m = BOARD.corners_m.copy()
    board_m[:, 2] += wrong.bend_m * (1.0 - (2.0 * board_m[:, 0] / board_m[:, 0].max() - 1.0) ** 2)
    board_m[:, 0] *= 1.0 + wrong.stretch
    views: list[BoardCorners] = []
    while len(views) < count:
        seen = camera.project(_pose(camera, board_m, rng))
        if np.isfinite(seen).all() and camera.in_image(seen, margin_px=-4.0).all():
            ids = np.arange(len(seen))
            found = seen + _errors(seen, wrong, rng)
            views.append(BoardCorners(len(views), f"view {len(views)}", None, SIZE_PX, ids, found))
    return tuple(views)


def _pose(camera: Camera, board_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the corners (n, 3) in the camera frame, the board's middle somewhere in the image."""
    tilt_x, tilt_y = rng.uniform(-0.7, 0.7, 2)
    rotation = rotation_exp(np.array([tilt_x, 0.0, 0.0])) @ rotation_exp(np.array([0.0, tilt_y, 0.0]))
    rotation = rotation @ rotation_exp(np.array([0.0, 0.0, rng.normal(0.0, 0.2)]))
    ray = camera.rays(rng.uniform(0.1, 0.9, (1, 2)) * SIZE_PX)[0]
    distance_m = 0.2 * rng.uniform(1.2, 3.0) * camera.matrix_px[0, 0] / 600.0
    return (board_m - board_m.mean(axis=0)) @ rotation.T + distance_m * ray


def _errors(seen_px: np.ndarray, wrong: Errors, rng: np.random.Generator) -> np.ndarray:
    off = rng.normal(0.0, wrong.noise_px, seen_px.shape)
    if wrong.shared_px:
        squares = BOARD.corners_m[:, :2] / BOARD.square_m
        apart = np.square(squares[:, None] - squares).sum(axis=2)
        root = np.linalg.cholesky(np.exp(-apart / 18.0) + 1e-9 * np.eye(len(squares)))
        off += wrong.shared_px * root @ rng.normal(size=seen_px.shape)
    if wrong.motion_px_per_s:
        moved = rng.normal(0.0, wrong.motion_px_per_s, 2)
        off += np.outer(0.02 * seen_px[:, 1] / SIZE_PX[1], moved)
    return off


def search_of(views: tuple[BoardCorners, ...], size_px: tuple[int, int] = SIZE_PX) -> BoardSearch:
    """Return what a search that chose these views would have found."""
    return BoardSearch(BOARD, size_px, views, (), len(views))
