"""Plain matrices: text, NumPy's npz without pickle, MATLAB's mat."""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EQUATION, CalibrationFile, FrameNames
from calib_core.interchange.formats.statement import hash_comment, stated_check_point, stated_frames, statement
from calib_core.interchange.imported import ImportedCalibration, StatedCheckPoint, WrittenPose
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.yaml_text import numbers_text
from calib_core.interchange.syntax.zip_archives import pack, unpack

__all__ = ["MATLAB_NOTES", "read_matlab", "read_matrix", "read_numpy", "write_matlab", "write_matrix", "write_numpy"]

MATLAB_NOTES = (
    "in MATLAB: load radar_camera.mat; tform = rigidtform3d(camera_from_radar.A); "
    "camera.PrincipalPoint counts pixels from 1 as MATLAB does, camera.K from 0 as OpenCV does",
)
_MAT_TEXT_BYTES = 116
_ONE_BASED = 1.0
_LARGEST = 1e9


def write_matrix(file: CalibrationFile) -> str:
    """Write the 4x4 matrix that carries radar points into the camera; numpy.loadtxt and MATLAB's load read it."""
    meaning = "the rows of the 4x4 matrix that carries homogeneous radar points into the camera"
    rows = file.calibration.camera_from_radar.as_matrix()
    return hash_comment(statement(file, meaning)) + "".join(f"{numbers_text(row, ' ')}\n" for row in rows)


def read_matrix(text: str, source: str) -> ImportedCalibration:
    """Read 12 or 16 numbers as the rows of a 3x4 or 4x4 matrix.

    Raises:
        InputError: there is another number of numbers, or something else among them.
    """
    words = [word for line in text.splitlines() for word in line.partition("#")[0].replace(",", " ").split()]
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{source}: not a matrix ({error}); give 3 or 4 rows of 4 numbers") from None
    if len(numbers) not in (12, 16) or not (np.abs(numbers) <= _LARGEST).all():
        raise InputError(f"{source}: expected 12 or 16 finite numbers, found {len(numbers)}; give 3 or 4 rows of 4")
    if len(numbers) == 16 and np.abs(numbers[12:] - [0, 0, 0, 1]).max() > 0:
        raise InputError(f"{source}: the last row must be 0 0 0 1; is the matrix transposed?")
    frames = stated_frames(text)
    rows = numbers.reshape(-1, 4)
    return ImportedCalibration(
        "matrix",
        WrittenPose("matrix", rows[:3, :3], rows[:3, 3], "camera_from_radar"),
        frames=frames,
        check_point=stated_check_point(text),
        notes=() if frames else ("no word says what the matrix does; took it as p_camera = R p_radar + t",),
    ).checked(source)


def write_numpy(file: CalibrationFile) -> bytes:
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
        arrays["covariance"] = calibration.covariance
    if check is not None:
        arrays |= {"check_point_radar_m": check.radar_m, "check_point_pixel_px": check.pixel_px}
    members = {}
    for name, array in arrays.items():
        buffer = io.BytesIO()
        np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=False)
        members[f"{name}.npy"] = buffer.getvalue()
    return pack(members)


def read_numpy(data: bytes, source: str) -> ImportedCalibration:
    """Read an npz that holds camera_from_radar, or R and t.

    Raises:
        InputError: it holds neither, or Python objects.
    """
    arrays: dict[str, np.ndarray] = {}
    for name, content in unpack(data, source=source).items():
        try:
            arrays[name.removesuffix(".npy")] = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise InputError(f"{source}: {name}: {error}; save plain arrays") from None
    return _from_arrays(arrays, "numpy", source=source)


def _from_arrays(arrays: Mapping[str, Any], name: str, *, source: str) -> ImportedCalibration:
    try:
        if "camera_from_radar" in arrays:
            rows = np.asarray(arrays["camera_from_radar"], dtype=np.float64).reshape(-1, 4)
            rotation, translation_m = rows[:3, :3], rows[:3, 3]
        else:
            rotation = np.asarray(arrays["R"], dtype=np.float64)
            translation_m = np.asarray(arrays["t"], dtype=np.float64).ravel()
        pose = WrittenPose("matrix", rotation, translation_m, "camera_from_radar")
        named = "radar_frame" in arrays and "camera_frame" in arrays
        check = None
        if "check_point_radar_m" in arrays and "check_point_pixel_px" in arrays:
            check = StatedCheckPoint(
                np.ravel(arrays["check_point_radar_m"]), pixel_px=np.ravel(arrays["check_point_pixel_px"])
            )
        return ImportedCalibration(
            name,
            pose,
            camera=_camera(arrays),
            frames=FrameNames(str(arrays["radar_frame"]), str(arrays["camera_frame"])) if named else None,
            check_point=check,
            notes=() if named else ("the file names no frames; took it as p_camera = R p_radar + t",),
        ).checked(source)
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{source}: needs camera_from_radar (4x4), or R and t ({error}); export it again") from None


def _camera(arrays: Mapping[str, Any]) -> Camera | None:
    if not {"K", "D", "image_size_px", "camera_model"} <= set(arrays):
        return None
    width_px, height_px = np.ravel(arrays["image_size_px"]).tolist()
    model: Any = str(arrays["camera_model"])
    return Camera(model, int(width_px), int(height_px), np.asarray(arrays["K"]), np.ravel(arrays["D"]))


def write_matlab(file: CalibrationFile) -> bytes:
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
            "PrincipalPoint": camera.matrix_px[None, :2, 2] + _ONE_BASED,
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
        content["covariance"] = calibration.covariance
    if check is not None:
        content["check_point"] = {"radar_m": check.radar_m[None, :], "pixel_px": check.pixel_px[None, :]}
    buffer = io.BytesIO()
    savemat(buffer, content, long_field_names=True, oned_as="row")  # type: ignore[arg-type]
    title = f"MATLAB 5.0 MAT-file, cocalib, {EQUATION}".ljust(_MAT_TEXT_BYTES).encode()
    return title[:_MAT_TEXT_BYTES] + buffer.getvalue()[_MAT_TEXT_BYTES:]  # SciPy writes today's date there


def read_matlab(data: bytes, source: str) -> ImportedCalibration:
    """Read a mat file that holds camera_from_radar as a struct with A, or as a 4x4 matrix.

    Raises:
        InputError: it holds neither, or is not a mat file of level 5.
    """
    content = load_mat(data, source=source)
    arrays: dict[str, Any] = {}
    matrix = content.get("camera_from_radar")
    if matrix is not None:
        arrays["camera_from_radar"] = matrix.get("A") if isinstance(matrix, dict) else matrix
    frames, check, camera = (content.get(key) for key in ("frames", "check_point", "camera"))
    if isinstance(frames, dict):
        arrays |= {"radar_frame": frames.get("radar", ""), "camera_frame": frames.get("camera", "")}
    if isinstance(check, dict):
        arrays |= {f"check_point_{key}": value for key, value in check.items()}
    if isinstance(camera, dict) and {"K", "Distortion", "ImageSize", "Model"} <= set(camera):
        arrays |= {"K": camera["K"], "D": np.ravel(camera["Distortion"]), "camera_model": camera["Model"]}
        arrays["image_size_px"] = np.ravel(camera["ImageSize"])[::-1]
    return _from_arrays(arrays, "matlab", source=source)
