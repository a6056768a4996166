"""Kalibr's camera chain with our own key T_cam_radar; Kalibr has none for radars."""

from collections.abc import Mapping

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.cameras.kalibr import kalibr_camera_text
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.pose_parts import rigid_rows
from calib_core.interchange.statement import hash_comment, stated_check_point, stated_frames, statement
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text

_NOTES = ("T_cam_radar is our own key; Kalibr has none for radars",)


def _write(file: CalibrationFile) -> str:
    """Write a camera chain of one camera, with T_cam_radar in addition to Kalibr's own keys.

    Raises:
        InputError: Kalibr has no model for this lens.
    """
    calibration = file.calibration
    rows = "".join(f"  - [{numbers_text(row)}]\n" for row in calibration.camera_from_radar.as_matrix())
    meaning = (
        "T_cam_radar carries radar points into the camera (our key, after Kalibr's T_cam_imu); rows of a 4x4 matrix"
    )
    return (
        hash_comment(statement(file, meaning))
        + kalibr_camera_text(calibration.camera, image_topic=file.provenance.image_topic or "")
        + f"  T_cam_radar:\n{rows}"
    )


def _recognizes(content: Content) -> bool:
    return any("T_cam_radar" in value for value in content.mapping.values() if isinstance(value, Mapping))


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the camera with T_cam_radar in a chain.

    Raises:
        InputError: a number is missing, or several cameras have T_cam_radar.
    """
    chain = content.mapping
    key, *others = [key for key, value in chain.items() if isinstance(value, Mapping) and "T_cam_radar" in value]
    if others:
        raise InputError(
            f"{source}: T_cam_radar appears in {key}, {', '.join(map(str, others))}; keep only the intended camera"
        )
    rows = rigid_rows(chain[key]["T_cam_radar"], source=source, place=f"{key}.T_cam_radar")
    cameras = find_cameras({key: chain[key]}, source=source) if "intrinsics" in chain[key] else ()
    return ImportedCalibration(
        "kalibr",
        WrittenPose("matrix", rows[:, :3], rows[:, 3], "camera_from_radar"),
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
        frames=stated_frames(content.text),
        check_point=stated_check_point(content.text),
    ).checked(source)


KALIBR = Format(
    name="kalibr",
    title="Kalibr camera chain",
    used_in="Calibration tools and arrays",
    also="camchain intrinsics yaml",
    numbers="T_cam_radar carries radar points into the camera; our key, Kalibr has none for radars",
    file_name="camchain.yaml",
    camera="lens",
    comment="#",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
