"""The intrinsics that data sets publish beside their images: KITTI, View-of-Delft, nuScenes and Astyx."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.arrays import Matrix33, Values
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.parsing import json_rows, json_value
from calib_core.recordings.camera.jpeg import image_size_px

_MAX_BYTES = 1 << 29
_LEVELS = 4
_SUFFIXES = (".jpg", ".jpeg", ".png")
_CAMERA_NUMBER = re.compile(r"image_?0?(\d)")
_ONLY_CAMERA = ("camera_intrinsic", "camera_projection_matrix", "P")
_RAW_KITTI = "calib_cam_to_cam.txt"


@dataclass(frozen=True, slots=True, eq=False)
class FolderCamera:
    """A camera as a data set publishes it.

    Attributes:
        file: where it stands.
        matrix_px: (3, 3) K.
        distortion: (k,) k1 k2 p1 p2 k3, or none for rectified images.
        size_px: width and height; None if the file does not state them: those of the images.
        pose: how to use the pose that the file also holds; "" if it holds none.
        doubt: what is not certain about it; "" if nothing.
    """

    file: Path
    matrix_px: Matrix33
    distortion: Values
    size_px: tuple[int, int] | None = None
    pose: str = ""
    doubt: str = ""

    def camera(self, image_size_px: tuple[int, int]) -> Camera:
        """Return the camera.

        Args:
            image_size_px: width and height of the images.

        Raises:
            ValueError: the numbers are not a camera's.
        """
        model = "plumb_bob" if len(self.distortion) else "pinhole"
        return Camera(model, *(self.size_px or image_size_px), self.matrix_px, self.distortion)


def camera_beside(folder: Path, files: Sequence[Path], image_size_px: tuple[int, int] | None) -> FolderCamera | None:
    """Find the intrinsics that a data set publishes for a folder of images; None if there are none.

    Args:
        folder: of the images.
        files: the images.
        image_size_px: of the first; None if it cannot be read.
    """
    try:
        camera = _of_kitti_frames(folder, files) or _of_raw_kitti(folder, image_size_px)
        return camera or _of_nuscenes(folder, files) or _of_astyx(folder, files)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, InputError):
        return None  # a file of that name but of another form is not a data set's calibration


def size_of_images_beside(calibration: Path) -> tuple[int, int] | None:
    """Return the size of the images that a KITTI or View-of-Delft calibration belongs to; None if there are none.

    Args:
        calibration: such as calib/00000.txt beside image_2, or calib.txt beside or in it.
    """
    around = calibration.absolute().parent
    for folder in (around.parent / "image_2", around / "image_2", around):
        named = folder / calibration.stem
        for image in (*(named.with_suffix(suffix) for suffix in _SUFFIXES), *sorted(folder.glob("*"))[:1]):
            if image.suffix.lower() in _SUFFIXES and (size := image_size_px(image)):
                return size
    return None


def _folders_above(folder: Path) -> Iterator[Path]:
    """Yield the folders around a folder, as far up as data sets are deep."""
    yield from list(folder.absolute().parents)[:_LEVELS]


def _lines(path: Path) -> dict[str, np.ndarray]:
    """Read "KEY: numbers" lines."""
    if path.stat().st_size > _MAX_BYTES:
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, colon, rest = line.partition(":")
        words = rest.split()
        try:
            numbers = np.array([float(word) for word in words])
        except ValueError:
            continue
        if colon and len(numbers):
            found[key.strip()] = numbers
    return found


def _number_of(folder: Path) -> str | None:
    """Return the number of KITTI's camera: 2 for image_2, image_02 and image_02/data."""
    match = next((m for name in (folder.name, folder.parent.name) if (m := _CAMERA_NUMBER.fullmatch(name))), None)
    return match[1] if match else None


def _of_kitti_frames(folder: Path, files: Sequence[Path]) -> FolderCamera | None:
    """Read calib/NUMBER.txt beside image_2, or beside images of the only camera: one file per frame, or one for all."""
    number = _number_of(folder)
    keys = _ONLY_CAMERA if number is None else (f"P{number}",)
    beside = folder.parent / "calib"
    if not files:
        return None
    candidates = [beside / f"{file.stem}.txt" for file in (files[0], files[len(files) // 2], files[-1])]
    paths = [path for path in candidates if path.is_file()]
    if not paths:
        paths = sorted(beside.glob("*.txt"))[:1] or [path for path in (folder.parent / "calib.txt",) if path.is_file()]
    if not paths:
        return None
    found = [next((lines[key] for key in keys if key in lines), None) for lines in map(_lines, paths)]
    matrices = [numbers.reshape(3, -1)[:, :3] for numbers in found if numbers is not None]
    if not matrices:
        return None
    doubt = ""
    if any(np.abs(matrix - matrices[0]).max() > 0.5 for matrix in matrices):
        doubt = "the files of other frames have other intrinsics; those of the first frame are used"
    posed = any(key == "Tr_velo_to_cam" or "radar" in key.lower() for key in _lines(paths[0]))
    pose = f"its pose: --calibration {paths[0]}" if posed else ""
    return FolderCamera(paths[0], matrices[0], np.zeros(0), None, pose, doubt)


def _of_raw_kitti(folder: Path, image_size_px: tuple[int, int] | None) -> FolderCamera | None:
    """Read calib_cam_to_cam.txt: the rectified camera, or the raw one if the images have its size."""
    number = _number_of(folder)
    file = next((above / _RAW_KITTI for above in _folders_above(folder) if (above / _RAW_KITTI).is_file()), None)
    if number is None or file is None:
        return None
    lines = _lines(file)
    rectified, raw = (lines.get(f"{key}_0{number}") for key in ("S_rect", "S"))
    if raw is not None and image_size_px == tuple(raw.astype(int)) and f"K_0{number}" in lines:
        matrix, distortion = lines[f"K_0{number}"].reshape(3, 3), lines.get(f"D_0{number}", np.zeros(0))
        return FolderCamera(file, matrix, distortion, image_size_px)
    matrix = lines[f"P_rect_0{number}"].reshape(3, 4)[:, :3]
    size = None if rectified is None else (int(rectified[0]), int(rectified[1]))
    return FolderCamera(file, matrix, np.zeros(0), size)


def _of_nuscenes(folder: Path, files: Sequence[Path]) -> FolderCamera | None:
    """Read the calibrated sensor of the folder's channel from the tables of a nuScenes data set."""
    tables = next(
        (path for above in _folders_above(folder) for path in sorted(above.glob("v1.0-*/calibrated_sensor.json"))), None
    )
    if tables is None:
        return None
    sensors = {row["token"]: row["channel"] for row in _table(tables.with_name("sensor.json"))}
    mine = [
        row for row in _table(tables) if sensors.get(row["sensor_token"]) == folder.name and row.get("camera_intrinsic")
    ]
    if not mine:
        return None
    doubt = ""
    if any(row["camera_intrinsic"] != mine[0]["camera_intrinsic"] for row in mine):
        tokens = _tokens_of(tables.with_name("sample_data.json"), {file.name for file in files})
        used = [row for row in mine if row["token"] in tokens]
        if len({json.dumps(row["camera_intrinsic"]) for row in used}) != 1:
            doubt = "the images come from several cars or days with other intrinsics; those of the first are used"
        mine = used or mine
    pose = f"its pose: records of {folder.name} and of the radar in {tables}, each in the car's frame"
    return FolderCamera(tables, np.array(mine[0]["camera_intrinsic"], dtype=np.float64), np.zeros(0), None, pose, doubt)


def _of_astyx(folder: Path, files: Sequence[Path]) -> FolderCamera | None:
    """Read the sensor with the folder's name from calibration/NUMBER.json beside it."""
    file = folder.parent / "calibration" / f"{files[0].stem}.json"
    if not file.is_file() or file.stat().st_size > _MAX_BYTES:
        return None
    content = json_value(file.read_text(encoding="utf-8"), source=str(file))
    sensors = {row["sensor_uid"]: row["calib_data"] for row in content["sensors"]}
    pose = f"its pose: cocalib import {file} --camera {folder.name}"
    return FolderCamera(file, np.array(sensors[folder.name]["K"], dtype=np.float64), np.zeros(0), None, pose)


def _tokens_of(path: Path, names: set[str]) -> dict[str, None]:
    """Return the calibrated sensors of images, in the order of the table, which may have more than 1 GB."""
    left, found = set(names), dict[str, None]()
    rows = json_rows(path, source=str(path)) if path.is_file() else iter(())
    while left and (row := next(rows, None)):
        name = row["filename"].rpartition("/")[2]
        if name in left:
            left.remove(name)
            found[row["calibrated_sensor_token"]] = None
    return found


def _table(path: Path) -> list[Mapping[str, Any]]:
    return [row for row in json_rows(path, source=str(path)) if isinstance(row, dict)]
