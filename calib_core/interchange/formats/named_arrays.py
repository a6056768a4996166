"""Read a calibration from named arrays: NumPy's npz, and what it shares with mat files."""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.format import ImportedCalibration, Reads, StatedCheckPoint, WrittenPose
from calib_core.interchange.own.calibration_json import COVARIANCE_CONVENTION
from calib_core.interchange.rotations import upper_rows
from calib_core.interchange.statement import STATEMENT_KEY, stated_lines, with_statement
from calib_core.interchange.syntax.content import Content

_ROUNDING = 1e-5


def from_arrays(arrays: Mapping[str, Any], name: str, *, source: str) -> ImportedCalibration:
    """Return the calibration in arrays that include camera_from_radar, or R and t.

    Args:
        arrays: by name.
        name: of the format.
        source: the name of the file in error messages.

    Raises:
        InputError: they include neither, or no valid rotation.
    """
    try:
        rotation, translation_m = _pose(arrays)
        pose = WrittenPose("matrix", rotation, translation_m, "camera_from_radar")
        named = "radar_frame" in arrays and "camera_frame" in arrays
        check = None
        if "check_point_radar_m" in arrays and "check_point_pixel_px" in arrays:
            check = StatedCheckPoint(
                np.ravel(arrays["check_point_radar_m"]), pixel_px=np.ravel(arrays["check_point_pixel_px"])
            )
        calibration = ImportedCalibration(
            name,
            pose,
            camera=_camera(arrays),
            frames=FrameNames(str(arrays["radar_frame"]), str(arrays["camera_frame"])) if named else None,
            check_point=check,
            assumptions=() if named else ("the file does not name its frames; assumed p_camera = R p_radar + t",),
            covariance=_covariance(arrays),
            faults=_faults(arrays),
        ).checked(source)
        return with_statement(calibration, stated_lines(arrays.get(STATEMENT_KEY)))
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{source}: needs camera_from_radar (4x4), or R and t ({error}); export it again") from None


def _pose(arrays: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotation (3, 3) and the translation (3,): those of the 4x4 matrix if there is one."""
    if "camera_from_radar" in arrays:
        rows = upper_rows(arrays["camera_from_radar"])
        return rows[:, :3], rows[:, 3]
    return np.asarray(arrays["R"], dtype=np.float64), np.asarray(arrays["t"], dtype=np.float64).ravel()


def _faults(arrays: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what contradicts the 4x4 matrix: R or t beside it, which other programs read instead."""
    rotation, translation_m = _pose(arrays)
    beside = {"R": rotation, "t": translation_m}
    if "camera_from_radar" not in arrays:
        return ()
    other = [key for key in beside if key in arrays and not _are_equal(arrays[key], beside[key])]
    return tuple(f"{key} is not that of camera_from_radar" for key in other)


def _are_equal(value: object, right: np.ndarray) -> bool:
    found = np.asarray(value, dtype=np.float64)
    return found.size == right.size and bool(np.abs(found.ravel() - right.ravel()).max() <= _ROUNDING)


def _covariance(arrays: Mapping[str, Any]) -> Matrix66 | None:
    """Return the covariance if the file says that it has our order and meaning, and it is one."""
    if str(arrays.get("covariance_convention")) != COVARIANCE_CONVENTION or "covariance" not in arrays:
        return None
    covariance = np.asarray(arrays["covariance"], dtype=np.float64)
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all() or (np.diag(covariance) < 0).any():
        raise ValueError("covariance is not a finite 6 x 6 matrix with a positive diagonal")
    return covariance


def _camera(arrays: Mapping[str, Any]) -> Camera | None:
    if not {"K", "D", "image_size_px", "camera_model"} <= set(arrays):
        return None
    width_px, height_px = np.ravel(arrays["image_size_px"]).tolist()
    model: Any = str(arrays["camera_model"])
    return Camera(model, int(width_px), int(height_px), np.asarray(arrays["K"]), np.ravel(arrays["D"]))


def _recognizes(content: Content) -> bool:
    return content.syntax == "archive"


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read an npz that contains camera_from_radar, or R and t.

    Raises:
        InputError: it contains neither, or Python objects.
    """
    arrays: dict[str, np.ndarray] = {}
    for name, data in content.members.items():
        try:
            arrays[name.removesuffix(".npy")] = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise InputError(f"{source}: {name}: {error}; save plain arrays") from None
    return from_arrays(arrays, "numpy", source=source)


NUMPY = Reads(_recognizes, _read)
