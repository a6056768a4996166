"""Corners of a checkerboard in a picture, and the camera's pose of the board."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp

_LEAST_DEPTH = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """A checkerboard as the camera sees it.

    Attributes:
        corners_px: (n, 2) the inner corners in the picture, row by row.
        corners_camera_m: (n, 3) the same corners in the camera frame.
        camera_from_board: the board's pose; its origin is the first corner.
        rms_px: root mean square distance between the detected corners and the projected ones.
    """

    corners_px: Points2
    corners_camera_m: Points3
    camera_from_board: RigidTransform
    rms_px: float

    def __post_init__(self) -> None:
        n = len(self.corners_px)
        object.__setattr__(self, "corners_px", frozen_array(self.corners_px, (n, 2)))
        object.__setattr__(self, "corners_camera_m", frozen_array(self.corners_camera_m, (n, 3)))


def board_corners(columns: int, rows: int, square_m: float) -> Points3:
    """Return the inner corners of a checkerboard in its own plane, row by row from the first: (rows * columns, 3) [m]."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    return square_m * np.stack([column, row, np.zeros_like(row)], axis=1).astype(np.float64)


def find_corners(picture: np.ndarray, columns: int, rows: int) -> Points2 | None:
    """Find all inner corners of a checkerboard: (rows * columns, 2) [px], row by row; None if one of them is hidden.

    Args:
        picture: uint8 (h, w, 3), blue first.
        columns: inner corners in a row.
        rows: number of rows.
    """
    import cv2

    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    found, corners = cv2.findChessboardCornersSB(grey, (columns, rows), flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2) if found else None


def view_of_board(corners_px: Points2, columns: int, rows: int, square_m: float, camera: Camera) -> BoardView | None:
    """Solve for the board's pose from its corners; None if the lens cannot have seen such a board.

    Args:
        corners_px: (rows * columns, 2) as find_corners returns them.
        columns: inner corners in a row.
        rows: number of rows.
        square_m: side of a square.
        camera: the intrinsics.
    """
    import cv2

    rays = camera.rays(corners_px)
    if not np.isfinite(rays).all() or (rays[:, 2] <= _LEAST_DEPTH).any():
        return None
    board_m, plane = board_corners(columns, rows, square_m), rays[:, :2] / rays[:, 2:]
    _, vectors, shifts, _ = cv2.solvePnPGeneric(board_m, plane, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    poses = [RigidTransform(rotation_exp(v.ravel()), t.ravel()) for v, t in zip(vectors, shifts, strict=True)]
    views = [_seen(pose, board_m, corners_px, camera) for pose in poses]
    possible = [view for view in views if np.isfinite(view.rms_px)]
    return min(possible, key=lambda view: view.rms_px, default=None)


def _seen(pose: RigidTransform, board_m: Points3, corners_px: Points2, camera: Camera) -> BoardView:
    at_m = pose @ board_m
    apart_px = camera.project(at_m) - corners_px
    return BoardView(corners_px, at_m, pose, float(np.sqrt(np.square(apart_px).sum(axis=1).mean())))
