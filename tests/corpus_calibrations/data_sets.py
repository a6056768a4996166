"""Calibrations as data sets and vehicle rigs store them."""

import json
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.corpus_calibrations.truth import (
    CAMERA_FROM_RADAR,
    LINK_FROM_OPTICAL,
    RADAR_FROM_CAMERA,
    SIZE,
    Calibration,
    K,
    inverse,
    posed,
    quaternion,
    rpy,
    words,
)

KITTI = ".12e"
RECTIFYING = posed(Rotation.from_euler("xyz", [0.4, -0.9, 0.2], degrees=True).as_matrix(), (0, 0, 0))
CAMERA2_FROM_CAMERA0 = posed(np.eye(3), (0.0598, -0.0003, 0.0027))
PROJECTION = np.hstack([K, K @ CAMERA2_FROM_CAMERA0[:3, 3:]])
CAMERA0_FROM_RADAR = inverse(CAMERA2_FROM_CAMERA0) @ CAMERA_FROM_RADAR
EGO_FROM_RADAR = posed(Rotation.from_euler("xyz", [0, 0, 2], degrees=True).as_matrix(), (3.4, 0.0, 0.5))


def _line(key: str, numbers: Any) -> str:
    return f"{key}: {words(numbers, ' ', KITTI)}\n"


def _kitti_object() -> str:
    tr = (inverse(RECTIFYING) @ CAMERA0_FROM_RADAR)[:3]
    return (
        "".join(_line(f"P{index}", PROJECTION if index == 2 else np.eye(3, 4)) for index in range(4))
        + _line("R0_rect", RECTIFYING[:3, :3])
        + _line("Tr_velo_to_cam", tr)
        + _line("Tr_imu_to_velo", np.eye(3, 4))
        + "\n"
    )


def _view_of_delft() -> str:
    plain = np.hstack([K, np.zeros((3, 1))])
    return (
        "".join(_line(f"P{index}", plain) for index in range(4))
        + _line("R0_rect", np.eye(3))
        + _line("Tr_velo_to_cam", CAMERA_FROM_RADAR[:3])
        + _line("Tr_imu_to_velo", np.eye(3, 4))
    )


def _raw(camera0_from_radar: np.ndarray) -> str:
    return (
        "calib_time: 15-Mar-2012 11:37:16\n"
        + _line("R", camera0_from_radar[:3, :3])
        + _line("T", camera0_from_radar[:3, 3])
        + "delta_f: 0.000000e+00 0.000000e+00\ndelta_c: 0.000000e+00 0.000000e+00\n"
    )


def _cameras() -> str:
    rows = ["calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"]
    for index in range(4):
        rows += [
            _line(f"S_0{index}", [1392, 512]),
            _line(f"K_0{index}", np.diag([980.0, 980, 1])),
            _line(f"D_0{index}", [-0.37, 0.2, 0.001, 0.0005, -0.07]),
            _line(f"R_0{index}", np.eye(3)),
            _line(f"T_0{index}", [0, 0, 0]),
            _line(f"S_rect_0{index}", SIZE),
            _line(f"R_rect_0{index}", RECTIFYING[:3, :3]),
            _line(f"P_rect_0{index}", PROJECTION if index == 2 else np.eye(3, 4)),
        ]
    return "".join(rows)


def _odometry() -> str:
    projections = "".join(_line(f"P{index}", PROJECTION if index == 2 else np.eye(3, 4)) for index in range(4))
    return projections + _line("Tr", CAMERA0_FROM_RADAR[:3])


def _record(token: str, pose: np.ndarray, intrinsic: list[list[float]]) -> dict[str, Any]:
    x, y, z, w = quaternion(pose)
    return {
        "token": token * 8,
        "sensor_token": token[::-1] * 8,
        "translation": pose[:3, 3].tolist(),
        "rotation": [w, x, y, z],
        "camera_intrinsic": intrinsic,
    }


def _nuscenes() -> list[dict[str, Any]]:
    return [
        _record("f4d2", EGO_FROM_RADAR, []),
        _record("1d31", EGO_FROM_RADAR @ RADAR_FROM_CAMERA, K.tolist()),
    ]


def _nuscenes_folder() -> tuple[str, dict[str, str | bytes]]:
    """Return a table of several sensors and, beside it, the table that names them."""
    back = posed(Rotation.from_euler("z", 180, degrees=True).as_matrix(), (-0.8, 0, 0.5))
    records = [*_nuscenes(), _record("aa11", back, []), _record("bb22", back @ LINK_FROM_OPTICAL, K.tolist())]
    channels = ["RADAR_FRONT", "CAM_FRONT", "RADAR_BACK", "CAM_BACK"]
    sensors = [
        {
            "token": record["sensor_token"],
            "channel": channel,
            "modality": "radar" if "RADAR" in channel else "camera",
        }
        for record, channel in zip(records, channels, strict=True)
    ]
    return json.dumps(records, indent=0), {"sensor.json": json.dumps(sensors, indent=0)}


def _k_radar_camera() -> str:
    roll, pitch, yaw = 89.6, 0.6, 88.6
    numbers = {
        **{"fx": K[0, 0], "fy": K[1, 1], "img_size_h": SIZE[1], "img_size_w": SIZE[0]},
        **{"k1": -0.0289, "k2": 0.0006, "k3": 0.004, "k4": -0.005, "k5": 0.0},
        **{"pitch_ldr2cam": pitch, "px": K[0, 2], "py": K[1, 2], "roll_ldr2cam": roll, "x_ldr2cam": 0.18},
        **{"y_ldr2cam": -0.13, "yaw_ldr2cam": yaw, "z_ldr2cam": -3.1e-17},
    }
    return "".join(f"{key}: {value}\n" for key, value in numbers.items())


def _rig(radar: dict[str, Any], camera: dict[str, Any]) -> str:
    sensors = [
        {"name": "radar:front:center", "protocol": "radar.can", "parameter": "", "properties": {}, **radar},
        {"name": "camera:front:wide:120fov", "protocol": "camera.gmsl", "parameter": "", "properties": {}, **camera},
    ]
    return json.dumps({"rig": {"sensors": sensors, "vehicle": {"valid": True}}, "version": 7})


def _nominal(matrix: np.ndarray) -> dict[str, Any]:
    return {"nominalSensor2Rig_FLU": {"roll-pitch-yaw": np.degrees(rpy(matrix)).tolist(), "t": matrix[:3, 3].tolist()}}


RIG_FROM_LINK = EGO_FROM_RADAR @ RADAR_FROM_CAMERA @ inverse(LINK_FROM_OPTICAL)


def _corrected() -> str:
    turn_deg, shift_m = [0.3, -0.2, 0.9], np.array([0.02, -0.01, 0.03])
    turned = RIG_FROM_LINK[:3, :3] @ Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix().T
    nominal = posed(turned, RIG_FROM_LINK[:3, 3] - shift_m)
    correction = {"correction_sensor_R_FLU": {"roll-pitch-yaw": turn_deg}, "correction_rig_T": shift_m.tolist()}
    return _rig(_nominal(EGO_FROM_RADAR), {**_nominal(nominal), **correction})


NUSCENES, BESIDE_NUSCENES = _nuscenes_folder()
RAW = _raw(inverse(RECTIFYING) @ CAMERA0_FROM_RADAR)

DATA_SETS = (
    Calibration("KITTI object", "000001.txt", _kitti_object(), holds_camera="matrix"),
    Calibration("View-of-Delft", "00001.txt", _view_of_delft(), holds_camera="matrix"),
    Calibration(
        "KITTI raw",
        "calib_velo_to_cam.txt",
        RAW,
        beside={"calib_cam_to_cam.txt": _cameras()},
        holds_camera="matrix size",
    ),
    Calibration("KITTI raw, camera 0", "calib_velo_to_cam.txt", _raw(CAMERA_FROM_RADAR)),
    Calibration("KITTI raw, cameras", "calib_cam_to_cam.txt", _cameras(), refused="calib_velo_to_cam.txt"),
    Calibration("KITTI odometry", "calib.txt", _odometry(), holds_camera="matrix"),
    Calibration("nuScenes, two records", "calibrated_sensor.json", json.dumps(_nuscenes())),
    Calibration(
        "nuScenes, table",
        "calibrated_sensor.json",
        NUSCENES,
        beside=BESIDE_NUSCENES,
        folder=True,
        frames=("RADAR_FRONT", "CAM_FRONT"),
    ),
    Calibration("K-Radar camera", "cam_front0.yml", _k_radar_camera(), refused="lidar"),
    Calibration("K-Radar offset", "calib_radar_lidar.txt", "frame difference,x,y\n32,-2.54,0.3\n", refused="height"),
    Calibration("DriveWorks rig", "rig.json", _rig(_nominal(EGO_FROM_RADAR), _nominal(RIG_FROM_LINK))),
    Calibration("DriveWorks rig, corrected", "rig.json", _corrected()),
)
