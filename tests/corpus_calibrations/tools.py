"""What calibration tools, OpenCV programs and labelling services store."""

import io
import json
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from tests.corpus_calibrations.truth import (
    CAMERA_FROM_RADAR,
    DISTORTION,
    RADAR_FROM_CAMERA,
    SIZE,
    Calibration,
    K,
    inverse,
    posed,
    quaternion,
    words,
)

WORLD_FROM_DEVICE = posed(Rotation.from_euler("xyz", [2, -1, 130], degrees=True).as_matrix(), (512.0, -90.5, 12.25))
VEHICLE_FROM_RADAR = posed(Rotation.from_euler("xyz", [0, 1, -4], degrees=True).as_matrix(), (3.6, 0.0, 0.55))
OPENGL = np.diag([1.0, -1, -1, 1])
K1, K2, P1, P2, K3 = DISTORTION


def _kalibr_camera(**more: Any) -> str:
    rows = {
        "cam_overlaps": [],
        "camera_model": "pinhole",
        "distortion_coeffs": list(DISTORTION[:4]),
        "distortion_model": "radtan",
        "intrinsics": [K[0, 0], K[1, 1], K[0, 2], K[1, 2]],
        "resolution": list(SIZE),
        "rostopic": "/camera/image_raw",
        **more,
    }
    return "cam0:\n" + "".join(
        f"  {key}:\n" + "".join(f"  - {json.dumps(row)}\n" for row in value)
        if key.startswith("T_")
        else f"  {key}: {json.dumps(value)}\n"
        for key, value in rows.items()
    )


def _file_storage(suffix: str) -> str:
    storage = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("M1", K)
    storage.write("D1", np.array([DISTORTION]))
    storage.write("R", CAMERA_FROM_RADAR[:3, :3])
    storage.write("T", CAMERA_FROM_RADAR[:3, 3:])
    return str(storage.releaseAndGetString())


def _opencv_matrix(key: str, matrix: np.ndarray) -> str:
    data = ",\n       ".join(words(row, ", ", ".16e") for row in np.atleast_2d(matrix))
    rows, columns = np.atleast_2d(matrix).shape
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"


def _autoware_ai(extrinsic: np.ndarray) -> str:
    return (
        "%YAML:1.0\n---\n"
        + _opencv_matrix("CameraExtrinsicMat", extrinsic)
        + _opencv_matrix("CameraMat", K)
        + _opencv_matrix("DistCoeff", np.array([DISTORTION]))
        + f"ImageSize: [ {SIZE[0]}, {SIZE[1]} ]\nReprojectionError: 0\nDistModel: plumb_bob\n"
    )


def _pjlab(sensor: str, target: str, matrix: np.ndarray) -> str:
    calib = {"rows": 4, "cols": 4, "type": 6, "continuous": True, "data": matrix.tolist()}
    entry = {
        "sensor_name": sensor,
        "target_sensor_name": target,
        "device_type": "relational",
        "param_type": "extrinsic",
        "param": {"time_lag": 0, "sensor_calib": calib},
    }
    return json.dumps({f"{sensor}-to-{target}-extrinsic": entry}, indent=4)


def _koide3(**results: list[float]) -> str:
    camera = {
        "camera_model": "plumb_bob",
        "distortion_coeffs": list(DISTORTION),
        "intrinsics": [K[0, 0], K[1, 1], K[0, 2], K[1, 2]],
    }
    meta = {
        "bag_names": ["rosbag2_2023_03_09-13_42_46"],
        "camera_info_topic": "/camera_info",
        "data_path": "drive",
        "image_topic": "/image",
        "intensity_channel": "intensity",
        "points_topic": "/radar/points",
    }
    return json.dumps({"camera": camera, "meta": meta, "results": results}, indent=2)


POSE_7 = [*RADAR_FROM_CAMERA[:3, 3].tolist(), *quaternion(RADAR_FROM_CAMERA)]


def _openlabel(systems: dict[str, Any]) -> str:
    pinhole = {
        "camera_matrix_3x4": np.hstack([K, np.zeros((3, 1))]).ravel().tolist(),
        "distortion_coeffs_1xN": list(DISTORTION),
        "width_px": SIZE[0],
        "height_px": SIZE[1],
    }
    streams = {
        "radar_1": {"type": "radar", "description": "front"},
        "CAM_FRONT": {"type": "camera", "stream_properties": {"intrinsics_pinhole": pinhole}},
    }
    inner = {"metadata": {"schema_version": "1.0.0"}, "coordinate_systems": systems, "streams": streams}
    return json.dumps({"openlabel": inner})


def _openlabel_by_matrix(pose: np.ndarray) -> str:
    return _openlabel(
        {
            "radar_1": {"type": "sensor_cs", "parent": "", "children": ["CAM_FRONT"]},
            "CAM_FRONT": {
                "type": "sensor_cs",
                "parent": "radar_1",
                "children": [],
                "pose_wrt_parent": {"matrix4x4": pose.ravel().tolist()},
            },
        }
    )


def _openlabel_in_a_vehicle() -> str:
    def posed_in_vehicle(pose: np.ndarray) -> dict[str, Any]:
        inner = {"quaternion": quaternion(pose), "translation": pose[:3, 3].tolist()}
        return {"type": "sensor_cs", "parent": "vehicle-iso8855", "children": [], "pose_wrt_parent": inner}

    return _openlabel(
        {
            "odom": {"type": "scene_cs", "parent": "", "children": ["vehicle-iso8855"]},
            "vehicle-iso8855": {"type": "local_cs", "parent": "odom", "children": ["radar_1", "CAM_FRONT"]},
            "radar_1": posed_in_vehicle(VEHICLE_FROM_RADAR),
            "CAM_FRONT": posed_in_vehicle(VEHICLE_FROM_RADAR @ RADAR_FROM_CAMERA),
        }
    )


def _segments(pose: np.ndarray, **convention: str) -> str:
    image = {
        "name": "front",
        "url": "https://example.com/image.jpg",
        "row": 0,
        "col": 0,
        "intrinsics": {"intrinsic_matrix": K.tolist()},
        "extrinsics": {
            "translation": dict(zip("xyz", pose[:3, 3].tolist(), strict=True)),
            "rotation": dict(zip(("qx", "qy", "qz", "qw"), quaternion(pose), strict=True)),
        },
        "distortion": {"model": "brown-conrady", "coefficients": {"k1": K1, "k2": K2, "k3": K3, "p1": P1, "p2": P2}},
        **convention,
    }
    cloud = {"url": "https://example.com/cloud.pcd", "type": "pcd"}
    ego = {"position": {"x": 1, "y": 2, "z": 3}, "heading": {"qx": 0, "qy": 0, "qz": 0, "qw": 1}}
    return json.dumps({"pcd": cloud, "images": [image], "name": "frame_00001", "ego_pose": ego})


def _npy(matrix: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, matrix)
    return stream.getvalue()


def _npz() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, R=CAMERA_FROM_RADAR[:3, :3], t=CAMERA_FROM_RADAR[:3, 3], K=K, D=np.array(DISTORTION))
    return stream.getvalue()


def _vectors() -> str:
    rvec = Rotation.from_matrix(CAMERA_FROM_RADAR[:3, :3]).as_rotvec()
    return json.dumps({"rvec": rvec.tolist(), "tvec": CAMERA_FROM_RADAR[:3, 3].tolist(), "rms_px": 1.3})


def _rotation_and_translation() -> str:
    pose = {"R": CAMERA_FROM_RADAR[:3, :3].tolist(), "t": CAMERA_FROM_RADAR[:3, 3].tolist()}
    return json.dumps({"extrinsics": pose, "intrinsics": {"K": K.tolist()}})


IMU = Rotation.from_euler("z", 90, degrees=True).as_matrix()

TOOLS = (
    Calibration(
        "Kalibr with T_cam_radar",
        "camchain.yaml",
        _kalibr_camera(T_cam_radar=CAMERA_FROM_RADAR.tolist()),
        holds_camera="lens size",
    ),
    Calibration(
        "Kalibr camchain-imucam",
        "camchain-imucam.yaml",
        _kalibr_camera(T_cam_imu=posed(IMU, (0.1, 0, 0)).tolist(), timeshift_cam_imu=0.002),
        refused="IMU",
    ),
    Calibration(
        "Kalibr camchain",
        "camchain.yaml",
        _kalibr_camera() + _kalibr_camera(T_cn_cnm1=posed(np.eye(3), (-0.12, 0, 0)).tolist()).replace("cam0", "cam1"),
        refused="T_cn_cnm1",
    ),
    Calibration("OpenCV YAML", "extrinsics.yml", _file_storage(".yml")),
    Calibration("OpenCV XML", "extrinsics.xml", _file_storage(".xml")),
    Calibration(
        "Autoware.AI", "lidar_camera_calibration.yaml", _autoware_ai(RADAR_FROM_CAMERA), holds_camera="lens size"
    ),
    Calibration("Autoware.AI intrinsics", "camera_calibration.yaml", _autoware_ai(np.eye(4)), refused="identity"),
    Calibration("Autoware.AI inverted", "calibration.yaml", _autoware_ai(CAMERA_FROM_RADAR), refused="invert"),
    Calibration("PJLab", "radar-to-center_camera.json", _pjlab("radar", "center_camera", CAMERA_FROM_RADAR)),
    Calibration("PJLab, the other way", "camera-to-radar.json", _pjlab("center_camera", "radar", RADAR_FROM_CAMERA)),
    Calibration(
        "PJLab of a lidar",
        "lidar-to-camera.json",
        _pjlab("top_center_lidar", "center_camera", CAMERA_FROM_RADAR),
        refused="top_center_lidar",
    ),
    Calibration("koide3", "calib.json", _koide3(T_lidar_camera=POSE_7), holds_camera="lens"),
    Calibration("koide3, initial guess", "calib.json", _koide3(init_T_lidar_camera=POSE_7), refused="initial guess"),
    Calibration("OpenLABEL", "openlabel.json", _openlabel_by_matrix(RADAR_FROM_CAMERA), holds_camera="lens size"),
    Calibration("OpenLABEL in a vehicle", "openlabel.json", _openlabel_in_a_vehicle(), holds_camera="lens size"),
    Calibration(
        "OpenLABEL inverted", "openlabel.json", _openlabel_by_matrix(inverse(RADAR_FROM_CAMERA)), refused="inverted"
    ),
    Calibration("Segments.ai, OpenCV", "sample.json", _segments(RADAR_FROM_CAMERA, camera_convention="OpenCV")),
    Calibration("Segments.ai", "sample.json", _segments(RADAR_FROM_CAMERA @ OPENGL), refused="opengl"),
    Calibration("TUM pose", "pose.txt", f"1305031098.6659 {words(POSE_7)}\n"),
    Calibration("TUM trajectory", "trajectory.txt", f"1.0 {words(POSE_7)}\n2.0 {words(POSE_7)}\n", refused="2 poses"),
    Calibration("4x4 in text", "radar_to_camera.txt", "\n".join(words(row) for row in CAMERA_FROM_RADAR)),
    Calibration("npz with R and t", "calibration.npz", _npz()),
    Calibration("4x4 in npy", "camera_from_radar.npy", _npy(CAMERA_FROM_RADAR)),
    Calibration(
        "named 4x4 in JSON",
        "extrinsics.json",
        json.dumps({"T_camera_radar": CAMERA_FROM_RADAR.tolist()}),
    ),
    Calibration("rvec and tvec in JSON", "pnp.json", _vectors()),
    Calibration("R and t in JSON", "extrinsics.json", _rotation_and_translation()),
)
