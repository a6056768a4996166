"""The 4x4 matrix as rows of text, as numpy.loadtxt and MATLAB's load read it."""

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.rotations import upper_rows
from calib_core.interchange.statement import (
    POSE_ONLY,
    hash_comment,
    stated_check_point,
    stated_frames,
    statement,
)
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text

_LARGEST = 1e9


def _write(file: CalibrationFile) -> str:
    """Write the 4x4 matrix that maps radar points to the camera frame; numpy.loadtxt and MATLAB's load read it."""
    meaning = "the rows of the 4x4 matrix that carries homogeneous radar points into the camera"
    rows = file.calibration.camera_from_radar.as_matrix()
    return hash_comment(statement(file, meaning)) + "".join(f"{numbers_text(row, ' ')}\n" for row in rows)


def _recognizes(content: Content) -> bool:
    try:
        return bool(content.lines) and len(np.array(_words(content.lines[0]), dtype=np.float64)) > 1
    except ValueError:
        return False


def _words(line: str) -> list[str]:
    return line.replace(",", " ").split()


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read 12 or 16 numbers as the rows of a 3x4 or 4x4 matrix.

    Raises:
        InputError: there are too few or too many numbers, or something else among them.
    """
    words = [word for line in content.text.splitlines() for word in _words(line.partition("#")[0])]
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{source}: not a matrix ({error}); give 3 or 4 rows of 4 numbers") from None
    if len(numbers) not in (12, 16) or not (np.abs(numbers) <= _LARGEST).all():
        raise InputError(
            f"{source}: expected 12 or 16 finite numbers, found {len(numbers)}; give 3 or 4 rows of 4, or convert the file with "
            "cocalib import FILE"
        )
    try:
        rows = upper_rows(numbers.reshape(-1, 4))
    except ValueError as error:
        raise InputError(f"{source}: {error}; give the rows of camera_from_radar") from None
    frames = stated_frames(content.text)
    return ImportedCalibration(
        "matrix",
        WrittenPose("matrix", rows[:, :3], rows[:, 3], "camera_from_radar"),
        frames=frames,
        check_point=stated_check_point(content.text),
        assumptions=() if frames else ("the file does not say what the matrix is; assumed p_camera = R p_radar + t",),
    ).checked(source)


MATRIX = Format(
    name="matrix",
    title="4x4 matrix as text",
    used_in="Calibration tools and arrays",
    also="plain text homogeneous",
    numbers="rows of the 4x4 matrix that carries radar points into the camera",
    file_name="camera_from_radar.txt",
    camera="none",
    pose_for="raw",
    comment="#",
    notes=(POSE_ONLY,),
    write=_write,
    reads=Reads(_recognizes, _read),
)
