"""SensorsCalibration of PJLab (OpenCalib): one JSON per pair of sensors, a 4x4 matrix from the sensor to its target."""

from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.statement import POSE_ONLY, STATEMENT_KEY, statement
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.interchange.trees.pjlab import recognizes_extrinsics
from calib_core.interchange.trees.posed_in_tree import read_joints

_NUMBERS = "sensor_calib.data carries radar points into the camera (p_target = matrix p_sensor)"
_CV_64F = 6


def _write(file: CalibrationFile) -> str:
    """Write the extrinsic of the radar to the camera; the statement is inside, because readers take the first key."""
    frames = file.frames
    entry = {
        "sensor_name": frames.radar,
        "target_sensor_name": frames.camera,
        "device_type": "relational",
        "param_type": "extrinsic",
        "param": {
            "time_lag": 0,
            "sensor_calib": {
                "rows": 4,
                "cols": 4,
                "type": _CV_64F,
                "continuous": True,
                "data": (file.calibration.camera_from_radar.as_matrix() + 0.0).tolist(),
            },
        },
        STATEMENT_KEY: list(statement(file, _NUMBERS)),
    }
    return json_text({f"{frames.radar}-to-{frames.camera}-extrinsic": entry})


PJLAB = Format(
    name="pjlab",
    title="PJLab SensorsCalibration extrinsic",
    used_in="Calibration tools and arrays",
    also="OpenCalib lidar radar camera",
    numbers=_NUMBERS,
    file_name="radar-to-camera-extrinsic.json",
    camera="none",
    pose_for="raw",
    comment="keys",
    notes=(POSE_ONLY,),
    write=_write,
    reads=Reads(recognizes_extrinsics, read_joints),
)
