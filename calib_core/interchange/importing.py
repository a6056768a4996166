"""Read a calibration in any known format."""

from dataclasses import replace
from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import read_input
from calib_core.interchange.formats.registry import readers
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.origin import stated_origin
from calib_core.interchange.syntax.content import Content, readings

__all__ = ["calibration_bytes", "read_any", "read_any_file"]

_MAX_BYTES = 256 * 1024 * 1024
_KNOWN = (
    "known: calibration-1, static_transform_publisher in a command or launch file, URDF, Autoware, Apollo and "
    "stamped transforms, Kalibr with T_cam_radar, OpenCV with R and T, KITTI, nuScenes, DriveWorks, Foxglove, "
    "COLMAP, mat, npz, matrix"
)

_OTHERS = "; a pose that states nothing: cocalib import FILE lists what its numbers may mean"


def read_any_file(path: str | Path) -> ImportedCalibration:
    """Read a calibration from a file of any format in the registry.

    Raises:
        InputError: the file cannot be read, or contains no pose.
    """
    return read_any(calibration_bytes(path), str(Path(path)))


def calibration_bytes(path: str | Path) -> bytes:
    """Return the content of a file, for callers that need more of it than `read_any` returns.

    Raises:
        InputError: it cannot be read, or is too large for a calibration.
    """
    file = Path(path)
    try:
        return read_input(file, max_bytes=_MAX_BYTES, is_what="a calibration")
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error}); check the path") from None


def read_any(content: str | bytes, source: str = "calibration") -> ImportedCalibration:
    """Read a calibration from the content of a file of any format in the registry; the content determines the format.

    Raises:
        InputError: it contains no pose in a known format; the message says what was looked for.
    """
    try:
        return _read(content, source)
    except InputError as error:
        if str(error).startswith(f"{source}: "):
            raise
        raise InputError(f"{source}: {error}") from None  # FrameNames refuses a name without knowing the file


def _read(content: str | bytes, source: str) -> ImportedCalibration:
    seen = []
    for reading in readings(content, source=source):
        for reader in readers():
            if reader.recognizes(reading):
                return _with_origin(reader.read(reading, source), reading)
        seen.append(reading)
    raise _refusal(seen[-1], source)


def _with_origin(found: ImportedCalibration, content: Content) -> ImportedCalibration:
    """Add what the text says about the calibration that the file was made from, unless the reader found it in a key."""
    if found.file is not None or found.evidence is not None or content.syntax == "bytes":
        return found
    origin = stated_origin(content.text)
    return replace(found, evidence=origin.evidence, calibration_sha256=origin.calibration_sha256)


def _refusal(content: Content, source: str) -> InputError:
    """Return the error for a file that no format recognizes, with what is in it."""
    if content.syntax == "bytes":
        return InputError(f"{source}: neither text nor an archive; {_KNOWN}")
    if content.syntax == "xml" and content.value is None:
        return InputError(f"{source}: XML with <{content.root.tag}>; expected OpenCV's <opencv_storage>")
    value = content.value
    found = ", ".join(map(str, list(value)[:12])) if isinstance(value, dict) else type(value).__name__
    return InputError(
        f"{source}: no pose of a camera and a radar in it (found {found or 'nothing'}); {_KNOWN}{_OTHERS}"
    )
