"""MATLAB's cameraParameters and cameraIntrinsics as structs (toStruct) in a mat file; their pixels count from 1."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera, OwnSyntax
from calib_core.interchange.syntax.mat_file import load_mat

ONE_BASED = 1.0
_MAT_5, _MAT_7_3 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"


def _recognizes(content: str | bytes) -> bool:
    return isinstance(content, bytes) and content.startswith((_MAT_5, _MAT_7_3))


def _read(content: str | bytes, source: str) -> tuple[FoundCamera, ...]:
    data = content if isinstance(content, bytes) else content.encode()
    if data.startswith(_MAT_7_3):
        raise InputError(f"{source}: a mat file of version 7.3; in MATLAB save it with -v7")
    variables = load_mat(data, source=source)
    cameras = tuple(_camera_of(name, values, source) for name, values in _structs(variables))
    if not cameras:
        raise InputError(
            f"{source}: no struct with IntrinsicMatrix, K or FocalLength in it; in MATLAB: "
            "s = toStruct(cameraParams); save('camera.mat', 's', '-v7')"
        )
    return cameras


def _structs(variables: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the structs that hold a camera, with their names, nested ones included."""
    for name, values in variables.items():
        if isinstance(values, dict):
            if {"IntrinsicMatrix", "K", "FocalLength"} & set(values):
                yield name, values
            else:
                yield from _structs(values)


def _camera_of(name: str, values: Mapping[str, Any], source: str) -> FoundCamera:
    matrix = _matrix(name, values, source)
    matrix[:2, 2] -= ONE_BASED
    radial, tangential = (_row(values, key) for key in ("RadialDistortion", "TangentialDistortion"))
    if len(radial) not in (0, 2, 3) or len(tangential) not in (0, 2):
        raise InputError(
            f"{source}: {name}: RadialDistortion has 2 or 3 numbers and TangentialDistortion 2; correct it"
        )
    k1, k2, *k3 = radial or [0.0, 0.0]
    distortion = (k1, k2, *(tangential or [0.0, 0.0]), *k3)
    size = _row(values, "ImageSize")
    return FoundCamera(
        name,
        "plumb_bob",
        tuple(matrix.ravel().tolist()),
        distortion,
        (int(size[1]), int(size[0])) if len(size) >= 2 else None,
    )


def _matrix(name: str, values: Mapping[str, Any], source: str) -> np.ndarray:
    """Return K with MATLAB's principal point, from whichever field there is; IntrinsicMatrix is its transpose."""
    for key in ("K", "IntrinsicMatrix"):
        given = np.asarray(values.get(key, ()), dtype=np.float64)
        if given.shape == (3, 3):
            return (given if key == "K" else given.T).copy()
    focal, centre = _row(values, "FocalLength"), _row(values, "PrincipalPoint")
    if len(focal) != 2 or len(centre) != 2:
        raise InputError(
            f"{source}: {name}: no 3 x 3 K, and FocalLength and PrincipalPoint do not have two numbers each"
        )
    return np.array([[focal[0], 0.0, centre[0]], [0.0, focal[1], centre[1]], [0.0, 0.0, 1.0]])


def _row(values: Mapping[str, Any], key: str) -> list[float]:
    try:
        return np.asarray(values.get(key, ()), dtype=np.float64).ravel().tolist()
    except (TypeError, ValueError):
        return []


MATLAB_PARAMETERS = OwnSyntax(_recognizes, _read)
