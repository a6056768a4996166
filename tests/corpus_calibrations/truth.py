"""One known pose and camera, as other programs would write them; nothing here comes from calib_core."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation


def posed(rotation: np.ndarray, translation_m: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Return the 4x4 matrix of a rotation and a translation."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation_m
    return matrix


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of a rigid 4x4 matrix."""
    return posed(matrix[:3, :3].T, -matrix[:3, :3].T @ matrix[:3, 3])


def quaternion(matrix: np.ndarray) -> list[float]:
    """Return x, y, z, w of a matrix's rotation."""
    return [float(value) for value in Rotation.from_matrix(matrix[:3, :3]).as_quat()]


def rpy(matrix: np.ndarray) -> list[float]:
    """Return roll, pitch, yaw about fixed axes [rad]."""
    return [float(value) for value in Rotation.from_matrix(matrix[:3, :3]).as_euler("xyz")]


def words(numbers: np.ndarray | list[float], separator: str = " ", form: str = ".17g") -> str:
    """Return numbers as text."""
    return separator.join(format(float(number), form) for number in np.ravel(numbers))


LINK_FROM_OPTICAL = posed(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]), (0, 0, 0))
RADAR_FROM_CAMERA = posed(
    Rotation.from_euler("xyz", [1.7, -3.2, 8.4], degrees=True).as_matrix() @ LINK_FROM_OPTICAL[:3, :3],
    (0.214, -0.137, 0.382),
)
CAMERA_FROM_RADAR = inverse(RADAR_FROM_CAMERA)
K = np.array([[912.4, 0, 644.2], [0, 909.7, 366.1], [0, 0, 1.0]])
DISTORTION = (-0.17, 0.032, 0.0006, -0.0004, 0.011)
SIZE = (1280, 720)


@dataclass(frozen=True)
class Calibration:
    """A file as another program writes it, made from the known pose.

    Attributes:
        name: what it is.
        file_name: what the program calls it.
        content: of the file.
        beside: other files in its folder.
        refused: words of the refusal, if there is no pose between a radar and a camera in it; "" if it must be read right.
        folder: whether the folder is read, with the files beside it.
        frames: names of the radar and the camera that the user gives, if the file has several.
        close: how near to the truth the numbers as printed can come [m, and in the rotation].
        holds_camera: "lens" or "matrix" if the camera must be read with it, with "size" if the image size is in the file.
    """

    name: str
    file_name: str
    content: str | bytes
    beside: Mapping[str, str | bytes] = field(default_factory=dict)
    refused: str = ""
    folder: bool = False
    frames: tuple[str, str] | None = None
    close: float = 1e-6
    holds_camera: str = ""
