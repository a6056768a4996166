"""MATLAB's cameraParameters and cameraIntrinsics as structs (toStruct) in a mat file; their pixels count from 1."""

import io
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import CameraFormat, FoundCamera, OwnSyntax
from calib_core.interchange.syntax.mat_file import load_mat

ONE_BASED = 1.0
_MAT_TEXT_BYTES = 116
_MAT_5, _MAT_7_3 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"


def dated_nothing(content: bytes, title: str) -> bytes:
    """Return a mat file with a title in place of the date that SciPy writes into it."""
    return f"MATLAB 5.0 MAT-file, {title}".ljust(_MAT_TEXT_BYTES).encode()[:_MAT_TEXT_BYTES] + content[_MAT_TEXT_BYTES:]


def _write(camera: Camera, _name: str) -> bytes:
    from scipy.io import savemat

    padded = [*camera.distortion.tolist(), *[0.0] * 8]
    k1, k2, p1, p2, k3 = padded[:5]
    if (
        not camera.lens.is_perspective
        or any(padded[5:])
        or camera.model not in ("pinhole", "plumb_bob", "rational_polynomial")
    ):
        raise InputError(
            f"MATLAB's cameraParameters have no {camera.model} lens with these coefficients; write ros, opencv or json"
        )
    shifted = camera.matrix_px.copy()
    shifted[:2, 2] += ONE_BASED
    parameters: dict[str, Any] = {
        "RadialDistortion": np.array([[k1, k2, k3]]),
        "TangentialDistortion": np.array([[p1, p2]]),
        "ImageSize": np.array([[float(camera.height_px), float(camera.width_px)]]),
        "FocalLength": np.array([[shifted[0, 0], shifted[1, 1]]]),
        "PrincipalPoint": shifted[None, :2, 2],
        "Skew": float(shifted[0, 1]),
        "IntrinsicMatrix": shifted.T,
        "K": shifted,
    }
    buffer = io.BytesIO()
    savemat(buffer, {"cameraParams": parameters}, long_field_names=True, oned_as="row")  # type: ignore[arg-type]
    return dated_nothing(buffer.getvalue(), "cocalib, cameraParams as toStruct makes it")


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


MATLAB_PARAMETERS = CameraFormat(
    "matlab", "MATLAB cameraParameters (mat)", ".mat", _write, OwnSyntax(_recognizes, _read)
)
