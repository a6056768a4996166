"""Perspective-n-point (PnP) by OpenCV for every lens model. The only geometry module that imports cv2, and only when called.

OpenCV supports the pinhole and the Brown-Conrady lenses itself. For any other lens (and for a camera matrix with skew,
which OpenCV drops silently) the pixels are first converted to points of the plane z = 1, and the refinement is our own
Levenberg-Marquardt, so that the minimised error stays in pixels.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Values, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp, rotation_log, skew

PnPSolver = Literal["iterative", "sqpnp"]

_MINIMUM_POINTS = 4
_MINIMUM_POINTS_FOR_DLT = 6
_MINIMUM_POINTS_FOR_REFINEMENT = 3
_FLATTEST = 1e-6  # smallest ratio of second to first singular value of points that are not on one line
_LM_STEPS = 100
_LM_FIRST_DAMPING = 1e-3
_LM_LARGEST_DAMPING = 1e12
_LM_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class RansacSolution:
    """The result of RANSAC.

    Attributes:
        camera_from_radar: the pose fitted to the inliers.
        inliers: (n,) the points within the threshold of the winning sample's pose.
    """

    camera_from_radar: RigidTransform
    inliers: Flags

    def __post_init__(self) -> None:
        object.__setattr__(self, "inliers", frozen_array(self.inliers, (None,), dtype=np.bool_))


def spans_a_plane(points_radar_m: Points3) -> bool:
    """Return whether points (n, 3) span more than a point or a line; a rotation about a line cannot be observed."""
    points = np.asarray(points_radar_m, dtype=np.float64).reshape(-1, 3)
    if len(points) < 3 or not np.all(np.isfinite(points)):
        return False
    first, second, _ = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[:3]
    return bool(second > _FLATTEST * max(first, 1e-3))


def solve_pnp(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, solver: PnPSolver = "iterative"
) -> RigidTransform | None:
    """Solve camera_from_radar from all points, without outlier rejection.

    Args:
        points_radar_m: (n, 3), n >= 4.
        pixels_px: (n, 2) where each is seen.
        camera: any model.
        solver: OpenCV's iterative solver (DLT or homography, then Levenberg-Marquardt) or SQPnP.

    Returns:
        The pose, or None if the points are too few or on one line, or OpenCV finds no finite pose.
    """
    view = _view(points_radar_m, pixels_px, camera)
    if len(view.points) < _MINIMUM_POINTS or not spans_a_plane(view.points):
        return None
    start: dict[str, Any] = {}
    if solver == "iterative" and len(view.points) < _MINIMUM_POINTS_FOR_DLT:
        guess = _solved(view, "sqpnp")
        if guess is None:
            return None
        start = {"useExtrinsicGuess": True, **_vectors(guess)}
    return _solved(view, solver, **start)


def solve_pnp_ransac(
    points_radar_m: Points3,
    pixels_px: Points2,
    camera: Camera,
    solver: PnPSolver = "iterative",
    *,
    threshold_px: float = 8.0,
    iterations: int = 10_000,
    confidence: float = 0.99,
) -> RansacSolution | None:
    """Solve camera_from_radar by RANSAC around one of OpenCV's solvers; deterministic.

    Args:
        points_radar_m: (n, 3), n >= 4.
        pixels_px: (n, 2) where each is seen.
        camera: any model; for one that cv2.solvePnP does not support, the threshold is converted to the plane z = 1 by the mean
            focal length.
        solver: the solver for the samples and their consensus sets.
        threshold_px: largest reprojection error of an inlier [px].
        iterations: largest number of samples.
        confidence: stop early when an all-inlier sample has been drawn with this probability.

    Returns:
        The pose and its inliers, or None if RANSAC finds none, or the points are too few or on one line.
    """
    import cv2

    view = _view(points_radar_m, pixels_px, camera)
    if len(view.points) < _MINIMUM_POINTS or not spans_a_plane(view.points):
        return None
    try:
        found, rotation_vector, translation, rows = cv2.solvePnPRansac(
            view.points,
            view.pixels,
            view.matrix,
            view.distortion,
            flags=_flag(solver),
            reprojectionError=threshold_px / view.px_per_unit,
            iterationsCount=iterations,
            confidence=confidence,
        )
    except cv2.error:  # OpenCV asserts if its sample is degenerate
        return None
    if not found or rows is None or not len(rows):
        return None
    camera_from_radar = _transform(rotation_vector, translation)
    if camera_from_radar is None:
        return None
    inliers = np.zeros(len(view.usable), dtype=np.bool_)
    inliers[np.flatnonzero(view.usable)[np.asarray(rows).ravel()]] = True
    return RansacSolution(camera_from_radar=camera_from_radar, inliers=inliers)


def refine_lm(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, camera_from_radar: RigidTransform
) -> RigidTransform | None:
    """Minimise the sum of squared reprojection errors [px^2] over all points by Levenberg-Marquardt.

    Args:
        points_radar_m: (n, 3), n >= 3.
        pixels_px: (n, 2).
        camera: any model.
        camera_from_radar: the initial pose.

    Returns:
        The refined pose, or None if there are too few points or the refinement diverges.
    """
    import cv2

    points = np.ascontiguousarray(points_radar_m, dtype=np.float64)
    pixels = np.ascontiguousarray(pixels_px, dtype=np.float64)
    if len(points) < _MINIMUM_POINTS_FOR_REFINEMENT:
        return None
    if not _known_to_opencv(camera):
        return _refined(points, pixels, camera, camera_from_radar)
    start = _vectors(camera_from_radar)
    try:
        rotation_vector, translation = cv2.solvePnPRefineLM(
            points, pixels, np.array(camera.matrix_px), np.array(camera.distortion), start["rvec"], start["tvec"]
        )
    except cv2.error:
        return None
    return _transform(rotation_vector, translation)


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """Points and pixels in the form passed to OpenCV."""

    points: Points3
    pixels: Points2
    matrix: np.ndarray
    distortion: Values
    px_per_unit: float
    usable: Flags


def _view(points_radar_m: Points3, pixels_px: Points2, camera: Camera) -> _View:
    points = np.ascontiguousarray(points_radar_m, dtype=np.float64).reshape(-1, 3)
    pixels = np.ascontiguousarray(pixels_px, dtype=np.float64).reshape(-1, 2)
    if _known_to_opencv(camera):
        everything = np.ones(len(points), dtype=np.bool_)
        return _View(points, pixels, np.array(camera.matrix_px), np.array(camera.distortion), 1.0, everything)
    rays = camera.rays(pixels)
    with np.errstate(invalid="ignore"):
        usable = rays[:, 2] > 1e-3  # a ray at or beyond 90 deg never meets the plane z = 1
    plane = rays[usable, :2] / rays[usable, 2:]
    px_per_unit = float(camera.matrix_px[0, 0] + camera.matrix_px[1, 1]) / 2.0
    return _View(
        np.ascontiguousarray(points[usable]),
        np.ascontiguousarray(plane),
        np.eye(3),
        np.zeros(0),
        px_per_unit,
        usable,
    )


def _known_to_opencv(camera: Camera) -> bool:
    skewed = camera.matrix_px[0, 1] != 0.0 or camera.matrix_px[1, 0] != 0.0
    return camera.lens.opencv == "projectPoints" and not skewed


def _flag(solver: PnPSolver) -> int:
    import cv2

    return int(cv2.SOLVEPNP_SQPNP if solver == "sqpnp" else cv2.SOLVEPNP_ITERATIVE)


def _vectors(camera_from_radar: RigidTransform) -> dict[str, np.ndarray]:
    return {
        "rvec": rotation_log(camera_from_radar.rotation).reshape(3, 1),
        "tvec": np.array(camera_from_radar.translation_m).reshape(3, 1),
    }


def _solved(view: _View, solver: PnPSolver, **start: Any) -> RigidTransform | None:
    import cv2

    try:
        found, rotation_vector, translation = cv2.solvePnP(
            view.points, view.pixels, view.matrix, view.distortion, flags=_flag(solver), **start
        )
    except cv2.error:  # OpenCV asserts on degenerate points
        return None
    return _transform(rotation_vector, translation) if found else None


def _transform(rotation_vector: Any, translation: Any) -> RigidTransform | None:
    vector = np.asarray(rotation_vector, dtype=np.float64).reshape(3)
    translation_m = np.asarray(translation, dtype=np.float64).reshape(3)
    if not (np.all(np.isfinite(vector)) and np.all(np.isfinite(translation_m))):
        return None
    return RigidTransform(rotation_exp(vector), translation_m)


def _refined(
    points: Points3, pixels: Points2, camera: Camera, camera_from_radar: RigidTransform
) -> RigidTransform | None:
    """Run Levenberg-Marquardt on (dt, dtheta) with the analytic Jacobian of Camera.project_with_jacobian."""
    best = camera_from_radar
    residuals, jacobian = _linearized(points, pixels, camera, best)
    cost = float(residuals @ residuals)
    if not np.isfinite(cost):
        return None
    damping = _LM_FIRST_DAMPING
    for _ in range(_LM_STEPS):
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residuals
        step = -np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), gradient, rcond=None)[0]
        trial = best.perturbed(step)
        trial_residuals, trial_jacobian = _linearized(points, pixels, camera, trial)
        trial_cost = float(trial_residuals @ trial_residuals)
        if not trial_cost <= cost:  # also if a point has left the lens and the cost is NaN
            damping *= 10.0
            if damping > _LM_LARGEST_DAMPING:
                break
            continue
        gain = cost - trial_cost
        best, residuals, jacobian, cost = trial, trial_residuals, trial_jacobian, trial_cost
        damping = max(damping / 10.0, 1e-15)
        if gain <= _LM_TOLERANCE * cost or float(np.abs(step).max()) < _LM_TOLERANCE:
            break
    return best


def _linearized(
    points: Points3, pixels: Points2, camera: Camera, camera_from_radar: RigidTransform
) -> tuple[Values, np.ndarray]:
    """Return the stacked residuals (2n,) [px] and their derivative (2n, 6) by (dt, dtheta)."""
    turned = points @ camera_from_radar.rotation.T
    projected, d_pixel = camera.project_with_jacobian(turned + camera_from_radar.translation_m)
    d_point = np.zeros((len(points), 3, 6))
    d_point[:, :, :3] = np.eye(3)
    d_point[:, :, 3:] = np.stack([-skew(point) for point in turned])
    return (projected - pixels).ravel(), (d_pixel @ d_point).reshape(-1, 6)
