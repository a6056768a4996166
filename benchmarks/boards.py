"""Images of calibration boards of every kind, with the true corners: bent, moving, before a cluttered room, in bad light."""

from dataclasses import dataclass

import cv2
import numpy as np

from calib_core.arrays import Points2
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.intrinsics.board import Board
from calib_core.synthetic.boards import (
    MARGIN_SQUARES,
    BoardMotion,
    BoardPattern,
    MovingBoard,
    checkerboard,
    draw_board,
    printed_board,
    with_margin,
)

__all__ = ["BoardFilm", "render_board", "true_corners"]

_TAG_BORDER_BITS = 2
"""Kalibr's; the width of a tag's black border."""


@dataclass(frozen=True, slots=True)
class BoardFilm(BoardMotion):
    """How a board is filmed.

    Attributes:
        bend_m: of the board, as in `printed_board`.
        blur_px: standard deviation of the lens blur [px].
        noise_grey: standard deviation of the sensor's noise [grey levels], the same in all three channels.
        exposure: brightness over the usual one.
        gradient: by how much brighter than in the middle the light is at the right and at the lower border, as a share.
        vignetting: share of the light that is missing in the corners.
    """

    bend_m: tuple[float, float] = (0.0, 0.0)
    blur_px: float = 0.0
    noise_grey: float = 0.0
    exposure: float = 1.0
    gradient: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.0


_IDEAL = BoardFilm()


def render_board(
    board: Board,
    camera: Camera,
    camera_from_board: RigidTransform,
    film: BoardFilm = _IDEAL,
    *,
    seed: int = 0,
    background: np.ndarray | None = None,
) -> np.ndarray:
    """Render a board: (h, w, 3) uint8, blue first, all channels alike.

    Args:
        board: which board.
        camera: the lens.
        camera_from_board: the board's pose when the middle row is exposed.
        film: what the image suffers.
        seed: of the background and the noise.
        background: (h, w) grey levels behind the board; None draws a cluttered room.
    """
    rng = np.random.default_rng([seed, 5])
    levels = _room_behind(rng, camera) if background is None else background.astype(np.float32)
    moving = _moving(board, camera, camera_from_board, film)
    draw_board(levels, moving)
    if film.blur_px:
        levels = cv2.GaussianBlur(levels, (0, 0), film.blur_px, borderType=cv2.BORDER_REPLICATE)
    levels *= _light(camera, film)
    if film.noise_grey:
        levels += film.noise_grey * rng.standard_normal(levels.shape, dtype=np.float32)
    grey = np.clip(levels + 0.5, 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))


_ROUNDS = 30
_CLOSE_PX = 1e-9


def true_corners(board: Board, camera: Camera, camera_from_board: RigidTransform, film: BoardFilm = _IDEAL) -> Points2:
    """Return where the corners of a filmed board really are (n, 2), by id: each in the row that is exposed when it is there.

    Args:
        board: the board as stated.
        camera: the true camera.
        camera_from_board: the board's pose when the middle row is exposed.
        film: how it is filmed.
    """
    moving = _moving(board, camera, camera_from_board, film)
    corners_m = moving.printed.corners_m
    pixels = camera.project(camera_from_board @ corners_m)
    if not moving.rows_differ:
        return pixels
    for _ in range(_ROUNDS):
        rotations, translations = moving.poses(moving.row_times_s(pixels[:, 1]))
        seen = np.einsum("nij,nj->ni", rotations, corners_m) + translations
        before, pixels = pixels, camera.project(seen)
        if not np.nanmax(np.abs(pixels - before), initial=0.0) > _CLOSE_PX:
            break
    return pixels


def _moving(board: Board, camera: Camera, camera_from_board: RigidTransform, film: BoardFilm) -> MovingBoard:
    kinds = {"checkerboard": checkerboard, "charuco": _charuco, "aprilgrid": _aprilgrid}
    printed = printed_board(board, kinds[board.kind](board), film.bend_m)
    return MovingBoard(printed, camera, camera_from_board, film)


def _charuco(board: Board) -> BoardPattern:
    """Lay out a ChArUco board as OpenCV does: the upper left square is black, markers are in the white ones."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    bits = dictionary.markerSize + 2
    inset = 0.5 * (board.square_m - board.marker_m)
    steps = np.concatenate([[0.0], inset + board.marker_m * np.arange(bits + 1) / bits])
    x_m, y_m = (
        np.append((board.square_m * np.arange(-1, count - 1)[:, None] + steps).ravel(), board.square_m * (count - 1))
        for count in (board.columns, board.rows)
    )
    paper = np.zeros((len(y_m) - 1, len(x_m) - 1))
    number = 0
    for row in range(board.rows):
        for column in range(board.columns):
            if (row + column) % 2 == 0:
                continue
            square = paper[row * len(steps) : (row + 1) * len(steps), column * len(steps) : (column + 1) * len(steps)]
            square[:] = 1.0
            square[1:-1, 1:-1] = dictionary.generateImageMarker(number, bits, borderBits=1) > 0
            number += 1
    return with_margin(x_m, y_m, paper, MARGIN_SQUARES * board.square_m)


def _aprilgrid(board: Board) -> BoardPattern:
    """Lay out a grid of AprilTags as Kalibr prints it: tag 0 below left, black squares at the corners of all tags."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    bits = dictionary.markerSize + 2 * _TAG_BORDER_BITS
    first_m = board.corners_m[:, :2].min(axis=0)
    steps = board.square_m * np.arange(bits + 1) / bits
    pitch_m = board.square_m + board.marker_m
    x_m, y_m = (
        np.concatenate([[-board.marker_m], (pitch_m * np.arange(count)[:, None] + steps).ravel(), [pitch_m * count]])
        for count in (board.columns, board.rows)
    )
    paper = np.ones((len(y_m) - 1, len(x_m) - 1))
    paper[:: bits + 1, :: bits + 1] = 0.0
    for tag in range(board.columns * board.rows):
        row, column = board.rows - 1 - tag // board.columns, tag % board.columns
        cells = (
            slice(row * (bits + 1) + 1, (row + 1) * (bits + 1)),
            slice(column * (bits + 1) + 1, (column + 1) * (bits + 1)),
        )
        upside_down = dictionary.generateImageMarker(tag, bits, borderBits=_TAG_BORDER_BITS) > 0
        paper[cells] = upside_down[::-1, ::-1]  # OpenCV's tags are AprilTag's, turned by half a turn
    return with_margin(first_m[0] + x_m, first_m[1] + y_m, paper, 0.3 * board.square_m)


def _light(camera: Camera, film: BoardFilm) -> np.ndarray:
    """Return the brightness (h, w) over the usual one: exposure, gradient, vignetting."""
    u = np.linspace(-1.0, 1.0, camera.width_px, dtype=np.float32)
    v = np.linspace(-1.0, 1.0, camera.height_px, dtype=np.float32)[:, None]
    corner = u[0] ** 2 + v[0] ** 2
    slope = 1.0 + np.float32(film.gradient[0]) * u + np.float32(film.gradient[1]) * v
    dark = 1.0 - np.float32(film.vignetting) * (u * u + v * v) / corner
    return np.asarray(np.float32(film.exposure) * np.maximum(slope, 0.0) * dark, dtype=np.float32)


_OCTAVES_PX = ((160, 28.0), (40, 14.0), (9, 6.0))
_THINGS = 14


def _room_behind(rng: np.random.Generator, camera: Camera) -> np.ndarray:
    """Draw grey levels (h, w), float32: clouds of three sizes, and things with straight edges."""
    width, height = camera.width_px, camera.height_px
    levels = np.full((height, width), 110.0, dtype=np.float32)
    for size, strength in _OCTAVES_PX:
        small = rng.standard_normal((height // size + 3, width // size + 3), dtype=np.float32)
        levels += np.float32(strength) * cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(_THINGS):
        u, v = rng.uniform([0.0, 0.0], [width, height]).tolist()
        long, wide = (rng.uniform(0.02, 0.22, 2) * width).tolist()
        corners = cv2.boxPoints(((u, v), (long, wide), float(rng.uniform(0.0, 180.0))))
        cv2.fillConvexPoly(levels, np.round(corners).astype(np.int32), (float(rng.uniform(30.0, 210.0)),))
    return np.clip(levels, 5.0, 245.0)
