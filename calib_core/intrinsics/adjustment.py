"""Least squares over lens, shape of the board and all poses (Levenberg-Marquardt, poses eliminated by the Schur complement).

`adjust_robustly` weighs down corners and views that do not fit. `start` gives it a first lens and first poses, from corners
alone; some of the views may be wrong. `shared_covariance` says how well lens and board shape are known afterwards, if the
errors of corners in one view belong together.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values, freeze
from calib_core.camera import Camera
from calib_core.intrinsics.linearization import Freedom, LensState, Linearized, ViewStack, linearize, residuals_of
from calib_core.lens_models.registry import LENS_MODELS

_STEPS = 60
_FIRST_DAMPING = 1e-4
_LEAST_DAMPING = 1e-12
_MOST_DAMPING = 1e8
_SETTLED = 1e-10  # of the cost, relative: steps that gain less do not change what is stated


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """The normal equations of lens and warp, after each view's pose has been eliminated.

    Attributes:
        information: (v, q, q) what each view says about the q free numbers.
        gradients: (v, q) of half the cost with respect to them.
        prior: (q, q) what is known without the views.
        noise_px2: the variance of a corner along either axis, if all were independent.
    """

    information: np.ndarray
    gradients: np.ndarray
    prior: np.ndarray
    noise_px2: float


def weighted_cost(residuals_px: np.ndarray, stack: ViewStack) -> float:
    """Return half the weighted sum of squares [px^2]; infinite if a corner with a weight cannot be projected."""
    squares = np.where(stack.weights > 0, np.square(residuals_px).sum(axis=1) * stack.weights, 0.0)
    total = 0.5 * float(squares.sum())
    return total if np.isfinite(total) else float("inf")


def reduced(at: Linearized) -> Reduced:
    """Eliminate the poses: what remains of the slopes is orthogonal to each view's own."""
    poses_t = np.swapaxes(at.poses, 1, 2)
    within = np.linalg.solve(at.poses @ poses_t, at.poses @ np.swapaxes(at.shared, 1, 2))
    slopes = at.shared - np.swapaxes(within, 1, 2) @ at.poses
    within = np.linalg.solve(at.poses @ poses_t, at.poses @ at.residuals[:, :, None])
    left = at.residuals - (poses_t @ within)[:, :, 0]
    rows = int((at.poses != 0.0).any(axis=1).sum())
    free = rows - 6 * len(left) - slopes.shape[1]
    return Reduced(
        slopes @ np.swapaxes(slopes, 1, 2),
        (slopes @ left[:, :, None])[:, :, 0],
        at.prior,
        float(np.square(left).sum()) / max(free, 1),
    )


def adjust(state: LensState, stack: ViewStack, freedom: Freedom, *, steps: int = _STEPS) -> LensState:
    """Return the state that minimizes the weighted squares, from a start nearby.

    Args:
        state: the start.
        stack: the corners with their weights.
        freedom: what may change besides the poses.
        steps: at most so many.
    """
    if len(state.amounts) != len(freedom.warp):
        state = LensState(state.camera, state.rotations, state.translations_m, np.zeros(len(freedom.warp)))
    cost = _cost(state, stack, freedom)
    damping = _FIRST_DAMPING
    for _ in range(steps):
        at = linearize(state, stack, freedom)
        before = cost
        while damping <= _MOST_DAMPING:
            trial = _stepped(state, at, freedom, damping)
            trial_cost = float("inf") if trial is None else _cost(trial, stack, freedom)
            if trial is not None and trial_cost <= cost:
                state, cost = trial, trial_cost
                damping = max(damping / 10.0, _LEAST_DAMPING)
                break
            damping *= 10.0
        if before - cost <= _SETTLED * before or damping > _MOST_DAMPING:
            break
    return state


def _cost(state: LensState, stack: ViewStack, freedom: Freedom) -> float:
    return weighted_cost(residuals_of(state, stack, freedom.warp), stack) + freedom.pull_cost(state.camera)


def _stepped(state: LensState, at: Linearized, freedom: Freedom, damping: float) -> LensState | None:
    """Return the state after one damped Gauss-Newton step; None if there is no such lens."""
    poses_t = np.swapaxes(at.poses, 1, 2)
    own = at.poses @ poses_t
    scale = np.einsum("vii->vi", own)[:, :, None]
    own = own + np.where(scale > 0.0, damping * scale, 1.0) * np.eye(6)  # a view without weights stays where it is
    mixed = at.shared @ poses_t
    gradient_own = (at.poses @ at.residuals[:, :, None])[:, :, 0]
    solved = np.linalg.solve(own, np.concatenate([np.swapaxes(mixed, 1, 2), gradient_own[:, :, None]], axis=2))
    step = _shared_step(at, mixed, solved, damping)
    poses = -solved[:, :, -1] - (solved[:, :, :-1] @ step)
    lens_count = freedom.lens.shape[1]
    try:
        values = state.camera.parameters + freedom.lens @ step[:lens_count]
        camera = state.camera.with_parameters(values) if lens_count else state.camera
        return state.moved(camera, poses, state.amounts + step[lens_count:])
    except ValueError:  # a focal length that is not positive, or numbers that are not finite
        return None


def _shared_step(at: Linearized, mixed: np.ndarray, solved: np.ndarray, damping: float) -> Values:
    """Solve the reduced normal equations for the step of lens and warp (q,)."""
    count = at.shared.shape[1]
    if count == 0:
        return np.zeros(0)
    full = (at.shared @ np.swapaxes(at.shared, 1, 2)).sum(axis=0) + at.prior
    right = (at.shared @ at.residuals[:, :, None])[:, :, 0].sum(axis=0) + at.prior_gradient
    scale = np.sqrt(np.maximum(np.diag(full), 1e-300))
    system = (full - (mixed @ solved[:, :, :-1]).sum(axis=0)) / np.outer(scale, scale)
    right = (right - (mixed @ solved[:, :, -1:])[:, :, 0].sum(axis=0)) / scale
    system += damping * np.eye(count) + 1e-15 * np.eye(count)
    return np.asarray(-np.linalg.solve(system, right) / scale)


_ROUNDS = 12
_ROBUST_STEPS = 2
_REACH = 4.0  # in standard deviations: a corner that far away has a quarter of its weight
_FLOOR_PX = 0.01
_MEDIAN_DISTANCE = 1.1774  # of a point scattered with a standard deviation of 1 along both axes
_ROBUST_SETTLED = 0.02


def typical_sigma(residuals_px: np.ndarray, stack: ViewStack) -> float:
    """Return the standard deviation [px] per axis of the corners that fit, from the median distance."""
    distances = np.sqrt(np.square(residuals_px).sum(axis=1))[stack.weights > 0]
    distances = np.where(np.isnan(distances), np.inf, distances)  # not imaged is far off
    return max(float(np.median(distances)) / _MEDIAN_DISTANCE, _FLOOR_PX) if len(distances) else _FLOOR_PX


def adjust_robustly(state: LensState, stack: ViewStack, freedom: Freedom) -> LensState:
    """Adjust with the loss of Geman and McClure, whose scale follows the median residual down.

    Args:
        state: the start.
        stack: the corners; those with weight 0 stay out.
        freedom: what may change besides the poses.
    """
    sigma = np.inf
    for _ in range(_ROUNDS):
        residuals = residuals_of(state, stack, freedom.warp)
        before, sigma = sigma, typical_sigma(residuals, stack)
        far = np.square(residuals).sum(axis=1) / (_REACH * sigma) ** 2
        weights = np.where(np.isfinite(far), 1.0 / np.square(1.0 + far), 0.0)
        state = adjust(state, stack.weighted(np.where(stack.weights > 0, weights, 0.0)), freedom, steps=_ROBUST_STEPS)
        if abs(before - sigma) <= _ROBUST_SETTLED * sigma:
            break
    return state


_FOCAL_LENGTHS = (0.2, 0.26, 0.33, 0.42, 0.55, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0)
"""Tried ones, as shares of the longer side of the image; the poses fit well over a factor of 1.3."""

_POSE_STEPS = 4
_VOTERS = 16


def simple_camera(model: str, size_px: tuple[int, int], focal_px: float) -> Camera:
    """Return a camera without distortion, whose principal point is in the middle of the image."""
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


_NORMAL_95 = 1.959963984540054
_LEAST_FREEDOM = 1.5
_LEAST_SHARE = 0.1  # of the variance that independent corners would give


@dataclass(frozen=True, slots=True, eq=False)
class SharedCovariance:
    """The covariance of the free numbers of lens and warp.

    Attributes:
        matrix: (q, q); 1.96 standard deviations contain the truth in 95 % of cases.
        freedom: (q,) degrees of freedom with which each variance was estimated.
    """

    matrix: np.ndarray
    freedom: Values

    def __post_init__(self) -> None:
        freeze(self, matrix=(None, None), freedom=(None,))

    def chances(self, values: Values, first: int = 0) -> Values:
        """Return how likely values as far from zero are, if the truth is zero: (n,).

        Args:
            values: (n,) estimates of the free numbers from one on.
            first: the number of that one.
        """
        from scipy.special import stdtr

        places = slice(first, first + len(values))
        freedom = self.freedom[places]
        sigma = np.sqrt(np.diag(self.matrix)[places]) / _grown(freedom)
        return np.asarray(2.0 * stdtr(freedom, -np.abs(values) / np.maximum(sigma, 1e-300)))


def shared_covariance(at: Reduced) -> SharedCovariance:
    """Estimate the covariance from how much the views contradict each other, not from how much their corners do.

    Errors of corners in one view belong together: blur, light, motion under a rolling shutter and the detector shift
    neighbors alike, so that counting corners would state too little. Views are independent. Their scores g_v give the
    variance of the estimate (White's sandwich over clusters), each freed of what the fit has already taken up of its own
    view (Bell and McCaffrey's CR2), and Student's quantile with their degrees of freedom accounts for the number of views.

    Args:
        at: the normal equations of each view, at the estimate.
    """
    information = at.information.sum(axis=0) + at.prior
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    values = np.maximum(values, values[-1] * 1e-15)
    white = scale[:, None] * vectors / np.sqrt(values)  # white @ white.T is the inverse of the information
    shares = white.T @ at.information @ white  # (v, q, q); they sum to one
    own, axes = np.linalg.eigh(shares)
    gains = 1.0 / np.sqrt(np.maximum(1.0 - own, 1e-3))
    freed = (axes * gains[:, None, :]) @ np.swapaxes(axes, 1, 2)  # (1 - share)^(-1/2)
    scores = (freed @ (white.T @ at.gradients.T).T[:, :, None])[:, :, 0]
    middle = _at_least(scores.T @ scores, _LEAST_SHARE * at.noise_px2)
    known = at.prior @ white
    middle = middle + known.T @ known  # what is pulled has a standard deviation of about one
    freedom = _degrees_of_freedom(white, shares, freed)
    grown = _grown(freedom)
    matrix = (white @ middle @ white.T) * np.outer(grown, grown)
    return SharedCovariance((matrix + matrix.T) / 2.0, freedom)


def _at_least(middle: np.ndarray, least: float) -> np.ndarray:
    """Return a covariance with a variance of at least so much in each direction.

    Few views leave directions in which none contradicts another, and so do views that repeat each other; that is no knowledge.
    """
    values, axes = np.linalg.eigh(middle)
    return np.asarray((axes * np.maximum(values, least)) @ axes.T)


def _grown(freedom: Values) -> Values:
    """Return the ratio of Student's quantile of 95 % to the normal one."""
    from scipy.special import stdtrit

    return np.asarray(stdtrit(freedom, 0.975) / _NORMAL_95)


def _degrees_of_freedom(white: np.ndarray, shares: np.ndarray, freed: np.ndarray) -> Values:
    """Return Satterthwaite's degrees of freedom (q,) of the variances, for errors that are alike in all corners."""
    loads = np.einsum("vab,ib->via", freed, white)  # of each view on each parameter
    mixed = np.einsum("vab,vib->via", shares, loads)
    products = -np.einsum("uia,via->iuv", mixed, mixed)
    rows = np.arange(len(shares))
    products[:, rows, rows] += np.einsum("via,via->iv", loads, mixed)
    trace = np.einsum("ivv->i", products)
    return np.asarray(np.maximum(trace**2 / np.maximum(np.square(products).sum(axis=(1, 2)), 1e-300), _LEAST_FREEDOM))
