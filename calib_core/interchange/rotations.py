"""Rotations and 4x4 matrices as other formats write them: fixed-axis roll, pitch, yaw, quaternions, optical and body axes."""

import numpy as np

from calib_core.arrays import Matrix33, Vector3
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix

LINK_FROM_OPTICAL = RigidTransform(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.zeros(3))
"""From optical axes (x right, y down, z forward) to body axes (x forward, y left, z up), REP-103."""

_LAST_ROW_TOLERANCE = 1e-9

OPTICAL_RPY_RAD = (-np.pi / 2, 0.0, -np.pi / 2)
"""The same rotation as URDF's roll, pitch, yaw."""

_FORWARD_COS = np.cos(np.radians(35.0))


def off_forward_rad(camera_from_radar: RigidTransform) -> float:
    """Return the angle between the camera's viewing direction and the radar's x axis [rad]."""
    return float(np.arccos(np.clip(camera_from_radar.rotation[2, 0], -1.0, 1.0)))


def looks_forward(camera_from_radar: RigidTransform) -> bool:
    """Return whether the camera is upright and looks along the radar's x axis, each to within 35 degrees."""
    along, upright = camera_from_radar.rotation[2, 0], -camera_from_radar.rotation[1, 2]
    return bool(min(along, upright) > _FORWARD_COS)


def matrix_from_rpy(rpy_rad: Vector3) -> Matrix33:
    """Return Rz(yaw) Ry(pitch) Rx(roll): rotations about fixed axes, as in URDF and tf2."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy_rad), np.sin(rpy_rad)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_from_matrix(rotation: Matrix33) -> Vector3:
    """Return (roll, pitch, yaw) [rad]; at a pitch of 90 degrees, where only roll and yaw together are determined, yaw is 0.

    Roll is computed from the matrix with yaw undone, which keeps its precision near that pitch.
    """
    r = np.asarray(rotation, dtype=np.float64)
    across = float(np.hypot(r[0, 0], r[1, 0]))
    yaw = float(np.arctan2(r[1, 0], r[0, 0])) if across > 1e-12 else 0.0
    sine, cosine = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(sine * r[0, 2] - cosine * r[1, 2], cosine * r[1, 1] - sine * r[0, 1])
    return np.array([roll, np.arctan2(-r[2, 0], across), yaw])


def quaternion_xyzw_from_matrix(rotation: Matrix33) -> np.ndarray:
    """Return the unit quaternion in the order x, y, z, w, with w >= 0."""
    return np.roll(quaternion_wxyz_from_matrix(rotation), -1)


def upper_rows(matrix: np.ndarray) -> np.ndarray:
    """Return the upper three rows of a 3x4 or 4x4 transform.

    Raises:
        ValueError: it has another shape, or its last row is not 0 0 0 1.
    """
    rows = np.asarray(matrix, dtype=np.float64)
    if rows.shape not in ((3, 4), (4, 4)):
        raise ValueError(f"the matrix is {' x '.join(map(str, rows.shape))}, not 4 x 4 or 3 x 4")
    last = np.array([0.0, 0.0, 0.0, 1.0])
    if len(rows) == 4 and not np.abs(rows[3] - last).max() <= _LAST_ROW_TOLERANCE:
        found = " ".join(f"{value:.6g}" for value in rows[3])
        if np.abs(rows[:, 3] - last).max() <= _LAST_ROW_TOLERANCE:
            raise ValueError(f"the matrix is transposed: its last row is {found} and its last column 0 0 0 1")
        raise ValueError(f"the last row of the matrix is {found}, not 0 0 0 1; is it scaled, or another matrix?")
    return rows[:3]


def nearest_rotation(matrix: Matrix33, *, tolerance: float) -> Matrix33:
    """Return the rotation nearest to a matrix that was written with few digits.

    Raises:
        ValueError: it is mirrored, or farther from orthonormal than the tolerance.
    """
    matrix = np.asarray(matrix, dtype=np.float64)
    with np.errstate(all="ignore"):  # numbers of any size
        mirrored = np.linalg.det(matrix) < 0
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if mirrored:
        raise ValueError("the rotation is left-handed (determinant -1): an axis is mirrored")
    if not off <= tolerance:
        raise ValueError(f"the rotation is not orthonormal (off by {off:.2g})")
    if off <= 1e-14:
        return matrix
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt
