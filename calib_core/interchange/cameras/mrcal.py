"""mrcal's cameramodel: a dictionary in Python's syntax. Pixels count as ours do, from the center of the first one."""

import ast
from collections.abc import Mapping
from typing import Any

from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera, OwnSyntax
from calib_core.interchange.cameras.fields import floats
from calib_core.parsing import python_tree

_COEFFICIENTS = {"LENSMODEL_PINHOLE": 0, "LENSMODEL_OPENCV4": 4, "LENSMODEL_OPENCV5": 5, "LENSMODEL_OPENCV8": 8}
_MODELS = {0: "pinhole", 4: "plumb_bob", 5: "plumb_bob", 8: "rational_polynomial"}
_SOLVABLE = "calibrate with LENSMODEL_OPENCV8, or convert it with mrcal-convert-lensmodel"


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


MRCAL = OwnSyntax(_recognizes, _read)
