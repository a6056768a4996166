"""Rigid transforms, named target_from_source, their algebra, and how far two poses of the same sensors are apart."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Points3, Values, Vector3, freeze, frozen_array

OPTICAL_FROM_LINK = frozen_array(np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]), (3, 3))
"""Rotation from body axes (x forward, y left, z up) to a camera's optical axes (x right, y down, z forward)."""

CM_PER_M = 100.0
_SMALL_ANGLE_RAD = 1e-6
_ROTATION_TOLERANCE = 1e-6
_ROUNDED = 1e-12
"""A rotation farther from orthonormal was written with few digits: its inverse or a product could leave the tolerance."""


def skew(vector: Vector3) -> Matrix33:
    """Return the matrix whose product with p is the cross product vector x p."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def skews(vectors: np.ndarray) -> np.ndarray:
    """Return the same of many vectors (..., 3): (..., 3, 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    found = np.zeros((*vectors.shape, 3))
    found[..., 0, 1], found[..., 0, 2], found[..., 1, 2] = -z, y, -x
    found[..., 1, 0], found[..., 2, 0], found[..., 2, 1] = z, -y, x
    return found


def rotation_exp(rotation_vector_rad: np.ndarray) -> np.ndarray:
    """Convert rotation vectors (..., 3) to matrices (..., 3, 3) by Rodrigues' formula, with its series near zero.

    A single vector uses scalar arithmetic, which is more than twice as fast.
    """
    vector = np.asarray(rotation_vector_rad, dtype=np.float64)
    if vector.ndim > 1:
        return _rotations_exp(vector)
    angle, K = math.hypot(*vector), skew(vector)
    if angle < _SMALL_ANGLE_RAD:
        return np.eye(3) + K + 0.5 * K @ K
    return np.eye(3) + math.sin(angle) / angle * K + (1.0 - math.cos(angle)) / angle**2 * K @ K


def _rotations_exp(vectors_rad: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(vectors_rad, axis=-1)[..., None, None]
    small = angle < _SMALL_ANGLE_RAD
    safe = np.where(small, 1.0, angle)
    K = skews(vectors_rad)
    first = np.where(small, 1.0, np.sin(safe) / safe)
    second = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def rotation_log(rotation: Matrix33) -> Vector3:
    """Convert a rotation matrix to its rotation vector [rad], of length 0 to pi.

    The conversion goes through the quaternion, so that angles near 0 and near pi keep full precision.
    """
    w, *xyz = quaternion_wxyz_from_matrix(rotation)
    vector = np.array(xyz)
    sine = float(np.linalg.norm(vector))
    if sine < _SMALL_ANGLE_RAD:
        return 2.0 * vector
    return 2.0 * np.arctan2(sine, w) / sine * vector


def rotation_angle_rad(rotation: Matrix33) -> float:
    """Return the angle of a rotation, 0 to pi."""
    return float(np.linalg.norm(rotation_log(rotation)))


def quaternion_wxyz_from_matrix(rotation: Matrix33) -> np.ndarray:
    """Return the unit quaternion (w, x, y, z) with w >= 0 (Shepperd's method: the largest component first)."""
    r = np.asarray(rotation, dtype=np.float64)
    squares = np.array([np.trace(r), r[0, 0], r[1, 1], r[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = np.array([1.0 + squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[0] = r[k, j] - r[j, k]
        q[1 + i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        q[1 + j] = r[j, i] + r[i, j]
        q[1 + k] = r[k, i] + r[i, k]
    q /= np.linalg.norm(q)
    return -q if q[0] < 0.0 else q


def matrix_from_quaternion_wxyz(quaternion: np.ndarray) -> Matrix33:
    """Return the rotation matrix of a quaternion (w, x, y, z), which is normalised first.

    Raises:
        ValueError: the quaternion is zero or not finite.
    """
    q = np.asarray(quaternion, dtype=np.float64)
    norm = math.hypot(*q)  # does not overflow below the largest float
    if not np.isfinite(norm) or norm < 1e-12:
        raise ValueError(f"not a rotation: quaternion {q.tolist()}")
    w, x, y, z = q / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_euler(x_rad: float, y_rad: float, z_rad: float) -> Matrix33:
    """Return R = Rz(z) Ry(y) Rx(x), the paper's sequence of Euler angles: about the fixed axes x, then y, then z."""
    (sx, sy, sz), (cx, cy, cz) = np.sin([x_rad, y_rad, z_rad]), np.cos([x_rad, y_rad, z_rad])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    return about_z @ about_y @ about_x


def _dot(x: list[float], y: list[float]) -> float:
    """Multiply two rows of three: scalars, which for a single small matrix are much faster than NumPy."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def _determinant(x: list[float], y: list[float], z: list[float]) -> float:
    """Expand the determinant of three rows."""
    (a, b, c), (d, e, f), (g, h, i) = x, y, z
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def _nearly_nearest(rotation: Matrix33) -> Matrix33:
    """Take one Newton step from a rotation up to rounding towards the nearest rotation, which squares the error."""
    return np.asarray(1.5 * rotation - 0.5 * rotation @ (rotation.T @ rotation))


@dataclass(frozen=True, slots=True, eq=False)
class RigidTransform:
    """A rotation and a translation: p_target = rotation @ p_source + translation_m.

    Name a value target_from_source. `@` composes transforms and moves points.

    Attributes:
        rotation: (3, 3) orthonormal, determinant +1; one that was rounded is made orthonormal.
        translation_m: (3,) the source's origin in the target frame.
    """

    rotation: Matrix33
    translation_m: Vector3

    def __post_init__(self) -> None:
        freeze(self, rotation=(3, 3), translation_m=(3,))
        x, y, z = self.rotation.tolist()
        if not all(map(math.isfinite, (*x, *y, *z, *self.translation_m.tolist()))):
            raise ValueError("a transform must be finite")
        off = (_dot(x, x) - 1.0, _dot(y, y) - 1.0, _dot(z, z) - 1.0, _dot(x, y), _dot(x, z), _dot(y, z))
        most = max(map(abs, off))
        if most > _ROTATION_TOLERANCE:
            raise ValueError("the rotation is not orthonormal")
        if _determinant(x, y, z) < 0:
            raise ValueError("the rotation is left-handed (determinant -1): an axis is mirrored")
        if most > _ROUNDED:
            object.__setattr__(self, "rotation", frozen_array(_nearly_nearest(self.rotation), (3, 3)))

    @classmethod
    def identity(cls) -> "RigidTransform":
        """Return the identity transform."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_matrix(cls, matrix: np.ndarray) -> "RigidTransform":
        """Make a transform from a homogeneous (4, 4) or (3, 4) matrix."""
        matrix = np.asarray(matrix, dtype=np.float64)
        return cls(matrix[:3, :3], matrix[:3, 3])

    def as_matrix(self) -> np.ndarray:
        """Return the homogeneous (4, 4) matrix."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = self.translation_m
        return matrix

    def inverse(self) -> "RigidTransform":
        """Return source_from_target."""
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.translation_m)

    def adjoint(self) -> Matrix66:
        """Return the matrix that maps an error (dt, dtheta) [m, rad] from source to target axes, about the target's origin."""
        adjoint = np.zeros((6, 6))
        adjoint[:3, :3] = self.rotation
        adjoint[3:, 3:] = self.rotation
        adjoint[:3, 3:] = skew(self.translation_m) @ self.rotation
        return adjoint

    def perturbed(self, error: np.ndarray) -> "RigidTransform":
        """Apply an error (dt, dtheta) [m, rad]: t = t_hat + dt, R = Exp(dtheta) R_hat; the result is re-orthonormalised."""
        rotation = _nearly_nearest(rotation_exp(np.asarray(error[3:6])) @ self.rotation)
        return RigidTransform(rotation, self.translation_m + np.asarray(error[:3]))

    def error_from(self, estimate: "RigidTransform") -> np.ndarray:
        """Return the (6,) error (dt, dtheta) with self == estimate.perturbed(error)."""
        return np.concatenate(
            [self.translation_m - estimate.translation_m, rotation_log(self.rotation @ estimate.rotation.T)]
        )

    @overload
    def __matmul__(self, other: "RigidTransform") -> "RigidTransform": ...
    @overload
    def __matmul__(self, other: Points3) -> Points3: ...
    def __matmul__(self, other: "RigidTransform | Points3") -> "RigidTransform | Points3":
        if isinstance(other, RigidTransform):
            return RigidTransform(
                self.rotation @ other.rotation, self.rotation @ other.translation_m + self.translation_m
            )
        return np.asarray(other) @ self.rotation.T + self.translation_m


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Many rigid transforms of the same frames, or one, as arrays.

    Attributes:
        rotations: (..., 3, 3).
        translations_m: (..., 3).
    """

    rotations: np.ndarray
    translations_m: np.ndarray

    @classmethod
    def of(cls, transforms: Sequence[RigidTransform]) -> "Poses":
        """Stack transforms (s,)."""
        return cls(np.array([one.rotation for one in transforms]), np.array([one.translation_m for one in transforms]))

    @classmethod
    def joined(cls, several: "Sequence[Poses]") -> "Poses":
        """Concatenate batches."""
        return cls(
            np.concatenate([poses.rotations for poses in several]),
            np.concatenate([poses.translations_m for poses in several]),
        )

    def __len__(self) -> int:
        return len(self.rotations)

    def perturbed(self, errors: np.ndarray) -> "Poses":
        """Apply an error (s, 6) to each: t = t_hat + dt, R = Exp(dtheta) R_hat."""
        return Poses(rotation_exp(errors[:, 3:]) @ self.rotations, self.translations_m + errors[:, :3])

    def some(self, which: Sequence[int] | np.ndarray | slice) -> "Poses":
        """Keep those of the given indices."""
        return Poses(self.rotations[which], self.translations_m[which])

    def transform(self, index: int) -> RigidTransform:
        """Return one of them; its rotation is the nearest one, as steps accumulate rounding errors."""
        u, _, vt = np.linalg.svd(self.rotations[index])
        return RigidTransform(u @ vt, self.translations_m[index])

    def transforms(self) -> list[RigidTransform]:
        """Return all of them."""
        return [self.transform(index) for index in range(len(self))]


def mounting_rotation(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Matrix33:
    """Return the rotation of camera_from_radar of a camera turned by roll, then pitch, then yaw about the radar's axes."""
    return np.asarray(OPTICAL_FROM_LINK @ rotation_from_euler(*np.deg2rad([roll_deg, pitch_deg, yaw_deg])).T)


def rotation_jacobian(turned_m: np.ndarray, d_point: np.ndarray, out: np.ndarray) -> None:
    """Write d pixel / d theta (..., 3, 2, n): with R = Exp(dtheta) R_hat, a row j of d pixel / d point gives R p x j.

    Args:
        turned_m: (..., 3, n) R p, the points in camera axes before the translation.
        d_point: (..., 3, 2, n) d pixel / d camera point [px/m].
        out: receives the result.
    """
    x, y, z = (turned_m[..., axis, None, :] for axis in range(3))
    a, b, c = (d_point[..., axis, :, :] for axis in range(3))
    out[..., 0, :, :] = y * c - z * b
    out[..., 1, :, :] = z * a - x * c
    out[..., 2, :, :] = x * b - y * a


def larger_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the larger eigenvalue (n,) of symmetric matrices (n, 2, 2); NaN stays NaN."""
    first, second = matrices[:, 0, 0], matrices[:, 1, 1]
    return np.asarray(0.5 * (first + second) + np.hypot(0.5 * (first - second), matrices[:, 0, 1]))


_ZERO_LENGTH = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class PoseDifference:
    """How far one camera_from_radar is from another.

    Attributes:
        error: (6,) (dt, dtheta) [m, rad] that leads from the first to the second.
        rotation_deg: angle between the two rotations.
        rotation_sigma_deg: its standard deviation about its own axis; NaN if unknown.
        position_cm: distance between the two camera positions in the radar frame.
        position_sigma_cm: its standard deviation along its own direction; NaN if unknown.
        squared: squared Mahalanobis distance of the error; NaN if the covariance is unknown or singular.
    """

    error: Values
    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    squared: float

    def __post_init__(self) -> None:
        freeze(self, error=(6,))


def pose_difference(first: RigidTransform, second: RigidTransform, covariance: Matrix66) -> PoseDifference:
    """Return how far the second camera_from_radar is from the first.

    Args:
        first: a camera_from_radar.
        second: another one of the same two sensors.
        covariance: (6, 6) of the error between them [m, rad]; NaN where unknown.
    """
    error = second.error_from(first)
    moved_m = second.inverse().translation_m - first.inverse().translation_m
    jacobian = camera_position_jacobian(first)
    return PoseDifference(
        error=error,
        rotation_deg=float(np.degrees(np.linalg.norm(error[3:]))),
        rotation_sigma_deg=float(np.degrees(_sigma_along(error[3:], covariance[3:, 3:]))),
        position_cm=float(np.linalg.norm(moved_m)) * CM_PER_M,
        position_sigma_cm=_sigma_along(moved_m, jacobian @ covariance @ jacobian.T) * CM_PER_M,
        squared=squared_distance(error, covariance),
    )


def camera_position_jacobian(camera_from_radar: RigidTransform) -> np.ndarray:
    """Return d c / d (dt, dtheta), (3, 6): how the camera centre c = -R^T t in the radar frame follows an error of the pose."""
    turned = -camera_from_radar.rotation.T
    return np.hstack([turned, turned @ skew(camera_from_radar.translation_m)])


def squared_distance(error: Values, covariance: Matrix66) -> float:
    """Return the squared Mahalanobis distance of an error (6,); NaN if its covariance is unknown or singular."""
    if not np.isfinite(covariance).all() or np.linalg.matrix_rank(covariance, hermitian=True) < 6:
        return float("nan")
    return float(error @ np.linalg.solve(covariance, error))


def _sigma_along(direction: np.ndarray, covariance: np.ndarray) -> float:
    length = float(np.linalg.norm(direction))
    variance = np.trace(covariance) / 3 if length < _ZERO_LENGTH else direction @ covariance @ direction / length**2
    return float(np.sqrt(variance)) if variance >= 0 else float("nan")
