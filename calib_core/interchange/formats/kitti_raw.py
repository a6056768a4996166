"""KITTI's raw data (calib_velo_to_cam.txt with calib_cam_to_cam.txt beside it) and odometry (calib.txt with Tr)."""

from pathlib import PurePath

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.camera_format import FoundCamera, with_camera
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.formats.kitti import keyed_lines, numbers_of
from calib_core.interchange.pose_parts import rigid
from calib_core.interchange.syntax.content import Content

_CAMERAS = "calib_cam_to_cam.txt"
_AS_RADAR = "the Velodyne's frame is taken to be the radar's; KITTI has no radar"
_UNDISTORTED = "assumed that the images are undistorted, those of image_02"
_ROUNDING = 1e-3


def _recognizes_raw(content: Content) -> bool:
    keys = {line.partition(":")[0] for line in content.lines}
    return content.syntax == "lines" and {"R", "T"} <= keys and bool(keys & {"calib_time", "delta_f", "delta_c"})


def _read_raw(content: Content, source: str) -> ImportedCalibration:
    """Read the Velodyne's pose, in the rectified camera 2 if the cameras' file is beside it.

    Raises:
        InputError: a line is missing or has the wrong number of values, or by its name the file is about the IMU.
    """
    if "imu_to_velo" in PurePath(source).name:
        raise InputError(
            f"{source}: KITTI's pose between IMU and Velodyne, without a camera; give calib_velo_to_cam.txt"
        )
    lines = keyed_lines(content.text, source=source)
    rotation = numbers_of(lines, "R", 3, 3, source=source)
    translation_m = numbers_of(lines, "T", 3, source=source)
    camera0_from_radar = rigid("matrix", rotation, translation_m, source=source)
    if _CAMERAS not in content.beside:
        return _calibration_of(
            camera0_from_radar,
            f"no {_CAMERAS} beside the file: the camera is camera 0 before rectification",
            source=source,
        )
    beside = keyed_lines(content.beside[_CAMERAS].decode("utf-8", errors="replace"), source=_CAMERAS)
    rectifying = numbers_of(beside, "R_rect_00", 3, 3, source=_CAMERAS)
    rectified_from_camera0 = rigid("matrix", rectifying, np.zeros(3), source=_CAMERAS)
    projection = numbers_of(beside, "P_rect_02", 3, 4, source=_CAMERAS)
    size = numbers_of(beside, "S_rect_02", 2, source=_CAMERAS)
    return _projected(
        rectified_from_camera0 @ camera0_from_radar, projection, (int(size[0]), int(size[1])), source=source
    )


def _recognizes_odometry(content: Content) -> bool:
    keys = {line.partition(":")[0].strip() for line in content.lines if ":" in line}
    return (
        content.syntax == "lines" and "Tr" in keys and not any("velo" in key or "radar" in key for key in keys - {"Tr"})
    )


def _read_odometry(content: Content, source: str) -> ImportedCalibration:
    """Read Tr, the Velodyne's pose in the rectified camera 0, and the projection of camera 2.

    Raises:
        InputError: a line is missing or has the wrong number of values.
    """
    lines = keyed_lines(content.text, source=source)
    matrix = numbers_of(lines, "Tr", 3, 4, source=source)
    camera0_from_radar = rigid("matrix", matrix[:, :3], matrix[:, 3], source=source)
    if "P2" not in lines:
        return _calibration_of(
            camera0_from_radar, "no P2 in the file: the camera is the rectified camera 0", source=source
        )
    projection = numbers_of(lines, "P2", 3, 4, source=source)
    return _projected(camera0_from_radar, projection, None, source=source)


def _projected(
    camera0_from_radar: RigidTransform, projection: np.ndarray, size_px: tuple[int, int] | None, *, source: str
) -> ImportedCalibration:
    """Return the pose in camera 2, whose projection of the rectified camera 0 is K [I | t].

    Raises:
        InputError: the projection is not a camera's.
    """
    matrix = projection[:, :3]
    if np.abs(matrix[2] - [0, 0, 1]).max() > _ROUNDING or not (np.diag(matrix) > 0).all():
        raise InputError(f"{source}: the projection of camera 2 has no camera matrix in it; correct it")
    offset_m = np.linalg.solve(matrix, projection[:, 3])
    camera2_from_camera0 = RigidTransform(np.eye(3), offset_m)
    calibration = _calibration_of(camera2_from_camera0 @ camera0_from_radar, _UNDISTORTED, source=source)
    camera = FoundCamera("P2", "", tuple(matrix.ravel().tolist()), (), size_px)
    return with_camera(calibration, camera, source=source)


def _calibration_of(camera_from_radar: RigidTransform, assumption: str, *, source: str) -> ImportedCalibration:
    pose = WrittenPose("matrix", camera_from_radar.rotation, camera_from_radar.translation_m, "camera_from_radar")
    return ImportedCalibration("kitti-raw", pose, assumptions=(_AS_RADAR, assumption)).checked(source)


KITTI_RAW = Reads(_recognizes_raw, _read_raw, beside=(_CAMERAS,))
KITTI_ODOMETRY = Reads(_recognizes_odometry, _read_odometry)
