"""calib.json of direct_visual_lidar_calibration: the camera's pose in the frame of the points, and the camera."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.cameras.fields import lens_model_named
from calib_core.interchange.cameras.numbers import floats
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.foreign.found_lens import pinhole_matrix, with_camera
from calib_core.interchange.formats.statement import (
    STATEMENT_KEY,
    stated_check_point,
    stated_frames,
    stated_lines,
    statement,
)
from calib_core.interchange.imported import ImportedCalibration, WrittenPose
from calib_core.interchange.own.camera_document import refuse_skew
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.json_text import json_text
from calib_core.lens_models.naming import written_lens

_NUMBERS = "T_lidar_camera: pose of the camera (optical) in the radar, x y z qx qy qz qw"
_NOTES = ("the radar takes the place of the lidar; image_size is our own key, the tool has none",)
_KEY = "T_lidar_camera"
_MODELS = ("plumb_bob", "rational_polynomial", "fisheye", "equidistant")


def _write(file: CalibrationFile) -> str:
    """Write calib.json with the radar as the lidar.

    Raises:
        InputError: the camera has skew, or the tool has no name for its lens.
    """
    camera, provenance = file.calibration.camera, file.provenance
    refuse_skew(camera, "the camera models of direct_visual_lidar_calibration have")
    lens = written_lens(camera.lens, camera.distortion, "camera_info")
    k = camera.matrix_px
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation)
    return json_text(
        {
            "camera": {
                "camera_model": lens.name,
                "distortion_coeffs": list(lens.coefficients),
                "intrinsics": [float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])],
                "image_size": [camera.width_px, camera.height_px],
            },
            "meta": {
                "bag_names": [],
                "camera_info_topic": provenance.camera_info_topic or "",
                "data_path": "",
                "image_topic": provenance.image_topic or "",
                "intensity_channel": "",
                "points_topic": provenance.radar_topic or "",
            },
            "results": {
                _KEY: [value + 0.0 for value in (*radar_from_camera.translation_m.tolist(), *quaternion.tolist())]
            },
            STATEMENT_KEY: list(statement(file, _NUMBERS)),
        }
    )


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
    text = stated_lines(content.mapping.get(STATEMENT_KEY))
    frames = stated_frames(text)
    meta = content.mapping.get("meta")
    topic = str(meta.get("points_topic") or "") if isinstance(meta, Mapping) else ""
    points = f"the points of {topic}" if topic else "the points it was made with"
    camera, notes = _camera(content.mapping.get("camera"), source=source)
    found = ImportedCalibration(
        "koide3",
        WrittenPose("quaternion_xyzw", np.array(numbers[3:]), np.array(numbers[:3]), "radar_from_camera"),
        frames=frames,
        check_point=stated_check_point(text),
        assumptions=() if frames else (f"assumed that {points} are the radar's, x forward, y left, z up",),
        notes=notes,
    ).checked(source)
    return with_camera(found, camera, source=source)


def _camera(block: Any, *, source: str) -> tuple[FoundCamera | None, tuple[str, ...]]:
    """Return the camera and a note; no camera if there is none or its model is not one of ours."""
    if not isinstance(block, Mapping) or "intrinsics" not in block:
        return None, ()
    model = str(block.get("camera_model") or "")
    if model not in _MODELS:
        return None, (f"the camera model {model!r} is not supported and was left out",)
    intrinsics = floats(block["intrinsics"], source=source, place="camera.intrinsics", length=4)
    size = floats(block.get("image_size", ()), source=source, place="camera.image_size")
    camera = FoundCamera(
        name="camera",
        model=lens_model_named(model, source=source),
        matrix_px=pinhole_matrix(*intrinsics),
        distortion=floats(block.get("distortion_coeffs", ()), source=source, place="camera.distortion_coeffs"),
        size_px=(int(size[0]), int(size[1])) if len(size) == 2 else None,
    )
    return camera, ()


KOIDE3 = Format(
    name="koide3",
    title="direct_visual_lidar_calibration",
    used_in="Calibration tools and arrays",
    also="ROS 2 lidar camera koide",
    numbers=_NUMBERS,
    file_name="calib.json",
    camera="lens",
    comment="keys",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
