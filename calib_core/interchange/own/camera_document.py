"""Convert a camera to and from its document in our files."""

from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType

from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.interchange.own.documents import CameraCovarianceDocument, CameraDocument


def refuse_skew(camera: Camera, whose: str) -> None:
    """Refuse a camera with skew, for a format whose readers would ignore it.

    Args:
        camera: the camera to be written.
        whose: the start of the message, before "no skew", such as "COLMAP's models have".

    Raises:
        InputError: it has skew.
    """
    if camera.matrix_px[0, 1] != 0.0:
        raise InputError(f"{whose} no skew, but this camera has; export with --to json or matlab instead")


def camera_document(camera: Camera) -> CameraDocument:
    """Return the document of a camera."""
    matrix: Any = tuple(tuple(row) for row in camera.matrix_px.tolist())
    size_px = camera.width_px, camera.height_px
    covariance = _covariance_document(camera.covariance)
    return CameraDocument(camera.model, *size_px, matrix, camera.distortion.tolist(), covariance)


def camera_of(document: CameraDocument, *, source: str, place: str = "camera") -> Camera:
    """Return the camera in a document.

    Raises:
        InputError: a parameter is invalid.
    """
    try:
        return Camera(
            document.model,
            document.width_px,
            document.height_px,
            document.matrix_px,  # type: ignore[arg-type]
            document.distortion,  # type: ignore[arg-type]
            _covariance_of(document.covariance),
        )
    except ValueError as error:
        raise InputError(f"{source}: {place}: {error}; correct it or calibrate the camera again") from None


def _covariance_document(covariance: CameraCovariance | None) -> CameraCovarianceDocument | UnsetType:
    if covariance is None:
        return UNSET
    return CameraCovarianceDocument(list(covariance.order), covariance.matrix.tolist())


def _covariance_of(document: CameraCovarianceDocument | UnsetType) -> CameraCovariance | None:
    """Return the covariance in a document; raises ValueError if it cannot be one."""
    if isinstance(document, UnsetType):
        return None
    count = len(document.order)
    if [len(row) for row in document.matrix] != [count] * count:
        raise ValueError(
            f"the covariance of the intrinsics names {count} parameters, its matrix needs as many rows and columns"
        )
    return CameraCovariance(tuple(document.order), np.array(document.matrix, dtype=np.float64).reshape(count, count))
