"""Methods of other papers, written from what their texts say; none of their code was read.

None of them rejects outliers, and each gets what its paper assumes to be known: GMLPnP no noise at all, the bias-compensated
method the radar's sigmas and the click's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, skew
from calib_core.paper.pnp import solve_pnp
from calib_core.radar import covariance_from_sigma_polar

_STEPS, _NOISE_STEPS = 50, 30
_CONVERGED = 1e-10
_LEAST_SIGMA_M = 1e-6
_FEWEST = 6
"""A linear solution of the twelve entries of [R | t] needs six pairs."""


def gmlpnp(points_radar_m: Points3, pixels_px: Points2, camera: Camera) -> RigidTransform | None:
    """Generalized maximum likelihood PnP (arXiv 2408.01945): pose and one unknown covariance of all points, by turns.

    A radar point is p = s R m + c + e, with the pixel's ray m, its unknown depth s, and e of an unknown covariance.

    Args:
        points_radar_m: (n, 3).
        pixels_px: (n, 2).
        camera: any lens.
    """
    start = solve_pnp(points_radar_m, pixels_px, camera, "sqpnp")
    if start is None or len(points_radar_m) < _FEWEST:
        return start
    radar_from_camera, rays = start.inverse(), camera.rays(pixels_px)
    covariance_m2 = np.eye(3)
    for _ in range(_NOISE_STEPS):
        found = _pose_given_noise(radar_from_camera, points_radar_m, rays, covariance_m2)
        residuals_m = _depth_free(found, points_radar_m, rays, covariance_m2)[0]
        covariance_m2 = residuals_m.T @ residuals_m / len(rays) + _LEAST_SIGMA_M**2 * np.eye(3)
        moved, radar_from_camera = np.abs(found.error_from(radar_from_camera)).max(), found
        if moved < _CONVERGED:
            break
    return radar_from_camera.inverse()


def _depth_free(
    radar_from_camera: RigidTransform, points: Points3, rays: Points3, covariance_m2: np.ndarray
) -> tuple[Points3, Points3, np.ndarray]:
    """Return the residuals (n, 3) at the best depths, the points on the rays (n, 3), and the rays' weights (n, 3, 3)."""
    weight = np.linalg.inv(covariance_m2)
    turned = rays @ radar_from_camera.rotation.T
    weighted = turned @ weight
    gap = points - radar_from_camera.translation_m
    squared = (weighted * turned).sum(axis=1)
    on_ray = ((weighted * gap).sum(axis=1) / squared)[:, None] * turned
    across = weight - weighted[:, :, None] * weighted[:, None, :] / squared[:, None, None]
    return gap - on_ray, on_ray, across


def _pose_given_noise(
    radar_from_camera: RigidTransform, points: Points3, rays: Points3, covariance_m2: np.ndarray
) -> RigidTransform:
    """Minimise the Mahalanobis residuals over pose and depths (Gauss-Newton, halving steps that do not improve)."""

    def cost(pose: RigidTransform) -> float:
        residuals, _, across = _depth_free(pose, points, rays, covariance_m2)
        return float(np.einsum("ni,nij,nj->", residuals, across, residuals))

    pose, now = radar_from_camera, cost(radar_from_camera)
    for _ in range(_STEPS):
        residuals, on_ray, across = _depth_free(pose, points, rays, covariance_m2)
        jacobian = np.concatenate(
            [np.tile(-np.eye(3), (len(points), 1, 1)), np.array([skew(one) for one in on_ray])], axis=2
        )
        weighted = np.swapaxes(jacobian, 1, 2) @ across
        normal = (weighted @ jacobian).sum(axis=0)
        step = -np.linalg.lstsq(normal, (weighted @ residuals[..., None]).sum(axis=0)[:, 0], rcond=1e-14)[0]
        pose, now, moved = _improved(pose, step, now, cost)
        if moved < _CONVERGED:
            break
    return pose


def _improved(
    pose: RigidTransform, step: np.ndarray, now: float, cost: Callable[[RigidTransform], float]
) -> tuple[RigidTransform, float, float]:
    """Take a step, halved until the cost falls; return the pose, its cost, and the largest move."""
    for halvings in range(12):
        tried = pose.perturbed(step / 2**halvings)
        if (then := cost(tried)) < now:
            return tried, then, float(np.abs(step).max() / 2**halvings)
    return pose, now, 0.0


def unbiased_positions(points_radar_m: Points3, sigma_polar: Points3) -> Points3:
    """Undo what angle noise does to a Cartesian position on average: a cosine or sine shrinks by exp(-sigma^2 / 2)."""
    sigma = np.asarray(sigma_polar, dtype=np.float64)
    elevation = np.exp(0.5 * sigma[:, 2] ** 2)
    across = elevation * np.exp(0.5 * sigma[:, 1] ** 2)
    return np.asarray(points_radar_m * np.stack([across, across, elevation], axis=1))


def bias_compensated_pnp(
    points_radar_m: Points3, pixels_px: Points2, sigma_polar: Points3, sigma_px: float, camera: Camera
) -> RigidTransform | None:
    """Bias-compensated PnP for spherical noise, after the two steps of 3DUPnP (arXiv 2507.19829).

    First a linear solution whose expectation is right although positions and pixels are noisy, then Gauss-Newton on the
    reprojection error, weighted by the covariance that the noise of position and pixel gives it. With few pairs the linear
    solution can be far off, so SQPnP's is refined too and the likelier result is returned: kinder than the paper.

    Args:
        points_radar_m: (n, 3).
        pixels_px: (n, 2).
        sigma_polar: (n, 3) of range [m], azimuth and elevation [rad].
        sigma_px: of a click, per axis.
        camera: a lens without points behind it.
    """
    if len(points_radar_m) < _FEWEST:
        return None
    points = unbiased_positions(points_radar_m, sigma_polar)
    noise = _Noise(covariance_from_sigma_polar(points, sigma_polar), sigma_px)
    starts = (
        _bias_free_linear(points, noise, camera.rays(pixels_px), camera),
        solve_pnp(points, pixels_px, camera, "sqpnp"),
    )
    found = [_refined(start, points, pixels_px, noise, camera) for start in starts if start is not None]
    usable = [(score, pose) for score, pose in found if pose is not None]
    return min(usable, key=lambda one: one[0])[1] if usable else None


@dataclass(frozen=True, slots=True, eq=False)
class _Noise:
    """Covariances (n, 3, 3) of the positions [m^2], and the standard deviation of a click per axis [px]."""

    covariances_m2: np.ndarray
    sigma_px: float

    def spread(self, pose: RigidTransform, points: Points3, camera: Camera) -> np.ndarray:
        """Return the covariances (n, 2, 2) of the reprojection errors [px^2]."""
        towards = camera.project_with_jacobian(pose @ points)[1] @ pose.rotation
        return np.asarray(towards @ self.covariances_m2 @ np.swapaxes(towards, 1, 2) + self.sigma_px**2 * np.eye(2))


def _bias_free_linear(points: Points3, noise: _Noise, rays: Points3, camera: Camera) -> RigidTransform | None:
    """Solve x (r3 p + t3) = r1 p + t1 and the same of y, with what noise adds to the squares taken off."""
    centre, scale = points.mean(axis=0), float(np.std(points))
    n = len(points)
    one = np.concatenate([(points - centre) / scale, np.ones((n, 1))], axis=1)
    moment = one[:, :, None] * one[:, None, :]
    moment[:, :3, :3] -= noise.covariances_m2 / scale**2
    x, y = (rays[:, :2] / rays[:, 2:]).T
    squared = x**2 + y**2 - 2.0 * (noise.sigma_px / float(camera.matrix_px[0, 0])) ** 2
    top = moment.sum(axis=0)
    by_x, by_y = (-(value[:, None, None] * moment).sum(axis=0) for value in (x, y))
    zero = np.zeros((4, 4))
    equations = np.block(
        [[top, zero, by_x], [zero, top, by_y], [by_x, by_y, (squared[:, None, None] * moment).sum(axis=0)]]
    )
    values, vectors = np.linalg.eigh(equations)
    solution = vectors[:, np.argmin(np.abs(values))].reshape(3, 4)
    matrix, shift = solution[:, :3] / scale, solution[:, 3] - solution[:, :3] @ centre / scale
    sign = np.sign(np.median(points @ matrix[2] + shift[2]))  # what the camera sees is in front of it
    left, stretched, right = np.linalg.svd(sign * matrix)
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    size = float(stretched.mean())
    if not (np.isfinite(size) and size > 0.0):
        return None
    return RigidTransform(rotation, sign * shift / size)


def _refined(
    start: RigidTransform, points: Points3, pixels_px: Points2, noise: _Noise, camera: Camera
) -> tuple[float, RigidTransform | None]:
    """Minimise the Mahalanobis reprojection error; its weights follow the pose. Return minus twice the log likelihood too."""
    pose = start
    for _ in range(_STEPS):
        if not np.isfinite(camera.project(pose @ points)).all():
            return float("inf"), None
        weights = np.linalg.inv(noise.spread(pose, points, camera))

        def cost(tried: RigidTransform, weights: np.ndarray = weights) -> float:
            gap = pixels_px - camera.project(tried @ points)
            squared = float(np.einsum("ni,nij,nj->", gap, weights, gap))
            return squared if np.isfinite(squared) else float("inf")

        jacobian = camera.pose_jacobian(pose, points)
        weighted = np.swapaxes(jacobian, 1, 2) @ weights
        gap = pixels_px - camera.project(pose @ points)
        step = np.linalg.lstsq(
            (weighted @ jacobian).sum(axis=0), (weighted @ gap[..., None]).sum(axis=0)[:, 0], rcond=1e-14
        )[0]
        pose, _, moved = _improved(pose, step, cost(pose), cost)
        if moved < _CONVERGED:
            break
    spread = noise.spread(pose, points, camera)
    gap = pixels_px - camera.project(pose @ points)
    squared = np.einsum("ni,nij,nj->", gap, np.linalg.inv(spread), gap)
    return float(squared + np.linalg.slogdet(spread)[1].sum()), pose
