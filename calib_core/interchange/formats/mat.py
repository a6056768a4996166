"""MATLAB's mat file of level 5, with the fields of rigidtform3d and of cameraIntrinsics."""

import io
from typing import Any

import numpy as np

from calib_core.interchange.calibration_file import EQUATION, CalibrationFile
from calib_core.interchange.cameras.matlab import ONE_BASED
from calib_core.interchange.format import Format, ImportedCalibration, Reads
from calib_core.interchange.formats.named_arrays import from_arrays
from calib_core.interchange.own.calibration_json import COVARIANCE_CONVENTION
from calib_core.interchange.statement import STATEMENT_KEY, statement
from calib_core.interchange.syntax.content import Content

_TEXT_BYTES = 116
_NOTES = (
    "in MATLAB: load radar_camera.mat; tform = rigidtform3d(camera_from_radar.A); intrinsics = "
    "cameraIntrinsicsFromOpenCV(camera.K, camera.Distortion, camera.ImageSize), which counts pixels from 0 as camera.K does; "
    "camera.PrincipalPoint counts from 1 as cameraIntrinsics does; neither function is for the equidistant model",
)


def _write(file: CalibrationFile) -> bytes:
    """Write a mat file (level 5) with the fields of rigidtform3d and of cameraIntrinsics."""
    from scipy.io import savemat

    calibration, check = file.calibration, file.check_point
    camera, pose = calibration.camera, calibration.camera_from_radar
    content: dict[str, Any] = {
        "camera_from_radar": {
            "Dimensionality": 3.0,
            "R": pose.rotation,
            "Translation": pose.translation_m[None, :],
            "A": pose.as_matrix(),
        },
        "camera": {
            "FocalLength": np.array([[camera.matrix_px[0, 0], camera.matrix_px[1, 1]]]),
            "PrincipalPoint": camera.matrix_px[None, :2, 2] + ONE_BASED,
            "ImageSize": np.array([[float(camera.height_px), float(camera.width_px)]]),
            "Skew": float(camera.matrix_px[0, 1]),
            "Model": camera.model,
            "K": camera.matrix_px,
            "Distortion": camera.distortion[None, :],
        },
        "frames": {"radar": file.frames.radar, "camera": file.frames.camera},
        "equation": EQUATION,
    }
    if np.isfinite(calibration.covariance).all():
        content |= {"covariance": calibration.covariance, "covariance_convention": COVARIANCE_CONVENTION}
    if check is not None:
        content["check_point"] = {"radar_m": check.radar_m[None, :], "pixel_px": check.pixel_px[None, :]}
    meaning = "camera_from_radar.A carries radar points into the camera; camera.PrincipalPoint counts pixels from 1"
    content[STATEMENT_KEY] = "\n".join(statement(file, meaning))
    buffer = io.BytesIO()
    savemat(buffer, content, long_field_names=True, oned_as="row")  # type: ignore[arg-type]
    dated = buffer.getvalue()  # begins with a date, which would make every file another
    return f"MATLAB 5.0 MAT-file, cocalib, {EQUATION}".ljust(_TEXT_BYTES).encode()[:_TEXT_BYTES] + dated[_TEXT_BYTES:]


def _recognizes(content: Content) -> bool:
    return content.syntax == "mat"


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a mat file that contains camera_from_radar as a struct with A, or as a 4x4 matrix.

    Raises:
        InputError: it contains neither.
    """
    variables = content.variables
    arrays: dict[str, Any] = {}
    matrix = variables.get("camera_from_radar")
    if matrix is not None:
        arrays["camera_from_radar"] = matrix.get("A") if isinstance(matrix, dict) else matrix
        if isinstance(matrix, dict):
            arrays |= {ours: matrix[key] for ours, key in (("R", "R"), ("t", "Translation")) if key in matrix}
    frames, check, camera = (variables.get(key) for key in ("frames", "check_point", "camera"))
    if isinstance(frames, dict):
        arrays |= {"radar_frame": frames.get("radar", ""), "camera_frame": frames.get("camera", "")}
    if isinstance(check, dict):
        arrays |= {f"check_point_{key}": value for key, value in check.items()}
    if isinstance(camera, dict) and {"K", "Distortion", "ImageSize", "Model"} <= set(camera):
        arrays |= {"K": camera["K"], "D": np.ravel(camera["Distortion"]), "camera_model": camera["Model"]}
        arrays["image_size_px"] = np.ravel(camera["ImageSize"])[::-1]
    arrays |= {
        key: variables[key] for key in ("covariance", "covariance_convention", STATEMENT_KEY) if key in variables
    }
    return from_arrays(arrays, "matlab", source=source)


MATLAB = Format(
    name="matlab",
    title="MATLAB mat file",
    used_in="Calibration tools and arrays",
    also="Octave cameraIntrinsics rigidtform3d",
    numbers="camera_from_radar.A carries radar points into the camera; camera.PrincipalPoint counts from 1",
    file_name="radar_camera.mat",
    camera="lens",
    pose_for="raw",
    comment="keys",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
