"""README.txt of a pack: what each file is, what the numbers mean, how far to trust them, and how to run the self-test."""

import textwrap
from collections.abc import Iterator
from dataclasses import fields

from calib_core.interchange.calibration_file import EQUATION, CalibrationFile
from calib_core.interchange.evidence import Evidence
from calib_core.interchange.origin import missing_map, origin_lines
from calib_core.interchange.syntax.yaml_text import numbers_text, quoted
from calib_core.radar import RadarErrors

_WIDTH = 110
_FILES = {
    "calibration.json": "the calibration itself (cocalib/calibration-1): pose, covariance, lens, pairs, warnings, provenance",
    "camera_info.yaml": "the camera as ROS reads it (camera_info_manager, camera_calibration_parsers): K, D, R, P, lens model",
    "tf/static_transform.sh": "ROS 2 command that publishes the camera's pose in the radar frame",
    "tf/radar_camera.launch.py": "the same as a ROS 2 launch file in Python",
    "tf/radar_camera.urdf": "the same as two joints of a robot description; use one of the three files, not several",
    "radar_correction.csv": "what is known of the radar's errors, and the file of its angle map",
    "radar_angle_map.csv": "the radar's angle errors on a grid of directions, one line each",
    "radar_angle_map.npz": "the same as NumPy arrays (rows by elevation, columns by azimuth), no pickle",
    "radar_correction.py": "takes the errors out of reported positions; to be copied into your software (Python, no dependency)",
    "radar_correction.hpp": "the same for C++17, header only",
    "selftest.csv": "ten reported radar positions and their pixels, by the pose alone (raw) and with the errors taken out",
    "selftest.py": "recomputes selftest.csv from the other files (Python 3.8 or later, standard library only)",
    "selftest.cpp": "the same in C++17",
    "README.txt": "this file",
    "SHA256SUMS": "the hash of every other file",
}

_EVIDENCE: dict[Evidence, str] = {
    "clicked": "solved from clicks on a reflector",
    "imported_proven": "read from another tool's file, whose meaning a check point, pairs or another calibration proved",
    "imported_assumed": "read from another tool's file, whose meaning was assumed; check it on a recording before you use it",
    "automatic": "solved from clicks that were placed automatically and that nobody confirmed; look at them before you use it",
}


def readme_text(file: CalibrationFile, names: tuple[str, ...]) -> str:
    """Write the text.

    Args:
        file: the calibration.
        names: of the pack's files, in their order.
    """
    version = " ".join((file.provenance.version or "").split())
    parts = [
        "Radar-camera calibration: deployment pack\n" + "=" * 41,
        f"Written by cocalib{f' {version}' if version else ''}. Nothing in it needs cocalib.",
        _section("The pose", _pose_lines(file)),
        _section("How far to trust it", _trust_lines(file)),
        _section("From a radar return to a pixel", _recipe(file)),
        "Files\n-----\n" + "\n".join(_file_line(name) for name in names),
        "Self-test\n---------\n"
        "    python3 selftest.py\n"
        "    g++ -std=c++17 -O2 selftest.cpp -o selftest && ./selftest\n"
        "    sha256sum -c SHA256SUMS\n\n"
        + _filled(
            "The first two print PASS and return 0 if every pixel is right to a thousandth, else FAIL and 1.", ""
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _pose_lines(file: CalibrationFile) -> Iterator[str]:
    frames, check = file.frames, file.check_point
    pose = file.calibration.camera_from_radar
    yield f"{EQUATION}, metres"
    yield f"radar frame {quoted(frames.radar)}: x forward, y left, z up"
    yield f"camera frame {quoted(frames.camera)} (optical): x right, y down, z forward"
    yield f"R, row by row: {'; '.join(numbers_text(row) for row in pose.rotation)}"
    yield f"t: {numbers_text(pose.translation_m)}"
    if check is not None:
        yield (
            f"check point, a true position: p_radar [{numbers_text(check.radar_m)}] m projects to pixel "
            f"[{numbers_text(check.pixel_px)}] px; pixel (0, 0) is the centre of the top-left pixel"
        )


def _trust_lines(file: CalibrationFile) -> Iterator[str]:
    not_here = missing_map(file.calibration)
    yield from (line for line in origin_lines(file) if line not in not_here)
    yield f"{file.rests_on} means: {_EVIDENCE[file.rests_on]}"
    for warning in file.calibration.warnings:
        yield f"warning {warning.code}: {warning.message}; {warning.hint}"


def _recipe(file: CalibrationFile) -> Iterator[str]:
    errors, grid = file.calibration.radar_errors, file.calibration.angle_map
    yield "1. take the position that the radar reports, in the radar frame"
    if errors == RadarErrors():
        yield "2. radar errors: none known"
    else:
        values = ", ".join(f"{one.name} {getattr(errors, one.name):.6g}" for one in fields(errors))
        yield f"2. take the radar's errors out (radar_correction.py, radar_correction.hpp): {values}"
    if grid is None:
        yield "3. angle map: none, because correcting the angles gains nothing here"
    else:
        yield (
            f"3. correct its angles by the angle map (the same code does it): without it the pairs are {grid.raw_aed_px:.3g} px "
            f"off, with it {grid.corrected_aed_px:.3g} px; it is valid for this mounting only"
        )
    yield "4. apply the pose, then the lens of camera_info.yaml"


def _section(title: str, lines: Iterator[str]) -> str:
    return f"{title}\n{'-' * len(title)}\n" + "\n".join(_filled(line, "  ") for line in lines)


def _file_line(name: str) -> str:
    return _filled(f"{name:<27} {_FILES[name]}", " " * 28)


def _filled(text: str, hanging: str) -> str:
    return textwrap.fill(
        text, _WIDTH, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False, drop_whitespace=True
    )
