"""A checkerboard that a person waves before the camera: from one pose to the next, held still for a moment at each."""

from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp, rotation_log
from calib_core.intrinsics.board import Board
from calib_core.synthetic.boards import BoardMotion, MovingBoard, PrintedBoard, checkerboard, printed_board, waved_poses

WAVED_BOARD = Board("checkerboard", 9, 6, 0.02214)
"""The paper's."""
_PERIOD_S = 1.0
_HELD_SHARE = 0.45
_EXPOSURE_S = 0.006
_STEP_S = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class BoardWaving:
    """How a board is waved.

    Attributes:
        printed: the board.
        camera: before which it is waved.
        poses: camera_from_board, one per period.
        duration_s: how long.
        board: as stated.
    """

    printed: PrintedBoard
    camera: Camera
    poses: tuple[RigidTransform, ...]
    duration_s: float
    board: Board = WAVED_BOARD

    def at(self, time_s: float) -> MovingBoard | None:
        """Return the board as it moves at a time from the start; None once it is put away."""
        if time_s >= self.duration_s:
            return None
        rotation, middle = self._pose(time_s)
        before, after = self._pose(time_s - _STEP_S), self._pose(time_s + _STEP_S)
        velocity = (after[1] - before[1]) / (2.0 * _STEP_S)
        turning = rotation_log(after[0] @ before[0].T) / (2.0 * _STEP_S)
        motion = BoardMotion(
            velocity_mps=(float(velocity[0]), float(velocity[1]), float(velocity[2])),
            turning_radps=(float(turning[0]), float(turning[1]), float(turning[2])),
            exposure_s=_EXPOSURE_S,
        )
        pose = RigidTransform(rotation, middle - rotation @ self.printed.middle_m)
        return MovingBoard(self.printed, self.camera, pose, motion)

    def _pose(self, time_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation and middle of the board, between the poses before and after."""
        number, share = divmod(max(time_s, 0.0) / _PERIOD_S, 1.0)
        first, second = (self.poses[min(int(number) + i, len(self.poses) - 1)] for i in (0, 1))
        s = float(np.clip((share - _HELD_SHARE) / (1.0 - _HELD_SHARE), 0.0, 1.0))
        s = s * s * (3.0 - 2.0 * s)
        turn = rotation_log(first.rotation.T @ second.rotation)
        middles = [(pose @ self.printed.middle_m[None])[0] for pose in (first, second)]
        return first.rotation @ rotation_exp(s * turn), (1.0 - s) * middles[0] + s * middles[1]


def draw_waving(rng: np.random.Generator, camera: Camera, duration_s: float) -> BoardWaving:
    """Draw how a board is waved.

    Args:
        rng: the only source of randomness.
        camera: before which it is waved.
        duration_s: how long.
    """
    count = int(np.ceil(duration_s / _PERIOD_S)) + 1
    poses = waved_poses(rng, WAVED_BOARD, camera, count)
    return BoardWaving(printed_board(WAVED_BOARD, checkerboard(WAVED_BOARD)), camera, poses, duration_s)
