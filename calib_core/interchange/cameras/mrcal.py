"""mrcal's cameramodel: a dictionary in Python's syntax. Pixels count as ours do, from the center of the first one."""

import ast
from collections.abc import Mapping
from typing import Any

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import HASH_TAG, CameraFormat, FoundCamera, OwnSyntax, refuse_skew
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.syntax.yaml_text import numbers_text
from calib_core.parsing import python_tree

_COEFFICIENTS = {"LENSMODEL_PINHOLE": 0, "LENSMODEL_OPENCV4": 4, "LENSMODEL_OPENCV5": 5, "LENSMODEL_OPENCV8": 8}
_MODELS = {0: "pinhole", 4: "plumb_bob", 5: "plumb_bob", 8: "rational_polynomial"}
_SOLVABLE = "calibrate with LENSMODEL_OPENCV8, or convert it with mrcal-convert-lensmodel"


def _write(camera: Camera, _name: str) -> str:
    refuse_skew(camera, "mrcal's models have")
    if not camera.lens.is_perspective:
        raise InputError(
            f"mrcal has no name for the lens model {camera.model}; write ros, kalibr, opencv, colmap or json"
        )
    count = next((count for count in (0, 4, 5, 8) if not any(camera.distortion[count:].tolist())), None)
    if count is None or camera.model not in (*_MODELS.values(),):
        raise InputError(f"mrcal has no name for the lens model {camera.model}; write json")
    name = next(name for name, known in _COEFFICIENTS.items() if known == count)
    k = camera.matrix_px
    padded = [*camera.distortion.tolist(), *[0.0] * 8][:count]
    numbers = numbers_text((k[0, 0], k[1, 1], k[0, 2], k[1, 2], *padded))
    return (
        "{\n"
        f"    'lensmodel':  '{name}',\n\n"
        "    # fx,fy,cx,cy and the coefficients in OpenCV's order\n"
        f"    'intrinsics': [ {numbers} ],\n\n"
        "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n\n"
        f"    'imagersize': [ {camera.width_px}, {camera.height_px} ]\n"
        "}\n"
    )


def _recognizes(content: str | bytes) -> bool:
    return isinstance(content, str) and "LENSMODEL_" in content and "imagersize" in content


def _read(content: str | bytes, source: str) -> tuple[FoundCamera, ...]:
    values = _dictionary(str(content), source=source)
    name = str(values.get("lensmodel", values.get("lens_model", "")))
    numbers = floats(values.get("intrinsics", ()), source=source, place="intrinsics")
    size = floats(values.get("imagersize", ()), source=source, place="imagersize", length=2)
    if name.startswith("LENSMODEL_OPENCV") and len(numbers) > 12 and not any(numbers[12:]):
        name, numbers = "LENSMODEL_OPENCV8", numbers[:12]
    if name not in _COEFFICIENTS:
        raise InputError(f"{source}: lensmodel: {name or 'missing'} is not supported; {_SOLVABLE}")
    count = _COEFFICIENTS[name]
    if len(numbers) != 4 + count:
        raise InputError(f"{source}: intrinsics: {name} has {4 + count} numbers, found {len(numbers)}; correct it")
    fx, fy, cx, cy = numbers[:4]
    matrix = (fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    return (FoundCamera("camera", _MODELS[count], matrix, numbers[4:], (int(size[0]), int(size[1]))),)


def _dictionary(text: str, *, source: str) -> Mapping[str, Any]:
    """Parse a dictionary of literals; nothing in it is evaluated."""
    try:
        values = ast.literal_eval(python_tree(text.strip(), source=source, mode="eval"))
    except (ValueError, TypeError) as error:
        raise InputError(f"{source}: not a valid cameramodel ({error}); write it again with mrcal") from None
    if not isinstance(values, dict):
        raise InputError(f"{source}: not a valid cameramodel: a {type(values).__name__}; write it again with mrcal")
    return values


MRCAL = CameraFormat("mrcal", "mrcal cameramodel", ".cameramodel", _write, OwnSyntax(_recognizes, _read), HASH_TAG)
