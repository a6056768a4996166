"""The pose of the radar in a third frame (sensor kit, ego), given as seven numbers."""

import math
from collections.abc import Sequence

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.imported import WrittenPose

_NAMES = "x y z qx qy qz qw"


def parent_pose(numbers: Sequence[float]) -> RigidTransform:
    """Return parent_from_radar from x, y, z [m] and the quaternion qx, qy, qz, qw.

    Raises:
        InputError: there are not seven numbers, one is not finite, or the quaternion's length is not 1.
    """
    if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
        raise InputError(
            f"the pose of the radar in its parent takes seven finite numbers: {_NAMES} (metres, quaternion)"
        )
    try:
        pose = WrittenPose("quaternion_xyzw", np.array(numbers[3:]), np.array(numbers[:3]), "camera_from_radar")
        return pose.as_written()
    except ValueError as error:
        raise InputError(f"the pose of the radar in its parent: {error}; the order is {_NAMES}, qw last") from None
