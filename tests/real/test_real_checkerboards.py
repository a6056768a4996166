"""OpenCV's own pictures of a checkerboard, from a stereo pair: calibrated as well as OpenCV does, with bad copies named."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.intrinsics import (
    BoardCorners,
    BoardSearch,
    CalibratedLens,
    IntrinsicsOptions,
    board_of_size,
    calibrate_lens,
)

pytestmark = pytest.mark.real

BOARD = board_of_size("9x6", 25.0)
SIZE_PX = (640, 480)
OPENCV_RMS_PX = {"left": 0.19542, "right": 0.20702}


def corners(grey: np.ndarray, index: int, name: str) -> BoardCorners | None:
    found, pixels = cv2.findChessboardCorners(grey, (9, 6))
    if not found:
        return None
    ends = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
    pixels = cv2.cornerSubPix(grey, pixels, (5, 5), (-1, -1), ends)
    return BoardCorners(index, name, None, SIZE_PX, np.arange(54), pixels.reshape(-1, 2))


def pictures(folder: Path, side: str) -> dict[str, np.ndarray]:
    paths = sorted((folder / "real_checkerboards").glob(f"{side}[0-9]*.jpg"))
    return {path.name: cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths}


def calibrated(views: list[BoardCorners], options: IntrinsicsOptions | None = None) -> CalibratedLens:
    lens = calibrate_lens(BoardSearch(BOARD, SIZE_PX, tuple(views), (), len(views)), options)
    assert isinstance(lens, CalibratedLens), lens
    return lens


def found_in(shown: dict[str, np.ndarray], first: int = 0) -> list[BoardCorners]:
    found = [corners(grey, first + index, name) for index, (name, grey) in enumerate(shown.items())]
    return [view for view in found if view is not None]


@pytest.mark.parametrize("side", ["left", "right"])
def test_all_views_fit_as_well_as_with_opencv(shared_data: Path, side: str) -> None:
    lens = calibrated(found_in(pictures(shared_data, side)), IntrinsicsOptions(model="plumb_bob"))
    assert (len(lens.views), lens.left_out) == (13, ())
    assert all(view.used.all() for view in lens.views)
    assert lens.rms_px < OPENCV_RMS_PX[side] + 1e-5
    assert lens.rms_px < lens.held_out_rms_px < 1.05 * lens.rms_px


def test_the_model_with_five_coefficients_is_chosen(shared_data: Path) -> None:
    assert calibrated(found_in(pictures(shared_data, "left"))).camera.model == "plumb_bob"


def test_planted_copies_are_named_and_no_good_view_is_dropped(shared_data: Path) -> None:
    shown = pictures(shared_data, "left")
    blurred = {
        f"blurred {name}": cv2.GaussianBlur(shown[name], (0, 0), 3.5)
        for name in ("left03.jpg", "left05.jpg", "left07.jpg")
    }
    mirrored = {f"mirrored {name}": np.ascontiguousarray(shown[name][:, ::-1]) for name in ("left01.jpg", "left09.jpg")}
    squeezed = cv2.resize(shown["left02.jpg"], (640, 400))
    other = {"other board": cv2.copyMakeBorder(squeezed, 40, 40, 0, 0, cv2.BORDER_REPLICATE)}
    planted = {**blurred, **mirrored, **other}
    lens = calibrated(found_in(shown) + found_in(planted, 100), IntrinsicsOptions(model="plumb_bob"))
    assert [view.corners.name for view in lens.views] == list(shown)
    reasons = {picture.name: picture.reason for picture in lens.left_out}
    assert set(reasons) == set(planted)
    assert all(reasons[name].startswith("mirrored:") for name in mirrored)
    assert all("its corners fit to" in reasons[name] for name in [*blurred, *other])
