"""Apollo's extrinsics: a stamped transform, which is also what `ros2 topic echo /tf_static` prints."""

from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.statement import POSE_ONLY, hash_comment, statement
from calib_core.interchange.syntax.yaml_text import number_text, quoted
from calib_core.interchange.trees.posed_in_tree import read_joints
from calib_core.interchange.trees.stamped import recognizes_stamped


def _write(file: CalibrationFile) -> str:
    """Write Apollo's extrinsics file; any reader of stamped transforms accepts it."""
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation)
    frames = file.frames
    meaning = (
        f"the numbers are the pose of the child {frames.camera} in the parent {frames.radar}; quaternion named x y z w"
    )
    translation = zip("xyz", radar_from_camera.translation_m, strict=True)
    rotation = zip("xyzw", quaternion, strict=True)
    return (
        hash_comment(statement(file, meaning))
        + f"header:\n  seq: 0\n  stamp:\n    secs: 0\n    nsecs: 0\n  frame_id: {quoted(frames.radar)}\n"
        + f"child_frame_id: {quoted(frames.camera)}\ntransform:\n  translation:\n"
        + "".join(f"    {key}: {number_text(value)}\n" for key, value in translation)
        + "  rotation:\n"
        + "".join(f"    {key}: {number_text(value)}\n" for key, value in rotation)
    )


APOLLO = Format(
    name="apollo",
    title="Apollo extrinsics",
    used_in="Vehicle stacks",
    also="Baidu Cyber RT vehicle",
    numbers="pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
    file_name="radar_camera_extrinsics.yaml",
    camera="none",
    comment="#",
    notes=(POSE_ONLY,),
    write=_write,
    reads=Reads(recognizes_stamped, read_joints),
)
