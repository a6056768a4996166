"""What every file states, in comments or in keys: both frames, the equation, the order, the check point, the origin."""

import json
import re
from dataclasses import fields, replace

import numpy as np

from calib_core.interchange.calibration_file import EQUATION, CalibrationFile, FrameNames
from calib_core.interchange.imported import ImportedCalibration, StatedCheckPoint
from calib_core.interchange.origin import origin_lines, stated_origin
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.radar import RadarErrors

POSE_ONLY = "contains the pose only: keep your camera_info, or also export opencv, which contains the camera"
"""A note for every format that stores nothing of the camera."""

STATEMENT_KEY = "cocalib"
"""The key of the statement in formats that have keys but no comments, and whose readers ignore unknown keys."""

_OF_RECTIFIED = " of the rectified picture"
_STRING = r'"(?:[^"\\]|\\.)*"'
_FRAMES = re.compile(rf"radar frame ({_STRING}) \(.*?\), camera frame ({_STRING}) \(")
_CHECK_POINT = re.compile(
    r"check point: p_radar \[([^\]]*)\] m -> p_camera \[([^\]]*)\] m"
    rf"(?: -> pixel \[([^\]]*)\] px({_OF_RECTIFIED})?)?"
)


def statement(file: CalibrationFile, meaning: str, *, rectified: bool = False) -> tuple[str, ...]:
    """Return what a file states about itself: the comment at its top, or the value of a key, one line each.

    Args:
        file: what is exported.
        meaning: what the numbers of this format mean, with the order of the quaternion or the angles.
        rectified: the format is for rectified pictures, so the check point's pixel is one of theirs.
    """
    frames = file.frames
    lines = [
        f"{EQUATION} with radar frame {quoted(frames.radar)} (x forward, y left, z up), "
        f"camera frame {quoted(frames.camera)} (optical: x right, y down, z forward), metres",
        meaning,
    ]
    check = file.check_point
    if check is not None:
        point_camera_m = file.calibration.camera_from_radar @ check.radar_m[None]
        lines.append(
            f"check point: p_radar [{numbers_text(check.radar_m)}] m -> p_camera [{numbers_text(point_camera_m[0])}] m"
            f" -> pixel [{numbers_text(check.pixel_px)}] px{_OF_RECTIFIED if rectified else ''}"
        )
    errors = file.calibration.radar_errors
    if errors != RadarErrors():
        lines.append(
            "p_radar is a true position; first take the radar's errors out of a reported one, as in docs/formats.md: "
            + ", ".join(f"{one.name} {getattr(errors, one.name):.6g}" for one in fields(errors))
        )
    lines += origin_lines(file)
    # The version in a file may be any text; the frame names are checked and kept unchanged, including spaces.
    version = " ".join((file.provenance.version or "").split())
    lines.append(f"cocalib{f' {version}' if version else ''}: read it back with: cocalib check THIS_FILE")
    return tuple(lines)


def hash_comment(lines: tuple[str, ...]) -> str:
    """Return lines as comments of YAML, shell, Python and plain text."""
    return "".join(f"# {line}\n" for line in lines)


def xml_comment(lines: tuple[str, ...]) -> str:
    """Return lines as one XML comment, which must not contain two adjacent hyphens; JSON decodes the second one in the names."""
    body = "\n     ".join(lines).replace("--", "-\\u002d")
    return f"<!-- {body} -->\n"


def stated_lines(value: object) -> str:
    """Return the statement in a key: a text, or a list or an array of lines; "" if it is something else."""
    if isinstance(value, str):
        return value
    lines = value.ravel().tolist() if isinstance(value, np.ndarray) else value
    return "\n".join(line for line in lines if isinstance(line, str)) if isinstance(lines, list) else ""


def with_statement(found: ImportedCalibration, text: str) -> ImportedCalibration:
    """Add what a file states in a key; where it names the frames, nothing about them had to be assumed."""
    frames, origin = stated_frames(text), stated_origin(text)
    return replace(
        found,
        frames=found.frames or frames,
        check_point=found.check_point or stated_check_point(text),
        assumptions=() if frames else found.assumptions,
        evidence=origin.evidence,
        calibration_sha256=origin.calibration_sha256,
    )


def stated_frames(text: str) -> FrameNames | None:
    """Find the two frame names in a file's comment."""
    match = _FRAMES.search(text)
    try:
        return FrameNames(json.loads(match[1]), json.loads(match[2])) if match else None
    except ValueError:
        return None


def stated_check_point(text: str) -> StatedCheckPoint | None:
    """Find the check point in a file's comment."""
    match = _CHECK_POINT.search(text)
    if match is None:
        return None
    try:
        radar_m, camera_m = (np.array(match[i].split(","), dtype=np.float64) for i in (1, 2))
        pixel_px = np.array(match[3].split(","), dtype=np.float64) if match[3] else None
        if match[4]:
            return StatedCheckPoint(radar_m, camera_m, rectified_px=pixel_px)
        return StatedCheckPoint(radar_m, camera_m, pixel_px)
    except ValueError:
        return None
