"""The deployment pack as a format: one zip archive, written from the other formats, read back through its manifest.

Below are its files: the manifest, the radar's corrections, the points of the self-test, the README.
"""

import hashlib
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from importlib.resources import files

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EQUATION, CalibrationFile, Evidence
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.format import Format, ImportedCalibration, Reads
from calib_core.interchange.formats.statement import missing_map, origin_lines
from calib_core.interchange.formats.static_transform import TF2, TF2_LAUNCH_PY
from calib_core.interchange.formats.urdf import URDF
from calib_core.interchange.own.calibration_json import CALIBRATION_1, write_calibration
from calib_core.interchange.syntax.content import Content, readings
from calib_core.interchange.syntax.yaml_text import number_text, numbers_text, quoted
from calib_core.interchange.syntax.zip_archives import pack, pack_arrays
from calib_core.radar import AngleMap, RadarErrors, polar_from_cartesian
from calib_core.results import Calibration

_CALIBRATION = "calibration.json"
_README = "README.txt"
_TRANSFORMS = (TF2, TF2_LAUNCH_PY, URDF)
_LENSES_OF_THE_SELFTEST = ("pinhole", "plumb_bob", "rational_polynomial", "equidistant")
_DELIVERED = ("radar_correction.py", "radar_correction.hpp", "selftest.py", "selftest.cpp")
_NOTES = (
    "one zip archive, which --out FOLDER writes unpacked; its README.txt says what each file is; "
    "run python3 selftest.py on the robot",
)


def _write(file: CalibrationFile) -> bytes:
    """Write all files of the pack, zipped.

    Raises:
        InputError: the self-test does not know this lens, or a file cannot represent this calibration.
    """
    file = replace(file, made_from_sha256="")  # the pack holds the calibration that its files are made from
    calibration = file.calibration
    if calibration.camera.model not in _LENSES_OF_THE_SELFTEST:
        raise InputError(
            f"the pack's self-test cannot project through the lens model {calibration.camera.model} (it knows "
            f"{', '.join(_LENSES_OF_THE_SELFTEST)}); export json, which stores every lens"
        )
    members = {
        _CALIBRATION: write_calibration(file).encode(),
        "camera_info.yaml": camera_info_text(calibration.camera).encode(),
        **{f"tf/{form.file_name}": _text(form, file) for form in _TRANSFORMS},
        **correction_files(calibration),
        "selftest.csv": selftest_csv(calibration).encode(),
        **{name: _delivered(name) for name in _DELIVERED},
    }
    members = {_README: readme_text(file, (_README, *members, MANIFEST)).encode(), **members}
    return pack({**members, MANIFEST: manifest_text(members).encode()})


def _text(form: Format, file: CalibrationFile) -> bytes:
    content = form.write(file) if form.write is not None else ""
    return content.encode() if isinstance(content, str) else content


def _delivered(name: str) -> bytes:
    """Return code that is the same in every pack; line ends do not depend on the machine."""
    code = files("calib_core.interchange.formats.delivered").joinpath(name).read_bytes()
    return code.replace(b"\r\n", b"\n")


def _recognizes(content: Content) -> bool:
    return _CALIBRATION in _files(content.members)


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the calibration in a pack whose files are those of its manifest.

    Raises:
        InputError: a file is missing, changed or not listed, or calibration.json is not calibration-1.
    """
    members = _files(content.members)
    verify(members, source=source)
    data = members[_CALIBRATION]
    own = next(readings(data, source=f"{source}: {_CALIBRATION}"))
    if CALIBRATION_1.reads is None or not CALIBRATION_1.reads.recognizes(own):
        raise InputError(f"{source}: {_CALIBRATION} is not cocalib/calibration-1; export the pack again")
    found = CALIBRATION_1.reads.read(own, f"{source}: {_CALIBRATION}")
    return replace(found, format=PACK.name, calibration_sha256=hashlib.sha256(data).hexdigest())


def _files(members: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files of an archive by their path in the pack; it may have been zipped again with its folder."""
    found = {name: data for name, data in members.items() if not name.endswith("/")}
    folders = {name.partition("/")[0] for name in found}
    inside = f"{folders.pop()}/" if len(folders) == 1 and all("/" in name for name in found) else ""
    return {name.removeprefix(inside): data for name, data in found.items()}


PACK = Format(
    name="pack",
    title="Deployment pack: pose, camera_info, tf, angle map, self-test",
    used_in="cocalib",
    also="deploy zip robot self-test C++ Python",
    numbers="calibration.json: camera_from_radar and its inverse; tf/: pose of the child (camera, optical) in the parent (radar)",
    file_name="radar_camera_pack.zip",
    camera="lens",
    comment="keys",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
    holds_corrections=True,
    is_unpacked=True,
)


MANIFEST = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64}) [ *](.+)")


def manifest_text(members: Mapping[str, bytes]) -> str:
    """Return the manifest of a pack's other files, one line each, in their order."""
    return "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in members.items())


def verify(members: Mapping[str, bytes], *, source: str) -> None:
    """Verify the files of a pack against its manifest.

    Args:
        members: all files by name, the manifest among them.
        source: the name of the pack in error messages.

    Raises:
        InputError: the manifest is missing or unreadable, or a file is missing, changed or not listed.
    """
    if MANIFEST not in members:
        raise InputError(f"{source}: {MANIFEST} is missing, so its files cannot be verified; export the pack again")
    stated = {}
    for line in members[MANIFEST].decode("utf-8", errors="replace").splitlines():
        match = _LINE.fullmatch(line)
        if match is None:
            raise InputError(f"{source}: {MANIFEST}: a line is not a hash and a file name; export the pack again")
        stated[match[2]] = match[1]
    for name in sorted({*stated, *members} - {MANIFEST}):
        if name not in members:
            raise InputError(f"{source}: {name} is missing, which {MANIFEST} lists; export the pack again")
        if name not in stated:
            raise InputError(f"{source}: {name} is not listed in {MANIFEST}; remove it or export the pack again")
        if hashlib.sha256(members[name]).hexdigest() != stated[name]:
            raise InputError(
                f"{source}: {name} was changed after the export ({MANIFEST} has another hash); export the pack again"
            )


_MAP_CSV = "radar_angle_map.csv"
_MAP_NPZ = "radar_angle_map.npz"


def correction_files(calibration: Calibration) -> dict[str, bytes]:
    """Return the files that radar_correction.py and radar_correction.hpp read; the map's only if there is a map."""
    grid, errors = calibration.angle_map, calibration.radar_errors
    rows = [f"{one.name},{number_text(getattr(errors, one.name))}" for one in fields(errors)]
    rows.append(f"angle_map,{'none' if grid is None else _MAP_CSV}")
    files = {"radar_correction.csv": "\n".join(["name,value", *rows, ""]).encode()}
    if grid is not None:
        files |= {_MAP_CSV: _map_csv(grid).encode(), _MAP_NPZ: _map_npz(grid)}
    return files


def _tables(grid: AngleMap) -> dict[str, np.ndarray]:
    """Return the tables by their names in calibration-1: rows by elevation, columns by azimuth."""
    add, sigma = grid.correction_rad, grid.sigma_rad
    return {
        "add_azimuth_rad": add[:, :, 0],
        "add_elevation_rad": add[:, :, 1],
        "sigma_azimuth_rad": sigma[:, :, 0],
        "sigma_elevation_rad": sigma[:, :, 1],
    }


def _map_csv(grid: AngleMap) -> str:
    """Write one line for each direction of the grid, row by row."""
    tables = _tables(grid)
    lines = [",".join(["elevation_rad", "azimuth_rad", *tables])]
    for i, elevation_rad in enumerate(grid.elevation_rad):
        for j, azimuth_rad in enumerate(grid.azimuth_rad):
            numbers = (elevation_rad, azimuth_rad, *(table[i, j] for table in tables.values()))
            lines.append(",".join(map(number_text, numbers)))
    return "\n".join([*lines, ""])


def _map_npz(grid: AngleMap) -> bytes:
    arrays = {
        "azimuth_rad": grid.azimuth_rad,
        "elevation_rad": grid.elevation_rad,
        **_tables(grid),
        "aed_px": np.array(grid.raw_aed_px),
        "corrected_aed_px": np.array(grid.corrected_aed_px),
    }
    return pack_arrays({name: np.ascontiguousarray(array) for name, array in arrays.items()})


_POINTS = 10
_PICTURE_SHARES = (0.06, 0.28, 0.5, 0.72, 0.94)
_RANGES_M = (4.0, 8.0, 15.0, 30.0, 60.0, 11.0, 22.0)  # as many as have no divisor in common with the rows and columns
_SAME = 1e-3
_COLUMNS = "x_m,y_m,z_m,u_raw_px,v_raw_px,u_px,v_px"


def selftest_csv(calibration: Calibration) -> str:
    """Write ten reported radar positions, their pixels by the pose alone, and with the radar's errors taken out.

    They are inliers spread over directions and ranges; where there are fewer than ten, points spread over the picture follow.

    Raises:
        InputError: the lens images no point.
    """
    inliers = sorted((pair for pair in calibration.pairs if pair.inlier), key=lambda pair: pair.id)
    measured_m = np.round(np.array([pair.point_radar_m for pair in inliers]).reshape(-1, 3), 3)
    over_the_picture_m = _points_over_the_picture(calibration)
    points_radar_m = np.zeros((0, 3))
    for candidates_m in (measured_m[_imaged(calibration, measured_m)], over_the_picture_m):
        points_radar_m = _spread(points_radar_m, candidates_m)
    if not len(points_radar_m):
        raise InputError(
            "the lens images no point of the picture, so the pack's self-test has nothing to project; correct the camera, "
            "or export json"
        )
    raw_px, corrected_px = _pixels(calibration, points_radar_m)
    rows = np.hstack([points_radar_m, raw_px, corrected_px])
    return "\n".join([_COLUMNS, *(",".join(map(number_text, row)) for row in rows), ""])


def _pixels(calibration: Calibration, points_radar_m: Points3) -> tuple[Points2, Points2]:
    """Return the pixels of reported positions by the pose alone, and with the radar's errors taken out."""
    true_m = calibration.radar_errors.corrected(points_radar_m)
    if calibration.angle_map is not None:
        true_m = calibration.angle_map.corrected(true_m)
    pose, camera = calibration.camera_from_radar, calibration.camera
    return camera.project(pose @ points_radar_m), camera.project(pose @ true_m)


def _points_over_the_picture(calibration: Calibration) -> Points3:
    """Return points at several ranges on a grid of pixels that the lens images; the corrected ones may be outside the picture."""
    camera = calibration.camera
    u, v = np.meshgrid(np.array(_PICTURE_SHARES) * camera.width_px, np.array(_PICTURE_SHARES) * camera.height_px)
    rays = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
    points_camera_m = rays * np.resize(_RANGES_M, len(rays))[:, None]
    points_radar_m = np.round(calibration.camera_from_radar.inverse() @ points_camera_m, 3)
    return points_radar_m[_imaged(calibration, points_radar_m)]


def _imaged(calibration: Calibration, points_radar_m: Points3) -> Flags:
    """Return which reported positions the lens images by the pose alone, and project to a pixel when corrected, too."""
    raw_px, corrected_px = _pixels(calibration, points_radar_m)
    seen = calibration.camera.sees(calibration.camera_from_radar @ points_radar_m)
    return seen & np.isfinite(raw_px).all(axis=1) & np.isfinite(corrected_px).all(axis=1)


def _spread(chosen_m: Points3, candidates_m: Points3) -> Points3:
    """Add to the chosen points those candidates that are farthest from all chosen so far, until there are ten."""
    points_m = np.vstack([chosen_m, candidates_m])
    polar = polar_from_cartesian(points_m)
    places = np.column_stack([np.log(np.maximum(polar[:, 0], 1e-6)) / 2.0, polar[:, 1:]])
    indices: Indices = np.arange(len(chosen_m))
    while len(indices) < min(_POINTS, len(points_m)):
        if len(indices):
            distances = np.linalg.norm(places[:, None] - places[indices], axis=2).min(axis=1)
        else:
            distances = np.linalg.norm(places - places.mean(axis=0), axis=1) + _SAME
        farthest = int(np.argmax(distances))
        if distances[farthest] < _SAME:
            break
        indices = np.append(indices, farthest)
    return points_m[indices]


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
