"""The check point of an exported file: in one sentence, and where in which picture it is."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector2
from calib_core.camera import Camera
from calib_core.interchange import CalibrationFile, Format, ImportedCalibration
from calib_core.measurements import TimeNs

_SAME_M = 2e-3
"""The check point is the true position of a pair, rounded to a millimetre in each coordinate."""


@dataclass(frozen=True, slots=True)
class CheckPointRow:
    """The check point, for display.

    Attributes:
        words: what must come out of a reader of the file.
        u_px: column of its pixel in the picture as taken.
        v_px: row of it.
        width_px: of that picture.
        height_px: of that picture.
        pair: id of the pair whose picture shows it; "" if none does.
    """

    words: str
    u_px: float
    v_px: float
    width_px: int
    height_px: int
    pair: str


def check_point_row(file: CalibrationFile, form: Format, read_back: ImportedCalibration) -> CheckPointRow | None:
    """Describe the check point of a calibration in a format; None if the calibration has none.

    Args:
        file: the calibration.
        form: the format.
        read_back: what was read from the file in that format.
    """
    check, camera = file.check_point, file.calibration.camera
    if check is None:
        return None
    point = f"The radar point ({', '.join(f'{value:.3f}' for value in check.radar_m)}) m"
    pixel = _pixel_words(check.pixel_px)
    camera_m = (file.calibration.camera_from_radar @ check.radar_m[None])[0]
    if form.is_for_rectified and camera.is_distorted:
        rectified = _pixel_words(_rectified_pixel(camera, read_back, camera_m))
        words = (
            f"{point} must project to {rectified} of the rectified picture, which is {pixel} of the picture as taken"
        )
    else:
        words = f"{point} must project to {pixel}"
    words += ": recompute it with your reader to test it."
    if form.camera == "none":
        at = ", ".join(f"{value:.3f}" for value in camera_m)
        words += f" This file holds no lens: expect ({at}) m in {file.frames.camera!r}, and the pixel through your own."
    return CheckPointRow(
        words=words,
        u_px=float(check.pixel_px[0]),
        v_px=float(check.pixel_px[1]),
        width_px=camera.width_px,
        height_px=camera.height_px,
        pair=_pair_at(file) or "",
    )


def picture_of(file: CalibrationFile) -> TimeNs | None:
    """Return the stamp of the frame in which the check point was clicked; None if it is no pair's position."""
    pair = _pair_at(file)
    return next((one.image_time for one in file.calibration.pairs if one.id == pair), None)


def _pixel_words(pixel_px: Vector2) -> str:
    return f"pixel ({pixel_px[0]:.2f}, {pixel_px[1]:.2f})"


def _rectified_pixel(camera: Camera, read_back: ImportedCalibration, camera_m: np.ndarray) -> Vector2:
    """Project with the matrix that the file holds, or with the lens's own if reading it back gave none."""
    size_px = (camera.width_px, camera.height_px)
    rectified = read_back.camera_for(size_px) or Camera("pinhole", *size_px, camera.matrix_px)
    return rectified.project(camera_m[None])[0]


def _pair_at(file: CalibrationFile) -> str | None:
    """Return the id of the pair whose true position is the check point, if it was clicked in a picture."""
    pairs = [pair for pair in file.calibration.pairs if pair.inlier and pair.image_time is not None]
    if file.check_point is None or not pairs:
        return None
    true_m = file.calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]))
    apart_m = np.linalg.norm(true_m - file.check_point.radar_m, axis=1)
    nearest = int(np.argmin(apart_m))
    return pairs[nearest].id if apart_m[nearest] < _SAME_M else None
