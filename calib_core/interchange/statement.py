"""What every file states, in comments or in keys: both frames, the equation, the order, the check point, the origin.

The origin is what an exported file says of the calibration that it was made from: evidence, hash, figures, verdict, and what it
cannot hold. At most six lines.
"""

import re
from dataclasses import dataclass, fields, replace

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EQUATION, CalibrationFile, Evidence, FrameNames, stated_evidence
from calib_core.interchange.format import ImportedCalibration, StatedCheckPoint
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.own.raw_data import aed_either_way
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.parsing import json_value
from calib_core.radar import RadarErrors
from calib_core.results import Calibration

POSE_ONLY = "contains the pose only: keep your camera_info, or also export opencv, which contains the camera"
"""A note for every format that stores nothing of the camera."""

STATEMENT_KEY = "cocalib"
"""The key of the statement in formats that have keys but no comments, and whose readers ignore unknown keys."""

_OF_RECTIFIED = " of the rectified image"
_STRING = r'"(?:[^"\\]|\\.)*"'
_FRAMES = re.compile(rf"radar frame ({_STRING}) \(.*?\), camera frame ({_STRING}) \(")

_CHECK_POINT = re.compile(
    r"check point: p_radar \[([^\]]*)\] m -> p_camera \[([^\]]*)\] m"
    rf"(?: -> pixel \[([^\]]*)\] px({_OF_RECTIFIED})?)?"
)

_FOR_RAW = "FOR RADAR DATA AS REPORTED"
_ORIGIN = re.compile(r"evidence: ([^;\s]+); from the calibration with sha256 ([0-9a-f]{64})")


def statement(file: CalibrationFile, meaning: str, *, rectified: bool = False) -> tuple[str, ...]:
    """Return what a file states about itself: the comment at its top, or the value of a key, one line each.

    Args:
        file: what is exported.
        meaning: what the numbers of this format mean, with the order of the quaternion or the angles.
        rectified: the format is for rectified images, so the check point's pixel is one of theirs.
    """
    frames = file.frames
    lines = [
        f"{EQUATION} with radar frame {quoted(frames.radar)} (x forward, y left, z up), "
        f"camera frame {quoted(frames.camera)} (optical: x right, y down, z forward), meters; {meaning}",
    ]
    check = file.check_point
    if check is not None:
        point_camera_m = file.calibration.camera_from_radar @ check.radar_m[None]
        lines.append(
            f"check point: p_radar [{numbers_text(check.radar_m)}] m -> p_camera [{numbers_text(point_camera_m[0])}] m"
            f" -> pixel [{numbers_text(check.pixel_px)}] px{_OF_RECTIFIED if rectified else ''}"
        )
    origin = f"evidence: {file.rests_on}; from the calibration with sha256 {calibration_sha256(file)}"
    returns = (*_for_which_returns(file), *missing_map(file.calibration))
    parts = ((origin, *_figures(file.calibration)), returns, _verdict(file))
    lines += ["; ".join(each) for each in parts if each]
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


def with_statement(imported: ImportedCalibration, text: str) -> ImportedCalibration:
    """Add what a file states in a key; where it names the frames, nothing about them had to be assumed."""
    frames, origin = stated_frames(text), stated_origin(text)
    return replace(
        imported,
        frames=imported.frames or frames,
        check_point=imported.check_point or stated_check_point(text),
        assumptions=() if frames else imported.assumptions,
        evidence=origin.evidence,
        calibration_sha256=origin.calibration_sha256,
        for_raw=origin.for_raw,
    )


def stated_frames(text: str) -> FrameNames | None:
    """Find the two frame names in a file's comment."""
    match = _FRAMES.search(text)
    try:
        return FrameNames(*(json_value(name, source="") for name in match.groups())) if match else None
    except InputError:
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


@dataclass(frozen=True, slots=True)
class Origin:
    """What an exported file states about where it comes from.

    Attributes:
        evidence: what the pose rests on; None if it states none.
        calibration_sha256: of the calibration-1 file that it was made from; None if it states none.
        for_raw: whether its pose is for radar data as reported.
    """

    evidence: Evidence | None = None
    calibration_sha256: str | None = None
    for_raw: bool = False


def missing_map(calibration: Calibration) -> tuple[str, ...]:
    """Return the line about the angle map that only calibration-1 holds; nothing if there is no map."""
    grid = calibration.angle_map
    if grid is None:
        return ()
    return (
        f"NOT IN THIS FILE: the radar's angle map. Without it the pairs are {grid.raw_aed_px:.3g} px off, with it "
        f"{grid.corrected_aed_px:.3g} px; take radar_angle_map from calibration.json",
    )


def _for_which_returns(file: CalibrationFile) -> tuple[str, ...]:
    """Return which radar data the pose is for, with the AED either way; nothing if the radar has no corrections."""
    either = aed_either_way(file)
    if file.corrected is not None:
        means = f"AED {either[0]:.3g} px; with the corrections {either[1]:.3g} px" if either else ""
        return (f"{_FOR_RAW}: the pose was solved without taking out what the radar gets wrong, {means}",)
    errors = file.calibration.radar_errors
    if errors == RadarErrors():
        return ()
    values = ", ".join(f"{entry.name} {getattr(errors, entry.name):.6g}" for entry in fields(errors))
    first = (
        "for corrected radar data: p_radar is a true position; first take the radar's errors out of a reported one, as in "
        f"docs/formats.md (Files and formats under Help): {values}"
    )
    return (first, f"without the corrections AED {either[1]:.3g} instead of {either[0]:.3g} px") if either else (first,)


def stated_origin(text: str) -> Origin:
    """Find the evidence and the calibration's hash in a file's text."""
    match = _ORIGIN.search(text)
    return Origin(stated_evidence(match[1]), match[2], f"{_FOR_RAW}: " in text) if match else Origin()


def _figures(calibration: Calibration) -> tuple[str, ...]:
    metrics, parts = calibration.metrics, []
    if np.isfinite(metrics.aed_px):
        held_out = f", held-out {metrics.held_out_aed_px:.3g} px" if np.isfinite(metrics.held_out_aed_px) else ""
        parts.append(f"AED {metrics.aed_px:.3g} px over {metrics.n} pairs{held_out}")
    variances = np.diag(calibration.covariance)
    if np.isfinite(variances).all() and (variances >= 0).all():
        sigma = np.sqrt(variances)
        cm, deg = (", ".join(f"{value:.2g}" for value in part) for part in (sigma[:3] * 100, np.degrees(sigma[3:])))
        parts.append(f"sigma of camera_from_radar in camera axes: x, y, z {cm} cm; rotX, rotY, rotZ {deg} deg")
    return tuple(parts)


def _verdict(file: CalibrationFile) -> tuple[str, ...]:
    if file.verdict is None:
        return ()
    assuming = (f"assuming: {_one_line(file.verdict.assumes)}",) if file.verdict.assumes else ()
    return (f"verdict: {file.verdict.level}, {_one_line(file.verdict.reason)}", *assuming)


def _one_line(text: str) -> str:
    return " ".join(text.split())
