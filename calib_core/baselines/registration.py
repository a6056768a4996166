"""Registration of two sets of corresponding points in space, and how well it is conditioned.

`register` finds the best rotation and shift (Kabsch, Horn). `register_linearly` solves for the twelve numbers of [R | t]
without the constraint that R is a rotation. Points of a flat board leave R's third column open, so noise decides it.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3
from calib_core.geometry import RigidTransform, skew

_FLATTEST = 1e-3  # of the longest extent: points nearer to one line leave the rotation about it open


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The rigid transform that brings points nearest to their counterparts.

    Attributes:
        camera_from_radar: least squares over all points.
        rms_m: root mean square distance that is left.
        condition: condition number of the least-squares problem: how many times a relative error of the points can grow.
            Of `register`, that of the normal equations for (dt, dtheta) about the radar, which rises with the fourth power
            of distance over extent; of `register_linearly`, that of the matrix of homogeneous points.
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
    if _in_line(points_radar_m - source) or _in_line(points_camera_m - target):
        return None
    left, _, right = np.linalg.svd((points_camera_m - target).T @ (points_radar_m - source))
    rotation = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    pose = RigidTransform(rotation, target - rotation @ source)
    rows = np.concatenate([np.hstack([np.eye(3), -skew(rotation @ point)]) for point in points_radar_m])
    return Registration(pose, _rms_m(pose, points_radar_m, points_camera_m), float(np.linalg.cond(rows.T @ rows)))


def register_linearly(points_radar_m: Points3, points_camera_m: Points3) -> Registration | None:
    """Solve [R | t] by linear least squares, then take the nearest rotation; None for fewer than four points.

    Args:
        points_radar_m: (n, 3).
        points_camera_m: (n, 3), the same points in the camera frame.
    """
    if len(points_radar_m) < 4:
        return None
    homogeneous = np.hstack([points_radar_m, np.ones((len(points_radar_m), 1))])
    solution = np.linalg.lstsq(homogeneous, points_camera_m, rcond=None)[0].T
    left, _, right = np.linalg.svd(solution[:, :3])
    rotation = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    pose = RigidTransform(rotation, solution[:, 3])
    return Registration(pose, _rms_m(pose, points_radar_m, points_camera_m), float(np.linalg.cond(homogeneous)))


def _in_line(centred_m: Points3) -> bool:
    longest, second, _ = np.linalg.svd(centred_m, compute_uv=False)
    return not second > _FLATTEST * longest


def _rms_m(camera_from_radar: RigidTransform, points_radar_m: Points3, points_camera_m: Points3) -> float:
    apart_m = camera_from_radar @ points_radar_m - points_camera_m
    return float(np.sqrt(np.square(apart_m).sum(axis=1).mean()))
