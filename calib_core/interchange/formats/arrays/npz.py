"""NumPy's npz of plain arrays, without pickle."""

import io
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EQUATION, CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.arrays.named_arrays import from_arrays
from calib_core.interchange.formats.statement import STATEMENT_KEY, statement
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.own.calibration_json import COVARIANCE_CONVENTION
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.zip_archives import pack_arrays


def _write(file: CalibrationFile) -> bytes:
    """Write an npz of plain arrays: numpy.load reads it with allow_pickle=False."""
    calibration, check = file.calibration, file.check_point
    camera = calibration.camera
    arrays: dict[str, Any] = {
        "camera_from_radar": calibration.camera_from_radar.as_matrix(),
        "R": calibration.camera_from_radar.rotation,
        "t": calibration.camera_from_radar.translation_m,
        "K": camera.matrix_px,
        "D": camera.distortion,
        "image_size_px": np.array([camera.width_px, camera.height_px], dtype=np.int64),
        "camera_model": np.array(camera.model),
        "radar_frame": np.array(file.frames.radar),
        "camera_frame": np.array(file.frames.camera),
        "equation": np.array(EQUATION),
    }
    if np.isfinite(calibration.covariance).all():
        arrays |= {"covariance": calibration.covariance, "covariance_convention": np.array(COVARIANCE_CONVENTION)}
    if check is not None:
        arrays |= {"check_point_radar_m": check.radar_m, "check_point_pixel_px": check.pixel_px}
    meaning = "camera_from_radar, R and t carry radar points into the camera; K and D are the camera's"
    arrays[STATEMENT_KEY] = np.array(statement(file, meaning))
    return pack_arrays(arrays)


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


NUMPY = Format(
    name="numpy",
    title="NumPy arrays, no pickle",
    used_in="Calibration tools and arrays",
    also="Python npz",
    numbers="camera_from_radar (4x4), R and t carry radar points into the camera; K and D are the camera's",
    file_name="radar_camera.npz",
    camera="lens",
    comment="keys",
    write=_write,
    reads=Reads(_recognizes, _read),
)
