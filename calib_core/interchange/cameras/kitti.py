"""KITTI's cameras: calib_cam_to_cam.txt with K, D and size of each and of its rectified image; P0 to P3 of a frame's file."""

import re

from calib_core.interchange.cameras.camera_format import FoundCamera, OwnSyntax
from calib_core.interchange.cameras.fields import floats

_KEY = re.compile(r"^(K|D|S|P_rect|S_rect|R_rect|R|T|P)_?(\d{1,2}):\s*(.*)$")


def _keyed(content: str | bytes) -> dict[str, dict[str, str]]:
    """Return the values of each camera by its number and their keys."""
    cameras: dict[str, dict[str, str]] = {}
    for line in content.splitlines() if isinstance(content, str) else []:
        if match := _KEY.match(line.strip()):
            cameras.setdefault(match[2], {})[match[1]] = match[3]
    return cameras


def _recognizes(content: str | bytes) -> bool:
    return any({"K", "D"} <= set(values) or {"P_rect", "P"} & set(values) for values in _keyed(content).values())


def _read(content: str | bytes, source: str) -> tuple[FoundCamera, ...]:
    found = []
    for number, values in _keyed(content).items():
        if {"K", "D"} <= set(values):
            matrix = _numbers(values, "K", number, source, 9)
            distortion = _numbers(values, "D", number, source)
            found.append(FoundCamera(number, "", matrix, distortion, _size(values, "S", number, source)))
        if "P_rect" in values:
            matrix = _left_part(values, "P_rect", number, source)
            found.append(FoundCamera(f"rect_{number}", "pinhole", matrix, (), _size(values, "S_rect", number, source)))
        elif "P" in values and "K" not in values:
            found.append(FoundCamera(f"P{number}", "pinhole", _left_part(values, "P", number, source), (), None))
    same = len({camera.matrix_px for camera in found}) == 1 and all(camera.name.startswith("P") for camera in found)
    return tuple(found[:1] if same else found)


def _left_part(values: dict[str, str], key: str, number: str, source: str) -> tuple[float, ...]:
    """Return the camera matrix K of a projection K [I | t]."""
    p = _numbers(values, key, number, source, 12)
    return (*p[0:3], *p[4:7], *p[8:11])


def _numbers(
    values: dict[str, str], key: str, number: str, source: str, length: int | None = None
) -> tuple[float, ...]:
    return floats(values[key].split(), source=source, place=f"{key}_{number}", length=length)


def _size(values: dict[str, str], key: str, number: str, source: str) -> tuple[int, int] | None:
    if key not in values:
        return None
    width, height = _numbers(values, key, number, source, 2)
    return int(width), int(height)


KITTI_CAMERAS_FILE = OwnSyntax(_recognizes, _read)
