"""KITTI's object calibration, for rectified images; View-of-Delft uses the same keys for its radar."""

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EVIDENCE_LEVELS, CalibrationFile, Evidence
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import (
    Format,
    ImportedCalibration,
    Reads,
    StatedCheckPoint,
    WrittenPose,
    looks_like_lidar,
    of_lidar,
)
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.own.raw_data import aed_either_way
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text

_NOTES = (
    "Tr_velo_to_cam maps radar points to the camera frame: p_camera = R p_radar + t (as in View-of-Delft)",
    "a comment would break KITTI readers, so the check point, the evidence and the calibration's hash are numbers in "
    "lines of their own after KITTI's seven, explained in docs/formats.md (Files and formats under Help)",
)
_SHA256_BYTES, _BYTE_DIGITS = 32, 3
_ASSUMPTION = "the format names no frames and assumes undistorted images"
_AED, _FOR_RAW = "cocalib_aed_px", "cocalib_for_raw_aed_px"
_CHECK_POINT, _EVIDENCE, _SHA256 = "cocalib_check_point", "cocalib_evidence", "cocalib_calibration_sha256"
_RADAR_FOLDER = re.compile(r"radar(_\dframes)?|.*4dradset.*")
"""Of View-of-Delft and TJ4DRadSet, where the radar has the Velodyne's key."""
_POSE_KEYS = ("Tr_velo_to_cam", "Tr_radar_to_cam", "Tr_velo_cam")


def _write(file: CalibrationFile) -> str:
    """Write the seven lines of KITTI's object calibration, in the order that some readers rely on, then our own."""
    calibration = file.calibration
    projection = numbers_text(np.hstack([calibration.camera.matrix_px, np.zeros((3, 1))]).ravel(), " ")
    identity = numbers_text(np.eye(3, 4).ravel(), " ")
    pose = numbers_text(calibration.camera_from_radar.as_matrix()[:3].ravel(), " ")
    return (
        "".join(f"P{index}: {projection}\n" for index in range(4))
        + f"R0_rect: {numbers_text(np.eye(3).ravel(), ' ')}\n"
        + f"Tr_velo_to_cam: {pose}\nTr_imu_to_velo: {identity}\n"
        + "".join(f"{key}: {numbers}\n" for key, numbers in _stated_numbers(file).items())
    )


def _stated_numbers(file: CalibrationFile) -> dict[str, str]:
    """Return what the file states as numbers, because readers convert the values of every key: p_radar, p_camera and the
    rectified pixel of the check point; the number of the evidence level; the bytes of the calibration's SHA-256; AED with the
    radar's corrections and without, or the other way round if the pose is for radar data as reported."""
    stated = {}
    check = file.check_point
    if check is not None:
        point_camera_m = (file.calibration.camera_from_radar @ check.radar_m[None])[0]
        stated[_CHECK_POINT] = numbers_text((*check.radar_m, *point_camera_m, *check.pixel_px), " ")
    stated[_EVIDENCE] = str(EVIDENCE_LEVELS.index(file.rests_on))
    stated[_SHA256] = " ".join(map(str, bytes.fromhex(calibration_sha256(file))))
    figures = aed_either_way(file)
    if figures is not None:
        stated[_AED if file.corrected is None else _FOR_RAW] = numbers_text(figures, " ")
    return stated


def _recognizes(content: Content) -> bool:
    return any(line.startswith(tuple(f"{key}:" for key in _POSE_KEYS)) for line in content.lines)


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a KITTI or View-of-Delft calibration: P2, R0_rect and Tr_velo_to_cam.

    Raises:
        InputError: a line is missing or has too few or too many numbers.
    """
    lines = keyed_lines(content.text, source=source)
    key, *others = [key for key in _POSE_KEYS if key in lines] or [""]
    if not key:
        raise InputError(f"{source}: no Tr_velo_to_cam in it; add that line")
    if others:
        raise InputError(f"{source}: both {key} and {others[0]} are in it; keep only the radar's")
    pose = numbers_of(lines, key, 3, 4, source=source)
    notes = []
    rectified = "R0_rect" in lines
    if rectified:
        rotation = numbers_of(lines, "R0_rect", 3, 3, source=source)
        if np.abs(rotation - np.eye(3)).max() > 0:
            pose = rotation @ pose
            notes.append("R0_rect was applied; the camera is the rectified one")
    matrix_px = None
    if "P2" in lines:
        projection = numbers_of(lines, "P2", 3, 4, source=source)
        matrix_px = projection[:, :3]
        if projection[:, 3].any():
            pose = pose + np.column_stack([np.zeros((3, 3)), _offset_m(projection, source=source)])
            notes.append("the offset in P2 was applied; the camera is the one of image_2")
    written = WrittenPose("matrix", pose[:, :3], pose[:, 3], "camera_from_radar")
    check_point = _check_point(lines, source=source)
    return ImportedCalibration(
        "kitti",
        written,
        assumptions=() if check_point else (*_of_lidar(key, lines, source), _ASSUMPTION),
        notes=tuple(notes),
        matrix_px=matrix_px,
        check_point=check_point,
        evidence=_evidence(lines.get(_EVIDENCE, "")),
        calibration_sha256=_sha256(lines.get(_SHA256, "")),
        for_raw=_FOR_RAW in lines,
    ).checked(source)


def _of_lidar(key: str, lines: dict[str, str], source: str) -> tuple[str, ...]:
    """Return that the pose is a lidar's by its key, unless the file is ours or lies in a radar's folder."""
    above = [part.lower() for part in Path(source).absolute().parts[:-1]]
    mine = _EVIDENCE in lines or any(_RADAR_FOLDER.fullmatch(part) for part in above)
    return () if mine or not looks_like_lidar(key) else (of_lidar(key),)


def _check_point(lines: dict[str, str], *, source: str) -> StatedCheckPoint | None:
    if _CHECK_POINT not in lines:
        return None
    numbers = numbers_of(lines, _CHECK_POINT, 8, source=source)
    return StatedCheckPoint(numbers[:3], numbers[3:6], rectified_px=numbers[6:])


def _evidence(value: str) -> Evidence | None:
    return next((level for number, level in enumerate(EVIDENCE_LEVELS) if value.strip() == str(number)), None)


def _sha256(value: str) -> str | None:
    words = value.split()
    numbers = [int(word) for word in words if word.isascii() and word.isdigit() and len(word) <= _BYTE_DIGITS]
    if len(words) != _SHA256_BYTES or len(numbers) != _SHA256_BYTES or max(numbers) > 255:
        return None
    return bytes(numbers).hex()


def keyed_lines(text: str, *, source: str) -> dict[str, str]:
    """Return what follows each key.

    Raises:
        InputError: a key appears twice, so that readers disagree on which line counts.
    """
    values: dict[str, str] = {}
    for line in text.splitlines():
        key, colon, value = line.partition(":")
        if not colon or line.lstrip().startswith("#"):
            continue
        if key.strip() in values:
            raise InputError(f"{source}: {key.strip()} appears twice; keep only the intended line")
        values[key.strip()] = value
    return values


def numbers_of(lines: Mapping[str, str], key: str, *shape: int, source: str) -> np.ndarray:
    """Return the numbers after a key.

    Args:
        lines: from `keyed_lines`.
        key: before the colon.
        shape: of the array.
        source: the name of the file in error messages.

    Raises:
        InputError: there is no such line, or it has too few or too many numbers.
    """
    if key not in lines:
        raise InputError(f"{source}: no {key} in it; add that line")
    return np.reshape(floats(lines[key].split(), source=source, place=key, length=math.prod(shape)), shape)


def _offset_m(projection: np.ndarray, *, source: str) -> np.ndarray:
    """Return where the reference camera stands in the frame of camera 2 [m]: P2 = K [I | t].

    Raises:
        InputError: the left part of P2 is not a camera matrix.
    """
    try:
        offset_m: np.ndarray = np.linalg.solve(projection[:, :3], projection[:, 3])
    except np.linalg.LinAlgError:
        raise InputError(f"{source}: P2 is not a projection of a camera; correct it") from None
    return offset_m


KITTI = Format(
    name="kitti",
    title="KITTI and View-of-Delft calibration",
    used_in="Data sets and viewers",
    also="VoD dataset OpenPCDet MMDetection3D",
    numbers="Tr_velo_to_cam carries radar points into the camera; images undistorted",
    file_name="calib.txt",
    camera="matrix",
    pose_for="raw",
    comment="numbers",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
