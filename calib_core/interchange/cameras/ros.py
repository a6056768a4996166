"""ROS camera_info YAML, as camera_calibration writes it. The covariance is in keys of our own, which ROS ignores."""

import numpy as np

from calib_core.camera import Camera
from calib_core.interchange.cameras.camera_format import HASH_TAG, CameraFormat, refuse_skew
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.lens_models.registry import written_lens


def camera_info_text(camera: Camera, name: str = "camera") -> str:
    """Write ROS camera_info YAML (as camera_calibration does), which image pipelines and `--camera` read.

    Raises:
        InputError: ROS has no name for this lens.
    """
    lens = written_lens(camera.lens, camera.distortion, "camera_info")
    projection = np.hstack([camera.matrix_px, np.zeros((3, 1))])
    return "\n".join(
        [
            f"image_width: {camera.width_px}",
            f"image_height: {camera.height_px}",
            f"camera_name: {quoted(name)}",
            *_matrix("camera_matrix", camera.matrix_px),
            f"distortion_model: {lens.name}",
            *_matrix("distortion_coefficients", np.array([lens.coefficients])),
            *_matrix("rectification_matrix", np.eye(3)),
            *_matrix("projection_matrix", projection),
            *_covariance(camera),
            "",
        ]
    )


def _matrix(key: str, matrix: np.ndarray) -> list[str]:
    rows, columns = matrix.shape
    return [f"{key}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{numbers_text(matrix.ravel())}]"]


def _covariance(camera: Camera) -> list[str]:
    """Write the covariance; coefficients that only the file's lens model has are exact zeros and stay out."""
    if camera.covariance is None:
        return []
    names = ", ".join(camera.covariance.order)
    return [f"camera_covariance_order: [{names}]", *_matrix("camera_covariance", camera.covariance.matrix)]


def _write(camera: Camera, name: str) -> str:
    refuse_skew(camera, "ROS's camera models have")
    return camera_info_text(camera, name)


ROS = CameraFormat("ros", ".yaml", _write, ending=HASH_TAG)
