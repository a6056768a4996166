"""Read, write, export and check files by path, one call each, for scripts and notebooks."""

from pathlib import Path
from typing import TypeAlias

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import MAX_TEXT_BYTES, read_input, read_text
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, Provenance, VehicleNote
from calib_core.interchange.cameras.files import read_camera_file
from calib_core.interchange.check import report as reports
from calib_core.interchange.check.agreement import AgreementLimits
from calib_core.interchange.check.pair_residuals import read_check_pairs_file
from calib_core.interchange.exporting import Export
from calib_core.interchange.exporting import export as export_file
from calib_core.interchange.format import ImportedCalibration, PoseFor, imported
from calib_core.interchange.importing import read_any_file
from calib_core.interchange.own import calibration_json, clicks_json, pairs_files
from calib_core.interchange.pair_tables import read_pair_table
from calib_core.measurements import ReflectorClick
from calib_core.options import NoiseOptions
from calib_core.results import Calibration

PathLike: TypeAlias = str | Path


def read_camera(path: PathLike, *, image_size_px: tuple[int, int] | None = None) -> Camera:
    """Read intrinsics: ROS camera_info YAML, OpenCV YAML or XML, Kalibr camchain, or our own JSON.

    Args:
        path: of the file; "file.yml#cam1" selects one of several cameras.
        image_size_px: width and height, used if the file does not state them.

    Raises:
        InputError: the file cannot be read, or contains no camera.
    """
    return read_camera_file(path, image_size_px=image_size_px)


def read_pairs(
    path: PathLike, camera: Camera | None = None, *, noise: NoiseOptions | None = None
) -> pairs_files.PairsFile:
    """Read a pairs-1 file (pairs, camera and, if stated, noise and camera position), or a table of pairs (CSV, npy, npz).

    Args:
        path: of the file.
        camera: the camera that the pixels of a table are of; None for pairs-1, which brings its own.
        noise: used where the file states none; None uses the defaults.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    if camera is not None:
        data = read_input(Path(path), max_bytes=MAX_TEXT_BYTES, is_what="a table of pairs")
        return read_pair_table(data, source=str(path)).pairs(camera, noise, source=str(path))
    return pairs_files.read_pairs(_text(path), str(path), noise=noise)


def write_pairs(path: PathLike, pairs_file: pairs_files.PairsFile) -> None:
    """Write a pairs-1 file.

    Raises:
        InputError: the file cannot be written.
    """
    _write(path, pairs_files.write_pairs(pairs_file))


def read_clicks(path: PathLike) -> tuple[ReflectorClick, ...]:
    """Read a clicks-1 file.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    return tuple(clicks_json.read_clicks(_text(path), str(path)))


def write_clicks(path: PathLike, clicks: tuple[ReflectorClick, ...]) -> None:
    """Write a clicks-1 file.

    Raises:
        InputError: the file cannot be written.
    """
    _write(path, clicks_json.write_clicks(clicks))


def read_calibration(path: PathLike) -> CalibrationFile:
    """Read a calibration-1 file.

    Raises:
        InputError: invalid content, or transforms that disagree; the message names the file, the place and what to do.
    """
    return calibration_json.read_calibration(_text(path), str(path))


def write_calibration(
    path: PathLike,
    calibration: Calibration | CalibrationFile,
    *,
    frames: FrameNames | None = None,
    provenance: Provenance | None = None,
    vehicle: VehicleNote | None = None,
) -> None:
    """Write a calibration-1 file; the same calibration gives the same bytes.

    Args:
        path: of the file to write.
        calibration: a result of the solver, or the content of a file, which is written unchanged.
        frames: names of the two frames, for a result; None uses "radar" and "camera_optical".
        provenance: where a result comes from.
        vehicle: which vehicle a result is of; None if nobody said.

    Raises:
        InputError: the file cannot be written.
    """
    text = (
        calibration_json.calibration_text(calibration, frames, provenance, vehicle=vehicle)
        if isinstance(calibration, Calibration)
        else calibration_json.write_calibration(calibration)
    )
    _write(path, text)


def export(
    calibration: Calibration | CalibrationFile,
    name: str,
    *,
    frames: FrameNames | None = None,
    rectified: bool = False,
    returns: PoseFor | None = None,
) -> Export:
    """Export a calibration to the format of another tool.

    Args:
        calibration: a result of the solver, or the content of a file.
        name: of the format, such as "tf2", "urdf", "kalibr", "opencv" or "kitti".
        frames: names of the two frames, for a result; None uses "radar" and "camera_optical".
        rectified: the images are undistorted with this same camera matrix; see the notes of "kitti" and "nuscenes".
        returns: "raw" writes the pose for radar data as reported, "corrected" the calibration's own; None what the format is for.

    Raises:
        InputError: no such format, or it cannot represent this calibration; the message says why and what to use instead.
    """
    file = (
        calibration_json.calibration_file(calibration, frames) if isinstance(calibration, Calibration) else calibration
    )
    return export_file(file, name, rectified=rectified, returns=returns)


def check(
    calibration: PathLike | Calibration | CalibrationFile,
    *,
    against: PathLike | Calibration | CalibrationFile | None = None,
    camera: Camera | None = None,
    pairs: PathLike | None = None,
    of: PathLike | Calibration | CalibrationFile | None = None,
    limits: AgreementLimits | None = None,
    same_sensors: bool = False,
    same_person: bool = False,
) -> reports.CheckReport:
    """Check a calibration against its check point, another calibration and pairs, and for plausibility.

    Args:
        calibration: a file of any format that can be read, or a result.
        against: a calibration of the same sensors that is known to be right.
        camera: the intrinsics, if the file has none.
        pairs: a pairs-1 or calibration-1 file: radar positions and the pixels where they were seen.
        of: the calibration that the file should have been made from: is it that calibration's file?
        limits: what counts as agreement with `against`; None judges by the covariances.
        same_sensors: radar and camera of `against` are the same, whatever serials, topics and intrinsics say.
        same_person: the same person clicked the same reflector in both.

    Raises:
        InputError: a file cannot be read, or contains no pose, or a limit cannot be tested with these files.
    """
    return reports.check(
        _imported(calibration),
        against=None if against is None else _imported(against),
        camera=camera,
        pairs=None if pairs is None else read_check_pairs_file(Path(pairs)),
        of=None if of is None else _imported(of),
        limits=limits,
        same_sensors=same_sensors,
        same_person=same_person,
    )


def _imported(calibration: PathLike | Calibration | CalibrationFile) -> ImportedCalibration:
    if isinstance(calibration, str | Path):
        return read_any_file(calibration)
    if isinstance(calibration, Calibration):
        calibration = calibration_json.calibration_file(calibration)
    return imported(calibration)


def _text(path: PathLike) -> str:
    return read_text(Path(path), is_what="one of cocalib's files")


def _write(path: PathLike, text: str) -> None:
    try:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); check the path") from None
