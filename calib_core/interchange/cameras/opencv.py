"""OpenCV's FileStorage with the keys of its calibration sample, and the same arrays as Python saves them, in npz."""

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import HASH_TAG, CameraFormat, FoundCamera, OwnSyntax, refuse_skew
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.syntax.npy_file import load_npz
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.interchange.syntax.zip_archives import unpack
from calib_core.lens_models.registry import written_lens


def file_storage_matrix(key: str, matrix: np.ndarray) -> str:
    """Write a matrix as FileStorage does in YAML."""
    rows, columns = matrix.shape
    data = numbers_text(matrix.ravel())
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"


def _write_yaml(camera: Camera, name: str) -> str:
    refuse_skew(camera, "OpenCV's camera models have")
    lens = written_lens(camera.lens, camera.distortion, "opencv")
    return (
        f"%YAML:1.0\n---\ncamera_name: {quoted(name)}\n"
        f"image_width: {camera.width_px}\nimage_height: {camera.height_px}\n"
        f"distortion_model: {quoted(lens.name)}\n"
        + file_storage_matrix("camera_matrix", camera.matrix_px)
        + file_storage_matrix("distortion_coefficients", np.array([lens.coefficients]))
    )


OPENCV_YAML = CameraFormat("opencv", ".yml", _write_yaml, ending=HASH_TAG)


def _read_npz(content: str | bytes, source: str) -> tuple[FoundCamera, ...]:
    arrays = load_npz(unpack(content, source=source) if isinstance(content, bytes) else {}, source=source)
    values = {name: array.tolist() for name, array in arrays.items() if array is not None}
    cameras = find_cameras(values, source=source)
    if not cameras:
        raise InputError(f"{source}: no array camera_matrix, mtx or K in it; found {', '.join(arrays)}")
    return cameras


OPENCV_NPZ = OwnSyntax(lambda data: isinstance(data, bytes) and data.startswith(b"PK") and b".npy" in data, _read_npz)
