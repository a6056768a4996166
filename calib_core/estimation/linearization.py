"""Linearization: the whitened linear model of clicks and radar positions about a pose, shared by every solver stage.

A pair is a pixel z with covariance C = sigma_px^2 I, and a measured polar position m = (range, azimuth, elevation) with
covariance V = diag(sigma_polar^2). With pi the projection and p(mu) the Cartesian position of polar mu, the model is

    z = pi(R p(mu) + t) + noise(C),    m = mu + noise(V).                                                  (1)

Linearized at a true position mu, with J = d pi / d mu and e = z - pi(R p(mu) + t) - J (m - mu), the unknown positions
drop out (the Schur complement of the joint problem):

    e ~ N(0, S),    S = C + J V J^T.                                                                       (2)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Points2, Points3, Values
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_jacobian
from calib_core.radar import position_planes
from calib_core.results.systematic_errors import NO_ERRORS, Sensitivity, SystematicError, SystematicErrors

_FAR = 1e6  # whitened residual of a position the camera cannot see


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementPlanes:
    """The measurements of n pairs as planes: one row per coordinate, for fast NumPy operations.

    Attributes:
        pixels_px: (2, n) clicks.
        sigma_px: (n,) or a single number.
        polar: (3, n) range [m], azimuth, elevation [rad], the radar's estimated errors taken out.
        sigma_polar: (3, n).
        errors: systematic errors; the estimated ones are unknowns beside the pose.
    """

    pixels_px: np.ndarray
    sigma_px: Values
    polar: np.ndarray
    sigma_polar: np.ndarray
    errors: SystematicErrors = NO_ERRORS

    def linearize(
        self, camera: Camera, rotations: np.ndarray, translations_m: np.ndarray, at_polar: np.ndarray | None = None
    ) -> "Linearization":
        """Linearize and whiten the projection about one pose or many.

        Args:
            camera: the intrinsics.
            rotations: (..., 3, 3) of camera_from_radar, the leading axes those of any batch.
            translations_m: (..., 3).
            at_polar: (3, n) the true positions mu to linearize at; None takes the measured ones.
        """
        true_polar = self.polar if at_polar is None else at_polar
        turned_m, d_polar = _turned(rotations, true_polar)
        seen_m = turned_m + (translations_m + self.errors.offset_m)[..., None]
        projected_px, d_point = camera.project_planes(seen_m)
        # residual, d pixel / d (dt, dtheta), d pixel / d errors, d pixel / d polar, stacked
        rows = np.empty((*rotations.shape[:-2], 10 + len(self.errors), *self.pixels_px.shape))
        np.subtract(self.pixels_px, projected_px, out=rows[..., 0, :, :])
        rows[..., 1:4, :, :] = d_point
        rotation_jacobian(turned_m, d_point, out=rows[..., 4:7, :, :])
        to_polar = rows[..., -3:, :, :]
        np.einsum("...irn,...ikn->...krn", d_point, d_polar, out=to_polar)
        if self.errors.estimated:
            at = _sensitivity(camera, true_polar, projected_px, d_point, to_polar)
            at = _with_lens(at, camera, seen_m, self.errors.estimated)
            for k, error in enumerate(self.errors.estimated):
                rows[..., 7 + k, :, :] = error.column(at)
        if at_polar is not None:
            rows[..., 0, :, :] -= (to_polar * (self.polar - at_polar)[:, None, :]).sum(axis=-3)
        return _whitened(rows, self.sigma_px, self.sigma_polar)

    def columns(
        self,
        camera: Camera,
        pose: RigidTransform,
        errors: Sequence[SystematicError],
        at_polar: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return d pixel / d error (k, 2, n), not whitened, of errors that are no unknowns of the fit."""
        true_polar = self.polar if at_polar is None else at_polar
        turned_m, d_polar = _turned(pose.rotation, true_polar)
        seen_m = turned_m + (pose.translation_m + self.errors.offset_m)[:, None]
        projected_px, d_point = camera.project_planes(seen_m)
        to_polar = np.einsum("irn,ikn->krn", d_point, d_polar)
        at = _sensitivity(camera, true_polar, projected_px, d_point, to_polar)
        at = _with_lens(at, camera, seen_m, errors)
        return np.array([error.column(at) for error in errors]).reshape(len(errors), *self.pixels_px.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Linearization:
    """Equation (2) at one pose or many, whitened by W with W S W^T = I, so that plain least squares is maximum likelihood.

    The properties without "planes" in their name require a single pose.

    Attributes:
        planes: (..., 10 + k, 2, n) W e; W d pixel / d (dt, dtheta), 6 of them; the same for k systematic errors;
            W d pixel / d polar, 3.
        whitening_planes: (..., 3, n) the entries 00, 10 and 11 of W, which is triangular.
        log_determinant: (..., n) of S.
    """

    planes: np.ndarray
    whitening_planes: np.ndarray
    log_determinant: np.ndarray

    @property
    def residual(self) -> Points2:
        """W e: (n, 2)."""
        return np.asarray(self.planes[0].T)

    @property
    def unknown_planes(self) -> np.ndarray:
        """W d pixel / d unknown: (..., 6 + k, 2, n), the pose and the systematic errors."""
        return np.asarray(self.planes[..., 1:-3, :, :])

    @property
    def polar_planes(self) -> np.ndarray:
        """W d pixel / d polar: (..., 3, 2, n)."""
        return np.asarray(self.planes[..., -3:, :, :])

    @property
    def pose_jacobian(self) -> np.ndarray:
        """W d pixel / d (dt, dtheta): (n, 2, 6)."""
        return np.asarray(self.planes[1:7].T)

    @property
    def jacobian(self) -> np.ndarray:
        """W d pixel / d unknown: (n, 2, 6 + k), the pose and the systematic errors."""
        return np.asarray(self.unknown_planes.T)

    @property
    def point_jacobian(self) -> np.ndarray:
        """W d pixel / d polar: (n, 2, 3)."""
        return np.asarray(self.polar_planes.T)

    @property
    def whitening(self) -> np.ndarray:
        """W: (n, 2, 2); zeros where the camera does not see the position."""
        whitening = np.zeros((self.whitening_planes.shape[-1], 2, 2))
        whitening[:, 0, 0], whitening[:, 1, 0], whitening[:, 1, 1] = self.whitening_planes
        return whitening

    @property
    def squared(self) -> np.ndarray:
        """Squared Mahalanobis distance of each residual: (..., n)."""
        return np.asarray(self.planes[..., 0, 0, :] ** 2 + self.planes[..., 0, 1, :] ** 2)

    def rows(self, rows: Indices) -> "Linearization":
        """Take rows (..., n) of the last axis, separately for each pose."""
        return Linearization(
            np.take_along_axis(self.planes, rows[..., None, None, :], axis=-1),
            np.take_along_axis(self.whitening_planes, rows[..., None, :], axis=-1),
            np.take_along_axis(self.log_determinant, rows, axis=-1),
        )


def linearize(
    camera_from_radar: RigidTransform,
    camera: Camera,
    *,
    pixels_px: Points2,
    sigma_px: Values,
    polar: Points3,
    sigma_polar: Points3,
    at_polar: Points3 | None = None,
) -> Linearization:
    """Linearize and whiten the projection of measured positions about a pose.

    Args:
        camera_from_radar: the pose.
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,).
        polar: (n, 3) measured range [m], azimuth, elevation [rad].
        sigma_polar: (n, 3).
        at_polar: (n, 3) the true positions mu to linearize at; None takes the measured ones.
    """
    measured = MeasurementPlanes(pixels_px.T, sigma_px, polar.T, sigma_polar.T)
    at = None if at_polar is None else at_polar.T
    return measured.linearize(camera, camera_from_radar.rotation, camera_from_radar.translation_m, at)


def _turned(rotations: np.ndarray, polar: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return polar positions (3, n) under each rotation as points (..., 3, n), and their derivatives (..., 3, 3, n)."""
    position_m, d_position = position_planes(polar)
    d_polar = (rotations @ d_position.reshape(3, -1)).reshape(*rotations.shape[:-2], *d_position.shape)
    return rotations @ position_m, d_polar


def _sensitivity(
    camera: Camera, polar: np.ndarray, projected_px: np.ndarray, d_point: np.ndarray, to_polar: np.ndarray
) -> Sensitivity:
    matrix_px = camera.matrix_px
    return Sensitivity(polar, d_point, to_polar, projected_px - matrix_px[:2, 2:], float(matrix_px[0, 0]))


def _with_lens(
    at: Sensitivity, camera: Camera, points_camera_m: np.ndarray, errors: Sequence[SystematicError]
) -> Sensitivity:
    """Add the derivatives by the camera's parameters, if an error asks for them."""
    if not any(error.of_lens for error in errors):
        return at
    return replace(at, d_parameter=camera.parameter_planes(points_camera_m))


def _whitened(rows: np.ndarray, sigma_px: Values, sigma_polar: np.ndarray) -> Linearization:
    """Multiply rows (..., 10 + k, 2, n) by W, W S W^T = I for S = C + J V J^T, from the Cholesky factor of the 2 x 2."""
    noisy = rows[..., -3:, :, :] * sigma_polar[:, None, :]
    u, v = noisy[..., 0, :], noisy[..., 1, :]
    click = sigma_px**2
    a = np.sqrt((u * u).sum(axis=-2) + click)
    b = (u * v).sum(axis=-2) / a
    c = np.sqrt((v * v).sum(axis=-2) + click - b * b)
    whitening = np.stack([1.0 / a, -b / (a * c), 1.0 / c], axis=-2)
    whiten_u, whiten_uv, whiten_v = (whitening[..., None, entry, :] for entry in range(3))
    log_determinant = 2.0 * np.log(a * c)
    planes = np.empty_like(rows)
    np.multiply(rows[..., 0, :], whiten_u, out=planes[..., 0, :])
    planes[..., 1, :] = rows[..., 1, :] * whiten_v + rows[..., 0, :] * whiten_uv
    unseen = ~np.isfinite(planes[..., 0, :, :]).all(axis=-2)
    if unseen.any():
        np.copyto(planes, 0.0, where=unseen[..., None, None, :])
        np.copyto(planes[..., 0, :, :], _FAR, where=unseen[..., None, :])
        np.copyto(whitening, 0.0, where=unseen[..., None, :])
        np.copyto(log_determinant, 0.0, where=unseen)
    return Linearization(planes, whitening, log_determinant)
