"""The intrinsics of a recording that is to be calibrated: without any, an error says where to get them."""

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import CameraFile
from calib_core.recordings import Recording
from cocalib.solving import camera_for, intrinsics_near


def required_camera(recording: Recording, camera_file: CameraFile | None) -> Camera:
    """Return the intrinsics: from the file if one is given, else from the recording.

    Raises:
        InputError: there are none.
    """
    camera = camera_for(recording, camera_file)
    if camera is None:
        found = (
            f"{recording.camera_info_topic} has none that can be used"
            if recording.camera_info_topic
            else "it has no CameraInfo topic"
        )
        near = intrinsics_near(recording.paths)
        raise InputError(
            f"{recording.paths[0].name}: no intrinsics for {recording.image_topic}: {found}; "
            "give them with --camera FILE (ROS camera_info YAML, OpenCV YAML or XML, Kalibr camchain, JSON)"
            + (f", such as --camera {near}" if near else "")
            + "; or calibrate the lens from pictures of a board: cocalib intrinsics --help"
        )
    return camera
