"""What files of other tools have in common: 4x4 matrices, a direction by facing."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from calib_core.arrays import Matrix33
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Direction, Form, WrittenPose
from calib_core.interchange.rotations import upper_rows

AXES_ASSUMED = "assumed a radar frame with x forward, y left, z up, and a camera frame with optical axes (z forward)"
"""For formats that name both sensors but say nothing of their axes."""

_FACING = 0.5  # cosine of 60 degrees


def rigid(form: Form, rotation: ArrayLike, translation_m: ArrayLike, *, source: str) -> RigidTransform:
    """Return the transform of a rotation as it is written and a translation [m].

    Raises:
        InputError: the rotation is invalid.
    """
    pose = WrittenPose(form, np.asarray(rotation), np.asarray(translation_m), "radar_from_camera")
    try:
        return pose.as_written()
    except ValueError as error:
        raise InputError(f"{source}: {error}; give a proper rotation") from None


def rigid_rows(value: Any, *, source: str, place: str) -> np.ndarray:
    """Return the upper three rows (3, 4) of a 4x4 matrix; its rotation is checked by who takes it.

    Raises:
        InputError: there are not 16 numbers, or the last row is not 0 0 0 1.
    """
    matrix = np.reshape(floats(value, source=source, place=place, length=16), (4, 4))
    try:
        return upper_rows(matrix)
    except ValueError as error:
        raise InputError(f"{source}: {place}: {error}; correct it") from None


def direction_by_facing(rotation: Matrix33) -> Direction | None:
    """Return which way a transform between a radar and an optical camera frame goes, judged by where the camera looks.

    Args:
        rotation: of the transform as written.

    Returns:
        The direction under which the camera looks within 60 degrees of the radar's x axis, with its top up; None if both
        directions do that, or neither.
    """
    looks: dict[Direction, tuple[float, float]] = {
        "radar_from_camera": (rotation[0, 2], -rotation[2, 1]),
        "camera_from_radar": (rotation[2, 0], -rotation[1, 2]),
    }
    fitting = [direction for direction, cosines in looks.items() if min(cosines) > _FACING]
    return fitting[0] if len(fitting) == 1 else None
