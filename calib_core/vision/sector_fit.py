"""The least-squares fit of three sectors with blurred boundaries to the grey levels of a disc."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from calib_core.arrays import Matrix22, Values, Vector2, Vector3, frozen_array

_SLOPES_FROM_PX = 5.0
"""Smaller discs have too few pixels to tell a slope within a sector from the boundaries."""
_FIRST_BLUR_PX = 0.7
_LEAST_BLUR_PX = 0.35
_MOST_BLUR = 0.35
"""Largest blur, relative to the radius of the disc."""
_ITERATIONS = 12
_STEP_LIMIT = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.3])
_ENOUGH_PX = 0.02
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
_ROUNDING_GREY2 = 1.0 / 12.0


@dataclass(frozen=True, slots=True, eq=False)
class SectorFit:
    """A fit, in the pixels of the picture it was made in.

    Attributes:
        apex_px: (2,) where the sectors meet.
        starts_rad: (3,) directions of the boundaries, from x towards y, ascending.
        blur_px: standard deviation of the boundaries' blur.
        radius_px: of the disc.
        residual_grey: standard deviation of what the fit leaves.
        explained: share of the variance in the disc that it explains.
        step_grey: the smallest difference of grey levels across a boundary, half-way out.
        least_step_grey: the smallest anywhere along the boundaries; 0 if one changes its sign.
        slope_grey: the largest change of grey levels within a sector, over one radius.
        covariance_px2: (2, 2) of the apex if the residuals were independent.
    """

    apex_px: Vector2
    starts_rad: Vector3
    blur_px: float
    radius_px: float
    residual_grey: float
    explained: float
    step_grey: float
    least_step_grey: float
    slope_grey: float
    covariance_px2: Matrix22

    def __post_init__(self) -> None:
        for name, shape in (("apex_px", (2,)), ("starts_rad", (3,)), ("covariance_px2", (2, 2))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), shape))

    @property
    def widths_rad(self) -> Values:
        """The angles of the three sectors."""
        return np.diff(self.starts_rad, append=self.starts_rad[0] + 2.0 * np.pi)

    @property
    def contrast(self) -> float:
        """The smallest step, in standard deviations of what the fit leaves."""
        return self.step_grey / self.residual_grey


@dataclass(frozen=True, slots=True, eq=False)
class _Disc:
    """The pixels of a disc: offsets (n,) from its middle pixel, and grey levels (n,)."""

    middle_px: Vector2
    x: Values
    y: Values
    grey: Values
    radius_px: float


@dataclass(frozen=True, slots=True, eq=False)
class _Linearized:
    """The fit at one state (x, y, three directions, blur): what it leaves, and derivatives with the levels solved for."""

    levels: Values
    left: Values
    jacobian: np.ndarray

    @property
    def cost(self) -> float:
        return float(self.left @ self.left)


def fit_sectors(
    grey: np.ndarray, apex_px: Vector2, starts_rad: Vector3, radius_px: float, blur_px: float = _FIRST_BLUR_PX
) -> SectorFit | None:
    """Fit apex, directions, blur and grey levels to the disc around a first apex.

    Args:
        grey: (h, w) the picture.
        apex_px: (2,) where to begin; the disc is centred on the nearest pixel.
        starts_rad: (3,) where the sectors begin, ascending.
        radius_px: of the disc.
        blur_px: where to begin.

    Returns:
        None if the disc leaves the picture or the apex leaves the disc.
    """
    disc = _disc(grey, apex_px, radius_px)
    if disc is None:
        return None
    state = np.array([*(np.asarray(apex_px) - disc.middle_px), *starts_rad, blur_px])
    at = _linearize(disc, state)
    damping = 1e-3
    for _ in range(_ITERATIONS):
        normal = at.jacobian @ at.jacobian.T
        damped = normal + damping * np.diag(np.diag(normal) + 1e-9)
        step = np.clip(np.linalg.solve(damped, at.jacobian @ at.left), -_STEP_LIMIT, _STEP_LIMIT)
        new_state = state + step
        new_state[5] = np.clip(new_state[5], _LEAST_BLUR_PX, _MOST_BLUR * radius_px)
        new = _linearize(disc, new_state)
        if new.cost >= at.cost:
            damping *= 6.0
            if damping > 1e3:
                break
            continue
        settled = float(np.abs(new_state - state)[:2].max()) < _ENOUGH_PX
        state, at, damping = new_state, new, damping / 4.0
        if settled:
            break
    return _described(disc, state, at)


def _disc(grey: np.ndarray, apex_px: Vector2, radius_px: float) -> _Disc | None:
    half = int(np.ceil(radius_px))
    column, row = (round(float(v)) for v in apex_px)
    height, width = grey.shape
    if not (half <= column < width - half and half <= row < height - half):
        return None
    x, y = np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1))
    inside = x * x + y * y <= radius_px * radius_px
    levels = grey[row - half : row + half + 1, column - half : column + half + 1][inside]
    middle_px = np.array([column, row], dtype=np.float64)
    return _Disc(middle_px, x[inside].astype(float), y[inside].astype(float), levels.astype(float), radius_px)


def _linearize(disc: _Disc, state: Values) -> _Linearized:
    """Solve for the grey levels at a state, and differentiate what is left (variable projection).

    A sector is the product of two blurred half-planes, which is exact away from the apex; the shares are scaled to sum to 1.
    """
    x, y, blur = disc.x - state[0], disc.y - state[1], state[5]
    cos, sin = np.cos(state[2:5, None]), np.sin(state[2:5, None])
    across, along = (cos * y - sin * x) / blur, cos * x + sin * y
    past = ndtr(across)
    before = 1.0 - past[_NEXT]
    products = past * before
    total = products.sum(axis=0) + 1e-9
    basis = shares = products / total
    sloped = disc.radius_px >= _SLOPES_FROM_PX
    if sloped:
        basis = np.concatenate([shares, shares * (disc.x / disc.radius_px), shares * (disc.y / disc.radius_px)])
    normal = basis @ basis.T
    normal[np.diag_indices(len(normal))] += 1e-6 * len(disc.grey)
    levels = np.linalg.solve(normal, basis @ disc.grey)
    sheets = levels[:3, None]
    if sloped:
        sheets = sheets + (levels[3:6, None] * disc.x + levels[6:9, None] * disc.y) / disc.radius_px
    fitted = levels @ basis
    by_product = (sheets - fitted) / total
    by_past = by_product * before - (by_product * past)[_LAST]
    by_across = by_past * np.exp(-0.5 * across * across) / (blur * np.sqrt(2.0 * np.pi))
    jacobian = np.empty((6, len(disc.grey)))
    jacobian[0], jacobian[1] = sin[:, 0] @ by_across, -cos[:, 0] @ by_across
    jacobian[2:5] = -by_across * along
    jacobian[5] = -(by_across * across).sum(axis=0)
    jacobian -= np.linalg.solve(normal, basis @ jacobian.T).T @ basis
    return _Linearized(levels, disc.grey - fitted, jacobian)


def _described(disc: _Disc, state: Values, at: _Linearized) -> SectorFit | None:
    if float(np.hypot(state[0], state[1])) > disc.radius_px:
        return None
    freedom = max(len(disc.grey) - len(at.levels) - len(state), 1)
    variance = at.cost / freedom + _ROUNDING_GREY2
    normal = at.jacobian @ at.jacobian.T
    normal[np.diag_indices(6)] += 1e-9
    total = float(((disc.grey - disc.grey.mean()) ** 2).sum())
    near, half_way, far = (_steps(disc, state, at.levels, share) for share in (0.15, 0.6, 0.9))
    return SectorFit(
        apex_px=disc.middle_px + state[:2],
        starts_rad=state[2:5],
        blur_px=float(state[5]),
        radius_px=disc.radius_px,
        residual_grey=float(np.sqrt(variance)),
        explained=1.0 - at.cost / max(total, 1e-9),
        step_grey=float(np.abs(half_way).min()),
        least_step_grey=float(np.where(near * far > 0.0, np.minimum(np.abs(near), np.abs(far)), 0.0).min()),
        slope_grey=float(np.hypot(at.levels[3:6], at.levels[6:9]).max()) if len(at.levels) == 9 else 0.0,
        covariance_px2=variance * np.linalg.inv(normal)[:2, :2],
    )


def _steps(disc: _Disc, state: Values, levels: Values, share: float) -> Vector3:
    """Return the differences of grey levels across the boundaries (3,) at a share of the radius from the apex."""
    ends = share * disc.radius_px * np.stack([np.cos(state[2:5]), np.sin(state[2:5])], axis=1) + state[:2]
    sheets = np.tile(levels[:3], (3, 1))
    if len(levels) == 9:
        sheets = sheets + ends @ levels[3:].reshape(2, 3) / disc.radius_px
    return np.array([sheets[k, k] - sheets[k, k - 1] for k in range(3)])
