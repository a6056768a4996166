"""A first lens and first poses, from corners alone; some of the views may be wrong."""

import numpy as np

from calib_core.camera import Camera
from calib_core.intrinsics.solving.adjustment import adjust, adjust_robustly
from calib_core.intrinsics.solving.linearization import Freedom, LensState, ViewStack, residuals_of
from calib_core.lens_models.registry import LENS_MODELS

_FOCAL_LENGTHS = (0.2, 0.26, 0.33, 0.42, 0.55, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0)
"""Tried ones, as shares of the longer side of the picture; the poses fit well over a factor of 1.3."""

_POSE_STEPS = 4
_VOTERS = 16


def simple_camera(model: str, size_px: tuple[int, int], focal_px: float) -> Camera:
    """Return a camera without distortion, whose principal point is in the middle of the picture."""
    width, height = size_px
    matrix = np.array([[focal_px, 0.0, (width - 1) / 2.0], [0.0, focal_px, (height - 1) / 2.0], [0.0, 0.0, 1.0]])
    most = {"plumb_bob": 5}.get(model, LENS_MODELS[model].counts[-1])
    return Camera(model, width, height, matrix, np.zeros(most))


def start(model: str, stack: ViewStack) -> LensState | None:
    """Find a lens and poses from which an adjustment converges; None if no focal length explains the views.

    Several focal lengths are tried with the principal point in the middle. Each view's pose follows from the rays of its
    corners, which may be more than 90 deg from the axis, and the views vote by the median of their residuals, so that
    some of them may show something else.

    Args:
        model: a lens model's name.
        stack: the views.
    """
    some = stack.of(np.unique(np.linspace(0, len(stack) - 1, _VOTERS).astype(int)))
    cameras = [simple_camera(model, stack.size_px, share * max(stack.size_px)) for share in _FOCAL_LENGTHS]
    votes = [_voted(camera, some)[0] for camera in cameras]
    middle, state, stack = _voted(cameras[int(np.argmin(votes))], stack)
    if not np.isfinite(middle):
        return None
    for columns in _stages(state.camera):
        state = adjust_robustly(state, stack, Freedom(columns))
    return state


def _stages(camera: Camera) -> list[np.ndarray]:
    """Return what is freed, step by step: the focal length and the first coefficient, the principal point, all."""
    every = np.eye(len(camera.parameters))
    one_focal = every[:, :1] + every[:, 1:2]
    return [
        np.concatenate([one_focal, every[:, 4:5]], axis=1),
        np.concatenate([one_focal, every[:, 2:6]], axis=1),
        every,
    ]


def _voted(camera: Camera, stack: ViewStack) -> tuple[float, LensState, ViewStack]:
    """Pose the views with a camera that is kept.

    Returns:
        The median over views of the mean squared residual, the state, and the views that could be posed with weights.
    """
    state, posed = pose_views(camera, stack)
    squares = stack.mean_square(residuals_of(state, stack))
    lost = (posed.corner_counts == 0) | ~np.isfinite(squares)
    return float(np.median(np.where(lost, np.inf, squares))), state, posed


def pose_views(camera: Camera, stack: ViewStack) -> tuple[LensState, ViewStack]:
    """Pose each view by itself, by least squares; a view that the camera cannot have seen loses its weights.

    Args:
        camera: which is kept.
        stack: the views.
    """
    state = poses_from_rays(camera, stack)
    far = np.square(residuals_of(state, stack)).sum(axis=1)
    seen = np.asarray(np.isfinite(np.where(stack.weights > 0, far, 0.0)).all(axis=1))
    posed = stack.weighted(stack.weights * seen[:, None])
    return adjust(state, posed, Freedom.none(camera), steps=_POSE_STEPS), posed


def poses_from_rays(camera: Camera, stack: ViewStack) -> LensState:
    """Pose each view so that its corners lie on their rays; corners without a ray do not count.

    A ray r of a corner (x, y) is parallel to H (x, y, 1), where H = (r1, r2, t) holds two columns of the rotation and the
    translation: r x H (x, y, 1) = 0 is linear in H.
    """
    views, corners = stack.weights.shape
    rays = camera.rays(np.moveaxis(stack.pixels_px, 1, 2).reshape(-1, 2)).reshape(views, corners, 3)
    has_ray = np.isfinite(rays).all(axis=2)
    rays, weights = np.where(has_ray[:, :, None], rays, 0.0), stack.weights * has_ray
    side_m = float(np.abs(stack.board_m[:, :2]).max())
    middle = stack.board_m[:, :2].max(axis=(0, 2)) / 2.0
    flat = np.ones((views, corners, 3))
    flat[:, :, :2] = np.moveaxis(stack.board_m[:, :2] - middle[:, None], 1, 2) / side_m
    h = _homographies(rays, flat, weights)
    length = np.linalg.norm(h[:, :, :2], axis=1).mean(axis=1)
    ahead = np.sign(np.einsum("vmi,vij,vmj,vm->v", rays, h, flat, weights))
    h = h * (np.where(ahead < 0.0, -1.0, 1.0) / np.maximum(length, 1e-12))[:, None, None]
    u, _, vt = np.linalg.svd(np.stack([h[:, :, 0], h[:, :, 1], np.cross(h[:, :, 0], h[:, :, 1])], axis=2))
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    rotations = u @ vt
    return LensState(camera, rotations, h[:, :, 2] * side_m - rotations[:, :, :2] @ middle)


def _homographies(rays: np.ndarray, flat: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return H (v, 3, 3) with rays (v, m, 3) parallel to H flat (v, m, 3)."""
    zero = np.zeros_like(flat)
    x, y, z = (rays[:, :, axis, None] for axis in range(3))
    rows = np.concatenate(
        [
            np.concatenate([zero, -z * flat, y * flat], axis=2),
            np.concatenate([z * flat, zero, -x * flat], axis=2),
            np.concatenate([-y * flat, x * flat, zero], axis=2),
        ],
        axis=1,
    )
    rows = rows * np.tile(np.sqrt(weights), (1, 3))[:, :, None]
    return np.linalg.eigh(np.swapaxes(rows, 1, 2) @ rows)[1][:, :, 0].reshape(-1, 3, 3)
