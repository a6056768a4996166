"""Add the camera that a file of another tool contains to what was read from it; it may lack the image size."""

from dataclasses import replace

import numpy as np

from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.imported import ImportedCalibration


def with_camera(found: ImportedCalibration, camera: FoundCamera | None, *, source: str) -> ImportedCalibration:
    """Return what was read with its camera; without an image size the camera is completed later, by `camera_for`.

    Raises:
        InputError: a parameter is invalid.
    """
    if camera is None:
        return found
    if camera.size_px is not None:
        return replace(found, camera=camera.camera(image_size_px=None, source=source))
    model, distortion = camera.lens(source=source)
    return replace(
        found, matrix_px=np.reshape(camera.matrix_px, (3, 3)), lens_model=model, distortion=np.array(distortion)
    )


def pinhole_matrix(fx: float, fy: float, cx: float, cy: float) -> tuple[float, ...]:
    """Return the camera matrix, row by row, for focal lengths and principal point [px]."""
    return (fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
