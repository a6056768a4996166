"""calib.json of direct_visual_lidar_calibration: the camera's pose in the frame of the points, and the camera."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera, with_camera
from calib_core.interchange.cameras.fields import floats, kalibr_camera
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.syntax.content import Content

_KEY = "T_lidar_camera"
_MODELS = ("plumb_bob", "rational_polynomial", "fisheye", "equidistant")


def _recognizes(content: Content) -> bool:
    results = content.json_mapping.get("results")
    return isinstance(results, Mapping) and any(_KEY in str(key) for key in results)


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the result and the camera.

    Raises:
        InputError: it contains an initial guess only, or a number is missing.
    """
    results = content.mapping["results"]
    if _KEY not in results:
        raise InputError(
            f"{source}: results: contains {', '.join(map(str, results))}, which are initial guesses; run calibrate and give "
            f"the file that has {_KEY}"
        )
    numbers = floats(results[_KEY], source=source, place=f"results.{_KEY}", length=7)
    meta = content.mapping.get("meta")
    topic = str(meta.get("points_topic") or "") if isinstance(meta, Mapping) else ""
    points = f"the points of {topic}" if topic else "the points it was made with"
    camera, notes = _camera(content.mapping.get("camera"), source=source)
    calibration = ImportedCalibration(
        "koide3",
        WrittenPose("quaternion_xyzw", np.array(numbers[3:]), np.array(numbers[:3]), "radar_from_camera"),
        assumptions=(f"assumed that {points} are the radar's, x forward, y left, z up",),
        notes=notes,
    ).checked(source)
    return with_camera(calibration, camera, source=source)


def _camera(block: Any, *, source: str) -> tuple[FoundCamera | None, tuple[str, ...]]:
    """Return the camera and a note; no camera if there is none or its model is not one of ours."""
    if not isinstance(block, Mapping) or "intrinsics" not in block:
        return None, ()
    model = str(block.get("camera_model") or "")
    if model not in _MODELS:
        return None, (f"the camera model {model!r} is not supported and was left out",)
    pinhole = {**block, "camera_model": "pinhole", "distortion_model": model}
    return kalibr_camera("camera", pinhole, source=source), ()


KOIDE3 = Reads(_recognizes, _read)
