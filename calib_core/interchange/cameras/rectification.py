"""Rectified images of a distorted lens: their camera matrix, and the maps that make them."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from calib_core.arrays import freeze
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.own.raw_data import aed_either_way
from calib_core.interchange.syntax.zip_archives import pack_arrays
from calib_core.results import CheckPoint

_WIDEST = np.tan(np.radians(75.0))
"""A rectified image ends 75 degrees off the axis at the latest; beyond, a fisheye's pixels would be stretched without end."""
_BLOCK_ROWS = 64
_SHRINKING_STEPS = 40
_SMALLEST = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class RectificationMaps:
    """Where each pixel of the rectified image is in the image as taken, as cv2.remap takes it.

    Attributes:
        x_px: (height, width) columns, 32-bit.
        y_px: (height, width) rows, 32-bit.
    """

    x_px: np.ndarray
    y_px: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, np.float32, x_px=(None, None), y_px=(None, None))


def rectified_camera(camera: Camera) -> Camera:
    """Return the pinhole camera whose image, of the same size, is the largest without empty borders.

    That is OpenCV's getOptimalNewCameraMatrix with alpha 0, for every lens model, and checked against the lens.

    Raises:
        InputError: the lens images no rectangle around its axis.
    """
    low, high = _inner_rectangle(camera)
    share = 1.0
    if not _is_seen(camera, low, high):
        seen, unseen = 0.0, 1.0
        for _ in range(_SHRINKING_STEPS):
            share = (seen + unseen) / 2
            seen, unseen = (share, unseen) if _is_seen(camera, low * share, high * share) else (seen, share)
        share = seen
    if share < _SMALLEST:
        raise InputError(
            "no rectified image can be cut from this lens: its distortion folds back near the center; calibrate it again"
        )
    low, high = low * share, high * share
    size = np.array([camera.width_px, camera.height_px], dtype=np.float64)
    focal_px = (size - 1) / (high - low)
    centre_px = -focal_px * low
    matrix_px = np.array([[focal_px[0], 0.0, centre_px[0]], [0.0, focal_px[1], centre_px[1]], [0.0, 0.0, 1.0]])
    return Camera("pinhole", camera.width_px, camera.height_px, matrix_px)


def rectification_maps(camera: Camera, rectified: Camera) -> RectificationMaps:
    """Return where each pixel of the rectified image is in the image as taken.

    Args:
        camera: as it takes images.
        rectified: what `rectified_camera` returned for it.
    """
    maps = np.empty((2, rectified.height_px, rectified.width_px), dtype=np.float32)
    inverse = np.linalg.inv(rectified.matrix_px)
    columns = np.arange(rectified.width_px, dtype=np.float64)
    for top in range(0, rectified.height_px, _BLOCK_ROWS):
        rows = np.arange(top, min(top + _BLOCK_ROWS, rectified.height_px), dtype=np.float64)
        u, v = np.meshgrid(columns, rows)
        pixels_px = camera.project(np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)]) @ inverse.T)
        maps[:, top : top + len(rows)] = pixels_px.T.reshape(2, *u.shape)
    return RectificationMaps(*maps)


def rectified_file(file: CalibrationFile, rectified: Camera) -> CalibrationFile:
    """Return a calibration for rectified images: the pinhole camera, the check point in it, and the hash of the original."""
    calibration = replace(file.calibration, camera=rectified)
    check = file.check_point
    if check is not None:
        pixel_px = rectified.project(calibration.camera_from_radar @ check.radar_m[None])[0]
        check = CheckPoint(check.radar_m, pixel_px) if np.isfinite(pixel_px).all() else None
    return replace(
        file,
        calibration=calibration,
        check_point=check,
        aed_either_way_px=aed_either_way(file),
        made_from_sha256=calibration_sha256(file),
    )


def maps_npz(camera: Camera, rectified: Camera) -> bytes:
    """Return the maps as npz: image_rectified = cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR)."""
    maps = rectification_maps(camera, rectified)
    return pack_arrays(
        {
            "map_x": maps.x_px,
            "map_y": maps.y_px,
            "K_new": rectified.matrix_px,
            "image_size_px": np.array([rectified.width_px, rectified.height_px], dtype=np.int64),
            "K": camera.matrix_px,
            "D": camera.distortion,
            "camera_model": np.array(camera.model),
            "usage": np.array("rectified = cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR)"),
        }
    )


def _inner_rectangle(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (x, y) on the plane z = 1 of the largest rectangle that no edge of the image cuts into."""
    columns, rows = np.arange(camera.width_px, dtype=np.float64), np.arange(camera.height_px, dtype=np.float64)
    left = _on_plane(camera, np.column_stack([0.0 * rows, rows]))[:, 0]
    right = _on_plane(camera, np.column_stack([0.0 * rows + columns[-1], rows]))[:, 0]
    top = _on_plane(camera, np.column_stack([columns, 0.0 * columns]))[:, 1]
    bottom = _on_plane(camera, np.column_stack([columns, 0.0 * columns + rows[-1]]))[:, 1]
    low = [np.max(edge[edge < 0], initial=-_WIDEST) for edge in (left, top)]
    high = [np.min(edge[edge > 0], initial=_WIDEST) for edge in (right, bottom)]
    return np.array(low), np.array(high)


def _on_plane(camera: Camera, pixels_px: np.ndarray) -> np.ndarray:
    """Return where the pixels' rays meet the plane z = 1; NaN where they do not meet it.

    Beyond the radius where a distortion folds back, a ray may be on the wrong side of the axis.
    """
    rays = camera.rays(pixels_px)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(rays[:, 2:] > 0, rays[:, :2] / rays[:, 2:], np.nan)


def _is_seen(camera: Camera, low: np.ndarray, high: np.ndarray) -> bool:
    """Return whether the lens images the whole border of a rectangle on the plane z = 1."""
    if not (low < high).all():
        return False
    along = np.linspace(0.0, 1.0, 101)[:, None]
    (left, top), (right, bottom) = low, high
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]])
    border = np.concatenate([a + along * (b - a) for a, b in pairwise(corners)])
    return bool(camera.sees(np.column_stack([border, np.ones(len(border))])).all())
