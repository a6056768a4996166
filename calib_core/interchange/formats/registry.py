"""Every format we write, in one table."""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.formats.colmap import COLMAP_NOTES, write_colmap
from calib_core.interchange.formats.datasets import (
    KITTI_NOTES,
    NUSCENES_NOTES,
    write_kitti,
    write_nuscenes,
    write_nuscenes_in_ego,
)
from calib_core.interchange.formats.driveworks import DRIVEWORKS_NOTES, write_driveworks, write_driveworks_in_rig
from calib_core.interchange.formats.foxglove import FOXGLOVE_NOTES, write_foxglove
from calib_core.interchange.formats.matrices import MATLAB_NOTES, write_matlab, write_matrix, write_numpy
from calib_core.interchange.formats.opencv import write_opencv
from calib_core.interchange.formats.ros import (
    write_launch_python,
    write_ros1_launch,
    write_ros2_launch_xml,
    write_tf2_command,
)
from calib_core.interchange.formats.urdf import write_urdf
from calib_core.interchange.formats.yaml_files import (
    write_apollo,
    write_autoware,
    write_autoware_in_kit,
    write_kalibr,
)
from calib_core.interchange.own.calibration_json import write_calibration

__all__ = ["FORMATS", "CameraShare", "Format", "format_named"]

Comment = Literal["#", "<!-- -->", "keys", "none"]
CameraShare = Literal["none", "matrix", "lens"]
"""What of the camera a format carries: nothing, its matrix with no place for distortion, or the whole lens."""


@dataclass(frozen=True, slots=True)
class Format:
    """One format we write.

    Attributes:
        name: what `--to` takes.
        title: one line for people.
        numbers: what the file's numbers are, in one line: which way they carry points, and in which order they stand.
        file_name: what the file is called unless a person says otherwise.
        camera: what of the camera is in it too.
        comment: how it says its frames and check point in words: "#", "<!-- -->", its own keys, or none.
        write: turns a calibration into the file's content; refuses in words what the format cannot carry.
        notes: what a person must know who uses it, one sentence each.
        write_in_parent: the same under a known pose of the radar in a third frame (kit, ego); None where there is none.
    """

    name: str
    title: str
    numbers: str
    file_name: str
    camera: CameraShare
    comment: Comment
    write: Callable[[CalibrationFile], str | bytes]
    notes: tuple[str, ...] = ()
    write_in_parent: Callable[[CalibrationFile, RigidTransform], str | bytes] | None = None

    @property
    def is_for_rectified(self) -> bool:
        """Whether its pictures must be rectified: it carries a camera matrix and has no place for distortion."""
        return self.camera == "matrix"


_POSE_ONLY = ("carries the pose only: keep your camera_info, or export opencv too, which carries the camera",)
_KIT = (
    "poses are in sensor_kit_base_link; the radar is put at the kit's origin (parent_from_radar places it elsewhere)",
    *_POSE_ONLY,
)
_KALIBR = ("T_cam_radar is our key: Kalibr itself has none for radars",)

FORMATS: tuple[Format, ...] = (
    Format(
        "json",
        "cocalib's own calibration-1",
        "camera_from_radar and its inverse, both as matrix, translation and quaternion w x y z",
        "calibration.json",
        "lens",
        "keys",
        write_calibration,
    ),
    Format(
        "tf2",
        "ROS 2 command",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "static_transform.sh",
        "none",
        "#",
        write_tf2_command,
        _POSE_ONLY,
    ),
    Format(
        "tf2-launch-py",
        "ROS 2 launch file, Python",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch.py",
        "none",
        "#",
        write_launch_python,
        _POSE_ONLY,
    ),
    Format(
        "tf2-launch-xml",
        "ROS 2 launch file, XML",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch.xml",
        "none",
        "<!-- -->",
        write_ros2_launch_xml,
        _POSE_ONLY,
    ),
    Format(
        "tf1-launch",
        "ROS 1 launch file",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch",
        "none",
        "<!-- -->",
        write_ros1_launch,
        _POSE_ONLY,
    ),
    Format(
        "urdf",
        "URDF: camera_link and optical frame",
        "pose of camera_link (body axes) in the radar, roll pitch yaw about fixed axes; then the optical joint",
        "radar_camera.urdf",
        "none",
        "<!-- -->",
        write_urdf,
        _POSE_ONLY,
    ),
    Format(
        "autoware",
        "Autoware sensor kit",
        "pose of each sensor in sensor_kit_base_link, roll pitch yaw about fixed axes; camera_link has body axes",
        "sensor_kit_calibration.yaml",
        "none",
        "#",
        write_autoware,
        _KIT,
        write_autoware_in_kit,
    ),
    Format(
        "apollo",
        "Apollo extrinsics",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera_extrinsics.yaml",
        "none",
        "#",
        write_apollo,
        _POSE_ONLY,
    ),
    Format(
        "kalibr",
        "Kalibr camera chain",
        "T_cam_radar carries radar points into the camera; our key, Kalibr has none for radars",
        "camchain.yaml",
        "lens",
        "#",
        write_kalibr,
        _KALIBR,
    ),
    Format(
        "opencv",
        "OpenCV FileStorage",
        "R, T, rvec carry radar points into the camera",
        "radar_camera.yml",
        "lens",
        "#",
        write_opencv,
    ),
    Format(
        "kitti",
        "KITTI and View-of-Delft calibration",
        "Tr_velo_to_cam carries radar points into the camera; images undistorted",
        "calib.txt",
        "matrix",
        "none",
        write_kitti,
        KITTI_NOTES,
    ),
    Format(
        "nuscenes",
        "nuScenes calibrated_sensor",
        "pose of each sensor in the ego frame, quaternion w x y z; images undistorted",
        "calibrated_sensor.json",
        "matrix",
        "none",
        write_nuscenes,
        NUSCENES_NOTES,
        write_nuscenes_in_ego,
    ),
    Format(
        "driveworks",
        "NVIDIA DriveWorks rig",
        "pose of each sensor in the rig, roll pitch yaw in degrees about fixed axes; the camera with body axes",
        "rig.json",
        "none",
        "none",
        write_driveworks,
        DRIVEWORKS_NOTES,
        write_driveworks_in_rig,
    ),
    Format(
        "foxglove",
        "Foxglove messages",
        "FrameTransform: pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "foxglove.json",
        "lens",
        "none",
        write_foxglove,
        FOXGLOVE_NOTES,
    ),
    Format(
        "colmap",
        "COLMAP text model",
        "world (radar) into camera, quaternion w x y z; principal point half a pixel larger",
        "colmap.zip",
        "lens",
        "#",
        write_colmap,
        COLMAP_NOTES,
    ),
    Format(
        "matlab",
        "MATLAB mat file",
        "camera_from_radar.A carries radar points into the camera; camera.PrincipalPoint counts from 1",
        "radar_camera.mat",
        "lens",
        "keys",
        write_matlab,
        MATLAB_NOTES,
    ),
    Format(
        "numpy",
        "NumPy arrays, no pickle",
        "camera_from_radar (4x4), R and t carry radar points into the camera; K and D are the camera's",
        "radar_camera.npz",
        "lens",
        "keys",
        write_numpy,
    ),
    Format(
        "matrix",
        "4x4 matrix as text",
        "rows of the 4x4 matrix that carries radar points into the camera",
        "camera_from_radar.txt",
        "none",
        "#",
        write_matrix,
        _POSE_ONLY,
    ),
)


def format_named(name: str) -> Format:
    """Return a format by its name.

    Raises:
        InputError: there is none of that name.
    """
    for known in FORMATS:
        if known.name == name:
            return known
    names = [known.name for known in FORMATS]
    near = get_close_matches(name, names, n=1)
    raise InputError(
        f"no format {name!r}; did you mean {near[0]}?" if near else f"no format {name!r}; there are {', '.join(names)}"
    )
