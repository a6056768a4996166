"""OpenCV's FileStorage in its three syntaxes, with the keys of OpenCV's own calibration sample."""

import json

import numpy as np

from calib_core.camera import Camera
from calib_core.file_tag import TAG
from calib_core.interchange.cameras.camera_format import HASH_TAG, CameraFormat, refuse_skew
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.lens_models.registry import WrittenLens, written_lens


def file_storage_matrix(key: str, matrix: np.ndarray) -> str:
    """Write a matrix as FileStorage does in YAML."""
    rows, columns = matrix.shape
    data = numbers_text(matrix.ravel())
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"


def _lens(camera: Camera) -> WrittenLens:
    refuse_skew(camera, "OpenCV's camera models have")
    return written_lens(camera.lens, camera.distortion, "opencv")


def _write_yaml(camera: Camera, name: str) -> str:
    lens = _lens(camera)
    return (
        f"%YAML:1.0\n---\ncamera_name: {quoted(name)}\n"
        f"image_width: {camera.width_px}\nimage_height: {camera.height_px}\n"
        f"distortion_model: {quoted(lens.name)}\n"
        + file_storage_matrix("camera_matrix", camera.matrix_px)
        + file_storage_matrix("distortion_coefficients", np.array([lens.coefficients]))
    )


def _write_xml(camera: Camera, _name: str) -> str:
    lens = _lens(camera)
    matrices = (("camera_matrix", camera.matrix_px), ("distortion_coefficients", np.array([lens.coefficients])))
    return (
        '<?xml version="1.0"?>\n<opencv_storage>\n'
        f"<image_width>{camera.width_px}</image_width>\n<image_height>{camera.height_px}</image_height>\n"
        f"<distortion_model>{lens.name}</distortion_model>\n"
        + "".join(
            f'<{key} type_id="opencv-matrix">\n  <rows>{matrix.shape[0]}</rows>\n  <cols>{matrix.shape[1]}</cols>\n'
            f"  <dt>d</dt>\n  <data>\n    {numbers_text(matrix.ravel(), ' ')}</data></{key}>\n"
            for key, matrix in matrices
        )
        + "</opencv_storage>\n"
    )


def _write_json(camera: Camera, name: str) -> str:
    lens = _lens(camera)
    matrices = {"camera_matrix": camera.matrix_px, "distortion_coefficients": np.array([lens.coefficients])}
    content = {
        "comment": TAG,
        "camera_name": name,
        "image_width": camera.width_px,
        "image_height": camera.height_px,
        "distortion_model": lens.name,
    } | {
        key: {
            "type_id": "opencv-matrix",
            "rows": matrix.shape[0],
            "cols": matrix.shape[1],
            "dt": "d",
            "data": matrix.ravel().tolist(),
        }
        for key, matrix in matrices.items()
    }
    return json.dumps(content, indent=4) + "\n"


OPENCV_YAML = CameraFormat("opencv", "OpenCV FileStorage YAML", ".yml", _write_yaml, ending=HASH_TAG)
OPENCV_XML = CameraFormat("opencv-xml", "OpenCV FileStorage XML", ".xml", _write_xml, ending=f"<!-- {TAG} -->\n")
OPENCV_JSON = CameraFormat("opencv-json", "OpenCV FileStorage JSON", ".json", _write_json)
