"""Every format we write, in one table."""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.array_formats import MATLAB_NOTES, write_matlab, write_matrix, write_numpy
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.calibration_json import write_calibration
from calib_core.interchange.colmap_format import COLMAP_NOTES, write_colmap
from calib_core.interchange.dataset_formats import (
    KITTI_NOTES,
    NUSCENES_NOTES,
    write_kitti,
    write_nuscenes,
    write_nuscenes_in_ego,
)
from calib_core.interchange.driveworks_format import DRIVEWORKS_NOTES, write_driveworks, write_driveworks_in_rig
from calib_core.interchange.foxglove_format import FOXGLOVE_NOTES, write_foxglove
from calib_core.interchange.opencv_format import write_opencv
from calib_core.interchange.ros_formats import (
    write_launch_python,
    write_ros1_launch,
    write_ros2_launch_xml,
    write_tf2_command,
)
from calib_core.interchange.urdf_format import write_urdf
from calib_core.interchange.yaml_formats import write_apollo, write_autoware, write_autoware_in_kit, write_kalibr

__all__ = ["FORMATS", "ExportBytes", "ExportText", "Format", "export", "format_named"]

Comment = Literal["#", "<!-- -->", "keys", "none"]


@dataclass(frozen=True, slots=True)
class Format:
    """One format we write.

    Attributes:
        name: what `--to` takes.
        title: one line for people.
        numbers: what the file's numbers are, in one line: which way they carry points, and in which order they stand.
        file_name: what the file is called unless a person says otherwise.
        carries_camera: whether the camera's intrinsics are in it too.
        comment: how it says its frames and check point in words: "#", "<!-- -->", its own keys, or none.
        write: turns a calibration into the file's content; refuses in words what the format cannot carry.
        notes: what a person must know who uses it, one sentence each.
        write_in_parent: the same under a known pose of the radar in a third frame (kit, ego); None where there is none.
    """

    name: str
    title: str
    numbers: str
    file_name: str
    carries_camera: bool
    comment: Comment
    write: Callable[[CalibrationFile], str | bytes]
    notes: tuple[str, ...] = ()
    write_in_parent: Callable[[CalibrationFile, RigidTransform], str | bytes] | None = None


@dataclass(frozen=True, slots=True)
class ExportText:
    """A text file to write.

    Attributes:
        file_name: what to call it.
        text: its content.
        notes: what a person must know who uses it.
    """

    file_name: str
    text: str
    notes: tuple[str, ...] = ()

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.text.encode()


@dataclass(frozen=True, slots=True)
class ExportBytes:
    """A binary file to write.

    Attributes:
        file_name: what to call it.
        data: its content.
        notes: what a person must know who uses it.
    """

    file_name: str
    data: bytes
    notes: tuple[str, ...] = ()


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
        True,
        "keys",
        write_calibration,
    ),
    Format(
        "tf2",
        "ROS 2 command",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "static_transform.sh",
        False,
        "#",
        write_tf2_command,
        _POSE_ONLY,
    ),
    Format(
        "tf2-launch-py",
        "ROS 2 launch file, Python",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch.py",
        False,
        "#",
        write_launch_python,
        _POSE_ONLY,
    ),
    Format(
        "tf2-launch-xml",
        "ROS 2 launch file, XML",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch.xml",
        False,
        "<!-- -->",
        write_ros2_launch_xml,
        _POSE_ONLY,
    ),
    Format(
        "tf1-launch",
        "ROS 1 launch file",
        "pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
        "radar_camera.launch",
        False,
        "<!-- -->",
        write_ros1_launch,
        _POSE_ONLY,
    ),
    Format(
        "urdf",
        "URDF: camera_link and optical frame",
        "pose of camera_link (body axes) in the radar, roll pitch yaw about fixed axes; then the optical joint",
        "radar_camera.urdf",
        False,
        "<!-- -->",
        write_urdf,
        _POSE_ONLY,
    ),
    Format(
        "autoware",
        "Autoware sensor kit",
        "pose of each sensor in sensor_kit_base_link, roll pitch yaw about fixed axes; camera_link has body axes",
        "sensor_kit_calibration.yaml",
        False,
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
        False,
        "#",
        write_apollo,
        _POSE_ONLY,
    ),
    Format(
        "kalibr",
        "Kalibr camera chain",
        "T_cam_radar carries radar points into the camera; our key, Kalibr has none for radars",
        "camchain.yaml",
        True,
        "#",
        write_kalibr,
        _KALIBR,
    ),
    Format(
        "opencv",
        "OpenCV FileStorage",
        "R, T, rvec carry radar points into the camera",
        "radar_camera.yml",
        True,
        "#",
        write_opencv,
    ),
    Format(
        "kitti",
        "KITTI and View-of-Delft calibration",
        "Tr_velo_to_cam carries radar points into the camera; images undistorted",
        "calib.txt",
        True,
        "none",
        write_kitti,
        KITTI_NOTES,
    ),
    Format(
        "nuscenes",
        "nuScenes calibrated_sensor",
        "pose of each sensor in the ego frame, quaternion w x y z; images undistorted",
        "calibrated_sensor.json",
        True,
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
        False,
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
        True,
        "none",
        write_foxglove,
        FOXGLOVE_NOTES,
    ),
    Format(
        "colmap",
        "COLMAP text model",
        "world (radar) into camera, quaternion w x y z; principal point half a pixel larger",
        "colmap.zip",
        True,
        "#",
        write_colmap,
        COLMAP_NOTES,
    ),
    Format(
        "matlab",
        "MATLAB mat file",
        "camera_from_radar.A carries radar points into the camera; camera.PrincipalPoint counts from 1",
        "radar_camera.mat",
        True,
        "keys",
        write_matlab,
        MATLAB_NOTES,
    ),
    Format(
        "numpy",
        "NumPy arrays, no pickle",
        "camera_from_radar (4x4), R and t carry radar points into the camera; K and D are the camera's",
        "radar_camera.npz",
        True,
        "keys",
        write_numpy,
    ),
    Format(
        "matrix",
        "4x4 matrix as text",
        "rows of the 4x4 matrix that carries radar points into the camera",
        "camera_from_radar.txt",
        False,
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


def export(
    file: CalibrationFile, name: str, *, parent_from_radar: RigidTransform | None = None
) -> ExportText | ExportBytes:
    """Write a calibration in another format: the same calibration gives the same bytes.

    Args:
        file: what to export.
        name: one of FORMATS.
        parent_from_radar: the radar's pose in the third frame of "autoware" (kit), "driveworks" (rig) or "nuscenes" (ego).

    Raises:
        InputError: no such format, or it cannot carry this calibration: why, and what to take instead.
    """
    chosen = format_named(name)
    if parent_from_radar is None:
        content = chosen.write(file)
    elif chosen.write_in_parent is None:
        able = ", ".join(known.name for known in FORMATS if known.write_in_parent)
        raise InputError(f"the format {name} has no third frame to pose the radar in; those that have: {able}")
    else:
        content = chosen.write_in_parent(file, parent_from_radar)
    if isinstance(content, bytes):
        return ExportBytes(chosen.file_name, content, chosen.notes)
    return ExportText(chosen.file_name, content, chosen.notes)
