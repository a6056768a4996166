"""Kalibr's camera chain."""

from calib_core.camera import Camera
from calib_core.interchange.cameras.camera_format import HASH_TAG, CameraFormat, refuse_skew
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.lens_models.registry import WrittenLens, written_lens

_NO_DISTORTION = "none"
_NO_DISTORTION_AS_LOADED = WrittenLens("radtan", (0.0, 0.0, 0.0, 0.0))
"""Kalibr names the model "none", but its reader makes no pinhole camera of it."""


def kalibr_camera_text(camera: Camera, *, image_topic: str = "") -> str:
    """Write the block of one camera of a chain.

    Raises:
        InputError: Kalibr has no model for this lens.
    """
    refuse_skew(camera, "Kalibr's pinhole model has")
    lens = written_lens(camera.lens, camera.distortion, "kalibr")
    if lens.name == _NO_DISTORTION:
        lens = _NO_DISTORTION_AS_LOADED
    k = camera.matrix_px
    return (
        "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n"
        f"  intrinsics: [{numbers_text((k[0, 0], k[1, 1], k[0, 2], k[1, 2]))}]\n"
        f"  distortion_model: {lens.name}\n  distortion_coeffs: [{numbers_text(lens.coefficients)}]\n"
        f"  resolution: [{camera.width_px}, {camera.height_px}]\n"
        f"  rostopic: {quoted(image_topic)}\n"
    )


def _write(camera: Camera, _name: str) -> str:
    return kalibr_camera_text(camera)


KALIBR_CHAIN = CameraFormat("kalibr", ".yaml", _write, ending=HASH_TAG)
