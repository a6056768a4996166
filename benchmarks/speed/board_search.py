"""How long a search for a checkerboard in 300 frames takes, compared with OpenCV's detector on the same frames."""

import time

import cv2
import numpy as np

from benchmarks.boards import BoardFilm, render_board
from benchmarks.speed.rows import Row, Table
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_search import search_boards
from calib_core.measurements import TimeNs
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera

__all__ = ["measure_board_search"]

_BOARD = Board("checkerboard", 9, 6, 0.02214)
_FRAMES, _RENDERED, _AIM_S = 300, 12, 30.0


class _Frames:
    """A few rendered frames, shown again and again."""

    def __init__(self) -> None:
        camera = typical_camera("plumb_bob", width_px=1920, height_px=1080)
        poses = waved_poses(np.random.default_rng(3), _BOARD, camera, _RENDERED)
        film = BoardFilm(blur_px=0.7, noise_grey=2.0)
        shown = [render_board(_BOARD, camera, pose, film, seed=number) for number, pose in enumerate(poses)]
        self._encoded = [cv2.imencode(".jpg", image)[1] for image in shown]

    def __len__(self) -> int:
        return _FRAMES

    def name(self, index: int, /) -> str:
        return f"frame {index + 1}"

    def time_ns(self, index: int, /) -> TimeNs | None:
        return None

    def image(self, index: int, /) -> np.ndarray:
        return np.asarray(cv2.imdecode(self._encoded[index % _RENDERED], cv2.IMREAD_COLOR))


def measure_board_search() -> Table:
    """Search 300 frames of 1920 x 1080 for a checkerboard."""
    frames = _Frames()
    wall, processor = time.perf_counter(), time.process_time()
    search_boards(frames, _BOARD, progress=lambda _: None)
    wall_s, ours_s = time.perf_counter() - wall, time.process_time() - processor
    processor = time.process_time()
    for index in range(_RENDERED):
        cv2.findChessboardCorners(cv2.cvtColor(frames.image(index), cv2.COLOR_BGR2GRAY), (9, 6))
    peer_s = (time.process_time() - processor) * _FRAMES / _RENDERED
    row = Row(
        f"{_FRAMES} frames",
        f"{wall_s:.1f} s, {ours_s:.1f} s of processor time",
        f"{ours_s / peer_s:.2f} of findChessboardCorners without refinement",
        f"{_AIM_S:.0f} s",
        wall_s <= _AIM_S,
    )
    how = (
        f"{_RENDERED} rendered frames of 1920 x 1080 as JPEG, repeated, all with the board; decoding, refinement, blur, coverage "
        "and choice included."
    )
    return Table("Searching for a board", how, (row,))
