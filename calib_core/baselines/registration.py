"""Registration of two sets of corresponding points in space (Kabsch, Horn), and how well it is conditioned."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3
from calib_core.geometry import RigidTransform, skew

__all__ = ["Registration", "register"]

_FLATTEST = 1e-3  # of the longest extent: points nearer to one line leave the rotation about it open


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The rigid transform that brings points nearest to their counterparts.

    Attributes:
        camera_from_radar: least squares over all points.
        rms_m: root mean square distance that is left.
        condition: condition number of the normal equations for (dt, dtheta) about the radar: how many times a
            relative error of the points can grow; it rises with the fourth power of distance over extent.
    """

    camera_from_radar: RigidTransform
    rms_m: float
    condition: float


def register(points_radar_m: Points3, points_camera_m: Points3) -> Registration | None:
    """Register points; None for fewer than three, or for points on one line, which leave the rotation about it open.

    Args:
        points_radar_m: (n, 3).
        points_camera_m: (n, 3), the same points in the camera frame.
    """
    if len(points_radar_m) < 3:
        return None
    source, target = points_radar_m.mean(axis=0), points_camera_m.mean(axis=0)
    for points, middle in ((points_radar_m, source), (points_camera_m, target)):
        longest, second, _ = np.linalg.svd(points - middle, compute_uv=False)
        if not second > _FLATTEST * longest:
            return None
    left, _, right = np.linalg.svd((points_camera_m - target).T @ (points_radar_m - source))
    handed = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = left @ handed @ right
    pose = RigidTransform(rotation, target - rotation @ source)
    apart_m = pose @ points_radar_m - points_camera_m
    rows = np.concatenate([np.hstack([np.eye(3), -skew(rotation @ point)]) for point in points_radar_m])
    condition = float(np.linalg.cond(rows.T @ rows))
    return Registration(pose, float(np.sqrt(np.square(apart_m).sum(axis=1).mean())), condition)
