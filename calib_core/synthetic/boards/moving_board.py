"""A moving board: what a picture of it suffers, where it is, and where its corners are while rows are exposed one by one."""

from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Points2, Points3, Values, Vector3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.intrinsics import Board
from calib_core.synthetic.boards.printed_board import BoardShape, PrintedBoard, printed_board


@dataclass(frozen=True, slots=True)
class BoardFilm:
    """How a board is filmed.

    Attributes:
        shape: of the board.
        blur_px: standard deviation of the lens blur [px].
        noise_grey: standard deviation of the sensor's noise [grey levels], the same in all three channels.
        exposure: brightness over the usual one.
        gradient: by how much brighter than in the middle the light is at the right and at the lower border, as a share.
        vignetting: share of the light that is missing in the corners.
        black_grey, white_grey: levels of the board's ink and paper.
        velocity_mps: (3,) of the board's middle, in the camera frame.
        turning_radps: (3,) the board's rotation vector per second, in the camera frame.
        rolling_shutter_s: from the exposure of the first row to that of the last; the pose is that at the middle row.
        exposure_s: how long each row is exposed.
    """

    shape: BoardShape = field(default_factory=BoardShape)
    blur_px: float = 0.0
    noise_grey: float = 0.0
    exposure: float = 1.0
    gradient: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.0
    black_grey: float = 35.0
    white_grey: float = 205.0
    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turning_radps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rolling_shutter_s: float = 0.0
    exposure_s: float = 0.0


_ROUNDS = 30
_CLOSE_PX = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class MovingBoard:
    """A board that moves steadily through a picture.

    Attributes:
        printed: the board.
        camera: that films it.
        camera_from_board: its pose when the middle row is exposed.
        film: how it moves, and how the rows are exposed.
    """

    printed: PrintedBoard
    camera: Camera
    camera_from_board: RigidTransform
    film: BoardFilm

    @property
    def rows_differ(self) -> bool:
        """Whether the board is elsewhere in each row."""
        return bool(self.film.rolling_shutter_s and self.moves)

    @property
    def moves(self) -> bool:
        """Whether the board moves at all."""
        return any(self.film.velocity_mps) or any(self.film.turning_radps)

    def row_times_s(self, rows_px: Values) -> Values:
        """Return when rows are exposed, from the time of the pose on [s]."""
        height = self.camera.height_px
        return np.asarray(self.film.rolling_shutter_s * (rows_px - 0.5 * (height - 1)) / height)

    def poses(self, times_s: Values) -> tuple[np.ndarray, np.ndarray]:
        """Return rotations (n, 3, 3) and translations (n, 3) of camera_from_board at times (n,)."""
        times = np.asarray(times_s, dtype=np.float64)[:, None]
        middle = self.camera_from_board @ self.printed.middle_m[None]
        rotations = rotation_exp(times * np.array(self.film.turning_radps)) @ self.camera_from_board.rotation
        middles = middle + times * np.array(self.film.velocity_mps)
        return rotations, middles - rotations @ self.printed.middle_m

    def pixels(self, points_m: Points3) -> Points2:
        """Return where points of the board (n, 3) are in the picture: each in the row that is exposed when it is there."""
        pixels = self.camera.project(self.camera_from_board @ points_m)
        if not self.rows_differ:
            return pixels
        for _ in range(_ROUNDS):
            rotations, translations = self.poses(self.row_times_s(pixels[:, 1]))
            seen: Vector3 = np.einsum("nij,nj->ni", rotations, points_m) + translations
            before, pixels = pixels, self.camera.project(seen)
            if not np.nanmax(np.abs(pixels - before), initial=0.0) > _CLOSE_PX:
                break
        return pixels


def true_corners(
    board: Board, camera: Camera, camera_from_board: RigidTransform, film: BoardFilm | None = None
) -> Points2:
    """Return where the corners of a filmed board really are (n, 2), by id; NaN behind the camera. For tests only.

    Args:
        board: the board as stated.
        camera: the true camera.
        camera_from_board: the board's pose when the middle row is exposed.
        film: how it is filmed; None for an ideal board at rest.
    """
    film = film or BoardFilm()
    printed = printed_board(board, film.shape)
    return MovingBoard(printed, camera, camera_from_board, film).pixels(printed.corners_m)
