"""COLMAP's cameras.txt, which puts the center of the top-left pixel at (0.5, 0.5)."""

from collections.abc import Sequence
from functools import partial

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.file_tag import TAG
from calib_core.interchange.cameras.camera_format import (
    CameraFormat,
    FoundCamera,
    OwnSyntax,
    found_or_refused,
    refuse_skew,
)
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.syntax.yaml_text import numbers_text
from calib_core.lens_models.registry import lenses_named, names_in, written_lens

HALF_PIXEL = 0.5
_ONE_FOCAL = {"SIMPLE_PINHOLE": 0, "SIMPLE_RADIAL": 1, "RADIAL": 2, "SIMPLE_RADIAL_FISHEYE": 1, "RADIAL_FISHEYE": 2}
"""COLMAP's models with one focal length, and how many radial coefficients each has."""


def colmap_camera_line(camera: Camera, number: int = 1) -> str:
    """Write a camera's line of cameras.txt.

    Raises:
        InputError: COLMAP has no model for this camera.
    """
    refuse_skew(camera, "COLMAP's models have")
    lens = written_lens(camera.lens, camera.distortion, "colmap")
    k = camera.matrix_px
    numbers = (k[0, 0], k[1, 1], k[0, 2] + HALF_PIXEL, k[1, 2] + HALF_PIXEL, *lens.coefficients)
    return f"{number} {lens.name} {camera.width_px} {camera.height_px} {numbers_text(numbers, ' ')}\n"


def found_colmap_camera(words: Sequence[str], *, source: str, place: str = "cameras.txt") -> FoundCamera:
    """Read the words of a camera's line.

    Raises:
        InputError: the model is not supported, or a number is missing.
    """
    name = words[1] if len(words) > 1 else ""
    known = (*names_in("colmap"), *_ONE_FOCAL)
    if name not in known:
        raise InputError(f"{source}: {place}: the model {name!r} is not supported; known: {', '.join(known)}")
    width, height, *numbers = (*floats(words[2:], source=source, place=place), *[float("nan")] * 2)[
        : len(words) - 2
    ] or (0, 0)
    if name in _ONE_FOCAL:
        model, numbers = _with_two_focals(name, list(numbers))
    elif len(numbers) < 4:
        raise InputError(f"{source}: {place}: expected at least 4 parameters, found {len(numbers)}; correct it")
    else:
        lenses = lenses_named("colmap", name)
        model = next((lens for lens in lenses if not any(numbers[4 + lens.counts[-1] :])), lenses[-1]).name
    fx, fy, cx, cy, *distortion = numbers
    matrix = (fx, 0.0, cx - HALF_PIXEL, 0.0, fy, cy - HALF_PIXEL, 0.0, 0.0, 1.0)
    return FoundCamera(f"camera {words[0]}", model, matrix, tuple(distortion), (int(width), int(height)))


def _with_two_focals(name: str, numbers: list[float]) -> tuple[str, list[float]]:
    """Convert a model with one focal length: our model, and fx fy cx cy and its coefficients."""
    radial = _ONE_FOCAL[name]
    if len(numbers) != 3 + radial:
        raise InputError(f"cameras.txt: {name} has {3 + radial} parameters, found {len(numbers)}; correct it")
    focal, cx, cy, *coefficients = numbers
    if name.endswith("FISHEYE"):
        return "equidistant", [focal, focal, cx, cy, *coefficients, *[0.0] * (4 - radial)]
    if not radial:
        return "pinhole", [focal, focal, cx, cy]
    return "plumb_bob", [focal, focal, cx, cy, *coefficients, *[0.0] * (4 - radial)]


def _rows(content: str | bytes) -> list[list[str]]:
    lines = content.splitlines() if isinstance(content, str) else []
    return [line.split() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def _recognizes(content: str | bytes) -> bool:
    rows = _rows(content)
    return bool(rows) and all(
        len(row) >= 7 and row[0].isdigit() and row[1].isupper() and row[2].isdigit() for row in rows
    )


def _read(content: str | bytes, source: str) -> tuple[FoundCamera, ...]:
    def found(row: Sequence[str]) -> FoundCamera:
        place = f"camera {row[0]}"
        return found_or_refused(place, partial(found_colmap_camera, row, source=source, place=place))

    return tuple(map(found, _rows(content)))


def _write(camera: Camera, _name: str) -> str:
    columns = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]; the first pixel's center is at (0.5, 0.5)"
    return f"# {TAG}\n{columns}\n{colmap_camera_line(camera)}"


COLMAP_LINES = OwnSyntax(_recognizes, _read)
COLMAP_CAMERAS = CameraFormat("colmap", ".txt", _write)
