"""How long 300 frames of 1080p take."""

import os
import time
from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.boards import render_board
from benchmarks.intrinsics.draws import CHECKERBOARD, FILMS, drawn_camera
from benchmarks.intrinsics.tables import Table
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch
from calib_core.measurements import TimeNs
from calib_core.synthetic.boards import waved_poses

__all__ = ["speed_table"]

_FRAMES = 300
_PER_POSE = 5
_SHIFT_PX = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class _Film:
    """Compressed frames, decoded when asked for, as a recording does."""

    frames: tuple[np.ndarray, ...]

    def __len__(self) -> int:
        return len(self.frames)

    def name(self, index: int, /) -> str:
        return f"frame {index + 1}"

    def time_ns(self, index: int, /) -> TimeNs | None:
        return TimeNs(index * 33_000_000)

    def image(self, index: int, /) -> np.ndarray:
        return np.asarray(cv2.imdecode(self.frames[index], cv2.IMREAD_COLOR))


def speed_table(first: int) -> Table:
    """Measure one film, from compressed frames to the calibrated lens."""
    film = _filmed(first)
    load = os.getloadavg()[0]
    begin_s, worked_s = time.perf_counter(), time.process_time()
    search = search_boards(film, CHECKERBOARD)
    between_s = time.perf_counter()
    if isinstance(search, BoardSearch):
        calibrate_lens(search)
    end_s, worked_s = time.perf_counter(), time.process_time() - worked_s
    views = len(search.views) if isinstance(search, BoardSearch) else 0
    seconds = (between_s - begin_s, end_s - between_s, end_s - begin_s, worked_s)
    head = (
        "frames",
        "processors",
        "load before",
        "search [s]",
        "calibration [s]",
        "together [s]",
        "processor time [s]",
    )
    row = (str(_FRAMES), str(os.cpu_count()), f"{load:.1f}", *(f"{one:.1f}" for one in seconds), str(views))
    note = (
        "JPEG frames of 1920 x 1080 with the board in each; decoding is part of it. The aim is 30 s on two processors that "
        "have nothing else to do; where the load before is not near 0, half the processor time says more."
    )
    return Table("Speed", (*head, "views chosen"), (row,), note)


def _filmed(first: int) -> _Film:
    """Draw a board that moves by a few pixels from frame to frame, and by a lot every few frames."""
    rng = np.random.default_rng([first, 90])
    camera = drawn_camera(rng, "plumb_bob", width_px=1920, height_px=1080)
    frames: list[np.ndarray] = []
    for pose in waved_poses(rng, CHECKERBOARD, camera, _FRAMES // _PER_POSE):
        still = render_board(CHECKERBOARD, camera, pose, FILMS["blur and noise"], seed=len(frames))
        for _ in range(_PER_POSE):
            across, down = rng.uniform(-_SHIFT_PX, _SHIFT_PX, 2).tolist()
            shift = np.array([[1.0, 0.0, across], [0.0, 1.0, down]])
            moved = cv2.warpAffine(still, shift, (1920, 1080), borderMode=cv2.BORDER_REPLICATE)
            frames.append(cv2.imencode(".jpg", moved, [cv2.IMWRITE_JPEG_QUALITY, 90])[1])
    return _Film(tuple(frames))
