"""Files with intrinsics: printed, converted, and written after a calibration."""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import TextIO

from calib_core.camera import Camera
from calib_core.errors import InputError
from cocalib.cli.intrinsics.lens_text import camera_lines
from cocalib.cli.output import write_whole
from cocalib.platform.terminal import print_exactly

CAMERA_SUFFIXES = (".yaml", ".yml", ".json", ".xml", ".cameramodel", ".txt", ".mat", ".bin", ".conf")
_BY_SUFFIX = {".json": "json", ".xml": "opencv-xml", ".cameramodel": "mrcal", ".mat": "matlab"}


def convert_camera(path: Path, *, to: str | None, out: Path | None, size_px: tuple[int, int] | None) -> int:
    """Print the camera in a file, or write it in another format; return the exit code.

    Args:
        path: of the file; "file.yml#cam1" selects one of its cameras.
        to: format to write.
        out: file to write.
        size_px: width and height of pictures to which the camera is rescaled; None to keep its own.
    """
    from calib_core.interchange import CameraFile

    camera = CameraFile.read(path, rescale=size_px is not None).camera(image_size_px=size_px)
    if out is None and to is None:
        print("\n".join([f"{path}", *camera_lines(camera)]))
        return 0
    write_camera(camera, to, out)
    return 0


def write_camera(camera: Camera, to: str | None, out: Path | None, *, told: TextIO | None = None) -> None:
    """Write a camera to a file, or to stdout without one.

    Args:
        camera: the intrinsics.
        to: format; None to take it from the suffix.
        out: the file.
        told: where it is said that it was written; None for stdout.

    Raises:
        InputError: the format cannot hold it, or is binary and there is no file.
    """
    from calib_core.interchange import camera_content

    content = camera_content(camera, camera_format(to, out))
    if out is not None:
        write_whole(out, content)
        print(f"written to {out}", file=told)
    elif isinstance(content, str):
        print_exactly(content)
    else:
        raise InputError(f"--to {to} is a binary format; give the file with --out FILE")


def require_format(to: str | None) -> None:
    """Refuse a format that does not exist.

    Raises:
        InputError: it does not; the message names those that do.
    """
    from calib_core.interchange import CAMERA_FORMATS

    if to is not None and to not in CAMERA_FORMATS:
        near = get_close_matches(to, CAMERA_FORMATS, n=1)
        known = f"did you mean {near[0]}?" if near else f"known: {', '.join(CAMERA_FORMATS)}"
        raise InputError(f"--to {to}: no such format for intrinsics; {known}")


def size_of(text: str) -> tuple[int, int]:
    """Return width and height as typed, such as 1280x720.

    Raises:
        InputError: that is no size.
    """
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if not match or not (int(match[1]) and int(match[2])):
        raise InputError(f"--rescale {text}: give width and height of the pictures, such as 1280x720")
    return int(match[1]), int(match[2])


def camera_format(to: str | None, out: Path | None) -> str:
    """Return the format: as asked for, by the suffix of the file, else ROS camera_info YAML."""
    if to is not None:
        return to
    return _BY_SUFFIX.get(out.suffix.lower(), "ros") if out is not None else "ros"
