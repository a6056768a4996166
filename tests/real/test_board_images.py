"""Boards in real photographs."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.intrinsics.board import board_of_size
from calib_core.intrinsics.board_detection import blur_px, find_board
from calib_core.intrinsics.board_search import search_boards
from calib_core.measurements import TimeNs

BOARD = board_of_size("9x6", 25.0)


@pytest.mark.real
@pytest.mark.parametrize(("side", "rms_px"), [("left", 0.195), ("right", 0.207)])
def test_corners_are_at_least_as_good_as_opencvs(side, rms_px, shared_data):
    files = sorted((shared_data / "real_checkerboards").glob(f"{side}[01]*.jpg"))
    assert len(files) == 13
    found = [(image, find_board(image, BOARD)) for image in (cv2.imread(str(file)) for file in files)]
    corners = [one[1] for _, one in found if one is not None]
    assert len(corners) == 13
    flat = [BOARD.corners_m.astype(np.float32)] * 13
    rms, *_ = cv2.calibrateCamera(flat, [c.astype(np.float32) for c in corners], (640, 480), None, None)
    assert rms <= rms_px
    assert all(0.6 < blur_px(image, *one, BOARD) < 1.5 for image, one in found if one is not None)


class Photographs:
    """Images by name."""

    def __init__(self, shown: dict[str, np.ndarray]) -> None:
        self._names, self._shown = list(shown), list(shown.values())

    def __len__(self) -> int:
        return len(self._names)

    def name(self, index: int, /) -> str:
        return self._names[index]

    def time_ns(self, index: int, /) -> TimeNs | None:
        return None

    def image(self, index: int, /) -> np.ndarray:
        return self._shown[index]


def photographs(folder: Path, side: str) -> dict[str, np.ndarray]:
    return {
        file.stem: cv2.imread(str(file)) for file in sorted((folder / "real_checkerboards").glob(f"{side}[01]*.jpg"))
    }


@pytest.mark.real
@pytest.mark.parametrize("side", ["left", "right"])
def test_every_good_photograph_is_chosen_and_every_blurred_copy_called_blurred(side, shared_data):
    shown = photographs(shared_data, side)
    blurred = {f"{name} blurred": cv2.GaussianBlur(shown[name], (0, 0), 3.5) for name in list(shown)[:9:4]}
    moved = {f"{name} moved": cv2.blur(shown[name], (11, 1)) for name in list(shown)[1:10:4]}
    search = search_boards(Photographs({**shown, **blurred, **moved}), BOARD)
    assert [view.name for view in search.views] == list(shown)
    assert [one.name for one in search.left_out] == [*blurred, *moved]
    assert all(one.reason.startswith("blurred: edges are 3.") for one in search.left_out)
