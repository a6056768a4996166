"""A camera to and from the object that our files carry it in."""

from typing import Any

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.own.documents import CameraDocument

__all__ = ["camera_document", "camera_of", "refuse_skew"]


def refuse_skew(camera: Camera, whose: str) -> None:
    """Refuse a camera whose pixel axes are not at right angles, for a format whose readers would leave that out.

    Args:
        camera: what is to be written.
        whose: whose model it is, to stand before "no skew", for example "COLMAP's models have".

    Raises:
        InputError: it has skew.
    """
    if camera.matrix_px[0, 1] != 0.0:
        raise InputError(f"{whose} no skew, this camera has; export with --to json, matlab or numpy instead")


def camera_document(camera: Camera) -> CameraDocument:
    """Return the object that carries a camera."""
    matrix: Any = tuple(tuple(row) for row in camera.matrix_px.tolist())
    return CameraDocument(camera.model, camera.width_px, camera.height_px, matrix, camera.distortion.tolist())


def camera_of(document: CameraDocument, *, source: str, place: str = "camera") -> Camera:
    """Return the camera an object carries.

    Raises:
        InputError: a camera cannot be like that.
    """
    try:
        return Camera(
            document.model,
            document.width_px,
            document.height_px,
            document.matrix_px,  # type: ignore[arg-type]
            document.distortion,  # type: ignore[arg-type]
        )
    except ValueError as error:
        raise InputError(f"{source}: {place}: {error}; correct it or calibrate the camera again") from None
