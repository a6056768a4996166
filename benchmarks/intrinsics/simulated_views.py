"""Corners of a board in many pictures, without the pictures: for Monte Carlo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Points2
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.intrinsics import Board, BoardCorners
from calib_core.synthetic.boards import BoardFilm, MovingBoard, printed_board


@dataclass(frozen=True, slots=True)
class CornerErrors:
    """How found corners differ from the true ones.

    Attributes:
        sigma_px: standard deviation of independent errors, per axis.
        shared_px: standard deviation of errors that neighbouring corners of a view share, per axis.
        shared_over: distance over which they do, as a share of the board's diagonal in the picture.
        outlier_share: share of the corners with a gross error.
        outlier_px: standard deviation of that, per axis.
        speed_mps, turning_radps: standard deviations of the board's motion per axis, which matters to a rolling shutter.
    """

    sigma_px: float = 0.1
    shared_px: float = 0.0
    shared_over: float = 0.3
    outlier_share: float = 0.0
    outlier_px: float = 10.0
    speed_mps: float = 0.0
    turning_radps: float = 0.0


def simulated_views(
    rng: np.random.Generator,
    board: Board,
    camera: Camera,
    poses: Sequence[RigidTransform],
    errors: CornerErrors | None = None,
    film: BoardFilm | None = None,
) -> tuple[BoardCorners, ...]:
    """Return what a detector would find in pictures of a board; corners outside the picture are missing.

    Args:
        rng: the only source of randomness.
        board: the board as stated.
        camera: the true camera.
        poses: of the board, camera_from_board.
        errors: of the corners; None for independent ones only.
        film: its shape, and how long the picture's rows take.
    """
    errors, film = errors or CornerErrors(), film or BoardFilm()
    printed = printed_board(board, film.shape)
    size_px = camera.width_px, camera.height_px
    views = []
    for index, pose in enumerate(poses):
        moving = _waved(rng, film, errors) if errors.speed_mps or errors.turning_radps else film
        pixels = MovingBoard(printed, camera, pose, moving).pixels(printed.corners_m)
        pixels = pixels + _drawn_errors(rng, pixels, errors)
        ids = np.flatnonzero(camera.in_image(pixels))
        views.append(BoardCorners(index, f"view {index + 1}", None, size_px, ids, pixels[ids]))
    return tuple(views)


def _waved(rng: np.random.Generator, film: BoardFilm, errors: CornerErrors) -> BoardFilm:
    """Return the film with a drawn motion of the board."""
    x_mps, y_mps, z_mps = (errors.speed_mps * rng.standard_normal(3)).tolist()
    x_radps, y_radps, z_radps = (errors.turning_radps * rng.standard_normal(3)).tolist()
    return replace(film, velocity_mps=(x_mps, y_mps, z_mps), turning_radps=(x_radps, y_radps, z_radps))


def _drawn_errors(rng: np.random.Generator, pixels: Points2, errors: CornerErrors) -> Points2:
    drawn = errors.sigma_px * rng.standard_normal(pixels.shape)
    if errors.shared_px:
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
        reach = errors.shared_over * float(np.linalg.norm(np.ptp(pixels, axis=0)))
        values, vectors = np.linalg.eigh(np.exp(-0.5 * (apart / reach) ** 2))
        mixed = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn += errors.shared_px * mixed @ rng.standard_normal(pixels.shape)
    gross = rng.uniform(size=len(pixels)) < errors.outlier_share
    drawn[gross] += errors.outlier_px * rng.standard_normal((int(gross.sum()), 2))
    return drawn
