"""ROS camera_info YAML: the intrinsics that image pipelines load; it has no pose."""

from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.camera_format import refuse_skew
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.format import Format
from calib_core.interchange.statement import hash_comment, statement

_NUMBERS = "camera_matrix (K), distortion (D), rectification (R, identity) and projection (P); no pose"
_NOTES = ("contains the camera only, without the pose: also export a format with the pose, such as tf2 or urdf",)


def _write(file: CalibrationFile) -> str:
    """Write camera_info.yaml, with the frames and the check point in comments.

    Raises:
        InputError: the camera has skew, or ROS has no name for its lens.
    """
    camera = file.calibration.camera
    refuse_skew(camera, "ROS's camera models have")
    return hash_comment(statement(file, _NUMBERS)) + camera_info_text(camera, file.frames.camera)


CAMERA_INFO = Format(
    name="camera-info",
    title="ROS camera_info.yaml (camera only)",
    used_in="ROS",
    also="ROS 2 intrinsics sensor_msgs CameraInfo calibration_file",
    numbers=_NUMBERS,
    file_name="camera_info.yaml",
    camera="lens",
    pose_for=None,
    comment="#",
    notes=_NOTES,
    write=_write,
    reads=None,
)
