"""A COLMAP text model of one image, with the radar frame as world frame."""

from collections.abc import Sequence

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.colmap import colmap_camera_line, found_colmap_camera
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.statement import hash_comment, stated_frames, statement, with_statement
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text
from calib_core.interchange.syntax.zip_archives import pack

_NOTES = (
    "unpack it into a folder: cameras.txt, images.txt and points3D.txt; the world frame is the radar frame; "
    "COLMAP puts the center of the top-left pixel at (0.5, 0.5), so the principal point is half a pixel larger",
)
_WORLD = "the file does not say what its world frame is; taken to be the radar's (x forward, y left, z up), in meters"


def _write(file: CalibrationFile) -> bytes:
    """Write the three text files of a COLMAP model, zipped.

    Raises:
        InputError: COLMAP has no model for this camera.
    """
    calibration = file.calibration
    camera_line = colmap_camera_line(calibration.camera)
    pose = calibration.camera_from_radar
    numbers = (*quaternion_wxyz_from_matrix(pose.rotation), *pose.translation_m)
    comment = hash_comment(statement(file, "QW QX QY QZ TX TY TZ carry radar points into the camera"))
    image = "".join("_" if character.isspace() else character for character in file.frames.camera)
    texts = {
        "cameras.txt": f"{comment}# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n{camera_line}",
        "images.txt": f"{comment}# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n1 {numbers_text(numbers, ' ')} 1 {image}\n\n",
        "points3D.txt": comment,
    }
    return pack({name: text.encode() for name, text in texts.items()})


def _recognizes(content: Content) -> bool:
    if any("images.txt" in name for name in content.members):
        return True
    return "cameras.txt" in content.beside and content.syntax == "lines" and _is_image(content.lines[:1])


def _is_image(lines: Sequence[str]) -> bool:
    """Return whether a line is that of an image: its id, seven numbers, the camera's id and a name."""
    words = lines[0].split() if lines else []
    try:
        return len(words) == 10 and len([float(word) for word in words[:9]]) == 9
    except ValueError:
        return False


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the image of a COLMAP text model and its camera: zipped, or images.txt with cameras.txt beside it.

    Raises:
        InputError: a file or a number is missing, or there are several images.
    """
    members = {name.rsplit("/", 1)[-1]: data for name, data in content.members.items()}
    if content.syntax == "lines":
        members = {**content.beside, "images.txt": content.text.encode()}
    if not {"cameras.txt", "images.txt"} <= set(members):
        raise InputError(f"{source}: cameras.txt or images.txt is missing; give a zipped COLMAP text model")
    text = members["images.txt"].decode("utf-8", errors="replace")
    rows = [line for line in text.splitlines() if not line.startswith("#")]  # two per image, the second may be empty
    count = sum(1 for line in rows[::2] if line.strip())
    if count > 1:
        raise InputError(f"{source}: images.txt: contains {count} images; keep only the intended one")
    image, camera = _first_line(text), _first_line(members["cameras.txt"].decode("utf-8", errors="replace"))
    numbers = floats(image[1:8], source=source, place="images.txt", length=7)
    calibration = ImportedCalibration(
        "colmap",
        WrittenPose("quaternion_wxyz", np.array(numbers[:4]), np.array(numbers[4:]), "camera_from_radar"),
        camera=found_colmap_camera(camera, source=source).camera(image_size_px=None, source=source),
        assumptions=() if stated_frames(text) else (_WORLD,),
    )
    return with_statement(calibration, text).checked(source)


def _first_line(text: str) -> list[str]:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return lines[0].split() if lines else []


COLMAP = Format(
    name="colmap",
    title="COLMAP text model",
    used_in="Calibration tools and arrays",
    also="structure from motion photogrammetry",
    numbers="world (radar) into camera, quaternion w x y z; principal point half a pixel larger",
    file_name="colmap.zip",
    camera="lens",
    pose_for="raw",
    comment="#",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read, beside=("cameras.txt",)),
)
