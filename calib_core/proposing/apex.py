"""The apex of a trihedral corner reflector near a given pixel, with its own covariance, or the reason why there is none.

Three sheets meet in the apex, so the image shows three sectors of different brightness, each below 180 deg. Discs of several
sizes propose pixels that look so (`score_sectors`), a fit with blurred boundaries gives the apex below a pixel (`fit_sectors`),
and the disc grows while the fit holds. The given pixel limits the search and enters no estimate. `is_corner` says which fits of
three sectors show the inner corner of a reflector, and not an edge, a line, a tip, an X or texture.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib_core.arrays import Indices, Matrix22, Values, Vector2, Vector3, freeze

_PROPOSING = ((1, 3.5), (1, 5.0), (1, 7.0), (2, 5.0), (2, 7.0), (4, 5.0), (4, 7.0))
"""How much the image is reduced, and the radius of the disc there [px]."""

_GROWING = ((1, 3.5), (1, 5.0), (1, 7.0), (1, 10.0), (1, 14.0), (2, 10.0), (2, 14.0))
_MARGIN_PX = 48
_LEAST_SCORE = 0.5

_TRIED = 3
"""How many places are fitted."""

_WORSE = 1.3
"""A larger disc may leave this much more than the one before."""

_RIVAL = 0.6
"""A second corner with this share of the first one's contrast makes the choice open."""

_FITTED, _BLUR, _MOVED, _FLOOR_PX2 = 3.4, 0.009, 0.14, 0.015
"""How the covariance follows from the fit's, the blur's square, the square of the last move, and what is always added: fitted
once to 560 simulated images (`python -m benchmarks.apex` measures the coverage on others)."""

_FEW_PIXELS_PX, _FEW_PIXELS_PX2 = 4.0, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class SectorFit:
    """A fit, in the pixels of the image it was made in.

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
        freeze(self, apex_px=(2,), starts_rad=(3,), covariance_px2=(2, 2))

    @property
    def widths_rad(self) -> Values:
        """The angles of the three sectors."""
        return np.diff(self.starts_rad, append=self.starts_rad[0] + 2.0 * np.pi)

    @property
    def contrast(self) -> float:
        """The smallest step, in standard deviations of what the fit leaves."""
        return self.step_grey / self.residual_grey


@dataclass(frozen=True, slots=True, eq=False)
class Apex:
    """The apex of a reflector in an image.

    Attributes:
        pixel_px: (2,) column and row; (0, 0) is the centre of the top-left pixel.
        covariance_px2: (2, 2) of that pixel.
        contrast: the smallest step of brightness between two sheets, in standard deviations of what the fit leaves.
        radius_px: of the disc in which the three sheets were seen.
    """

    pixel_px: Vector2
    covariance_px2: Matrix22
    contrast: float
    radius_px: float

    def __post_init__(self) -> None:
        freeze(self, pixel_px=(2,), covariance_px2=(2, 2))

    @property
    def sigma_px(self) -> float:
        """Standard deviation per axis, the root mean square of both."""
        return float(np.sqrt(0.5 * np.trace(self.covariance_px2)))


@dataclass(frozen=True, slots=True)
class NoApex:
    """No apex, or none that can be told from another.

    Attributes:
        reason: what was seen instead.
        several: it was several corners; a shorter reach may leave one.
    """

    reason: str
    several: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Reduced:
    """A part of the image, reduced: its pixel (0, 0) is at `corner_px` of the full one."""

    grey: np.ndarray
    factor: int
    corner_px: Vector2

    def of_full(self, pixel_px: Vector2) -> Vector2:
        return np.asarray((np.asarray(pixel_px) - self.corner_px) / self.factor)

    def to_full(self, pixel_px: Vector2) -> Vector2:
        return np.asarray(self.corner_px + self.factor * np.asarray(pixel_px))


@dataclass(frozen=True, slots=True, eq=False)
class _Proposal:
    score: float
    pixel_px: Vector2
    starts_rad: Vector3
    factor: int
    radius_px: float


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A fit in pixels of the full image, and how far the apex moved when the disc last grew."""

    fit: SectorFit
    pixel_px: Vector2
    factor: int
    moved_px: float


def find_apex(
    image: np.ndarray, near_px: Vector2, *, reach_px: float = 15.0, size_px: float | None = None
) -> Apex | NoApex:
    """Find the reflector's apex within reach of a pixel.

    Args:
        image: (h, w) grey levels or (h, w, 3) blue, green, red; uint8.
        near_px: (2,) where to search; it does not pull the answer.
        reach_px: how far from it the apex may be.
        size_px: width of the reflector, if known, about; corners of larger things are then refused.
    """
    near_px = np.asarray(near_px, dtype=np.float64)
    if not (np.all(near_px >= -reach_px) and np.all(near_px <= np.array(image.shape[1::-1]) + reach_px)):
        return NoApex("the given pixel lies outside the image")
    levels = _reduced(image, near_px, reach_px)
    proposals = _proposals(levels, near_px, reach_px)
    found = [one for proposal in proposals if (one := _grown(levels, proposal)) is not None]
    inside = [one for one in found if float(np.hypot(*(one.pixel_px - near_px))) <= reach_px]
    inside.sort(key=lambda one: -one.fit.contrast)
    if not inside:
        seen = "no three sheets that meet in one point" if proposals else "nothing with three sheets"
        return NoApex(f"{seen} within {reach_px:.0f} px")
    best, *others = inside
    apart_px = max(
        (float(np.hypot(*(rival.pixel_px - best.pixel_px))) for rival in _rival_corners(best, others)), default=0.0
    )
    if apart_px > 0.0:
        return NoApex(f"two corners of three sheets, {apart_px:.0f} px apart, fit equally well", several=True)
    radius_px = best.factor * best.fit.radius_px
    if size_px is not None and radius_px > size_px:
        return NoApex(f"the corner reaches {radius_px:.0f} px far, beyond a reflector of {size_px:.0f} px")
    return Apex(best.pixel_px, _covariance(best), best.fit.contrast, radius_px)


def _reduced(image: np.ndarray, near_px: Vector2, reach_px: float) -> dict[int, _Reduced]:
    """Cut out what the search can need, on a grid that does not depend on where it begins, and reduce it."""
    import cv2

    height, width = image.shape[:2]
    side = 4 * int(np.ceil((2.0 * (reach_px + _MARGIN_PX)) / 4.0)) + 4
    left, top = (4 * int((float(v) - reach_px - _MARGIN_PX) // 4) for v in near_px)
    rows = np.clip(np.arange(top, top + side), 0, height - 1)
    columns = np.clip(np.arange(left, left + side), 0, width - 1)
    part = image[rows[:, None], columns]
    grey = (part if part.ndim == 2 else cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)).astype(np.float32)
    corner_px = np.array([left, top], dtype=np.float64)
    grey = grey * grey / np.float32(255.0)
    reduced = {1: _Reduced(grey, 1, corner_px)}
    for factor in (2, 4):
        small = cv2.resize(grey, (side // factor, side // factor), interpolation=cv2.INTER_AREA)
        reduced[factor] = _Reduced(small, factor, corner_px + 0.5 * (factor - 1))
    return reduced


def _proposals(levels: dict[int, _Reduced], near_px: Vector2, reach_px: float) -> list[_Proposal]:
    """Return the best places, best first, each at the size at which it scores most."""
    every = [peak for factor, radius_px in _PROPOSING for peak in _peaks(levels[factor], near_px, reach_px, radius_px)]
    every.sort(key=lambda one: -one.score)
    chosen: list[_Proposal] = []
    for one in every:
        if len(chosen) == _TRIED:
            break
        if all(_are_apart(one, other) for other in chosen):
            chosen.append(one)
    return chosen


def _are_apart(proposal: _Proposal, other: _Proposal) -> bool:
    distance_px = float(np.hypot(*(proposal.pixel_px - other.pixel_px)))
    return distance_px > max(2.5, 0.4 * max(proposal.factor * proposal.radius_px, other.factor * other.radius_px))


def _peaks(level: _Reduced, near_px: Vector2, reach_px: float, radius_px: float) -> Iterator[_Proposal]:
    import cv2

    half = int(np.ceil(radius_px))
    near = level.of_full(near_px)
    reach = reach_px / level.factor + 1.5
    first, last = np.floor(near - reach).astype(int), np.ceil(near + reach).astype(int) + 1
    part = level.grey[first[1] - half : last[1] + half, first[0] - half : last[0] + half]
    scores, starts_rad = score_sectors(part, radius_px)
    highest = cv2.dilate(scores, np.ones((3, 3), np.uint8))
    for row, column in np.argwhere((scores >= highest) & (scores > _LEAST_SCORE)):
        pixel_px = level.to_full(np.array([column + first[0], row + first[1]], dtype=np.float64))
        if float(np.hypot(*(pixel_px - near_px))) <= reach_px + level.factor:
            score = float(scores[row, column])
            yield _Proposal(score, pixel_px, starts_rad[row, column], level.factor, radius_px)


def _grown(levels: dict[int, _Reduced], proposal: _Proposal) -> _Found | None:
    """Fit at the proposed size, then with larger discs as long as three sectors explain them as well.

    Returns:
        The largest that shows a corner; None if none does.
    """
    at = _fitted(levels, proposal.factor, proposal.pixel_px, proposal.starts_rad, proposal.radius_px, None)
    found = _checked(levels, proposal, at)
    size_px = proposal.factor * proposal.radius_px
    for factor, radius_px in _GROWING:
        if at is None or not _is_within(at.fit, _LOOSE):
            break
        if factor * radius_px <= size_px:
            continue
        larger = _fitted(levels, factor, at.pixel_px, at.fit.starts_rad, radius_px, at)
        if larger is None or larger.fit.residual_grey > _WORSE * at.fit.residual_grey + 0.3:
            break
        if not _angles_within(larger.fit, _strict_at(larger.fit.radius_px)):
            return None  # it fits as well, and knows the angles better
        if larger.moved_px > max(0.5, 4.0 * _sigma_px(at)):
            break
        at = larger
        found = _checked(levels, proposal, at) or found
    return found


def _checked(levels: dict[int, _Reduced], proposal: _Proposal, at: _Found | None) -> _Found | None:
    """Return a fit that shows a corner, else None."""
    if at is None:
        return None
    half_turn = half_turn_correlation(levels[at.factor].grey, at.fit)
    return at if is_corner(at.fit, proposal.score, half_turn) else None


def _fitted(
    levels: dict[int, _Reduced],
    factor: int,
    pixel_px: Vector2,
    starts_rad: Vector3,
    radius_px: float,
    before: _Found | None,
) -> _Found | None:
    level = levels[factor]
    blur_px = {} if before is None else {"blur_px": max(0.35, before.fit.blur_px * before.factor / factor)}
    fit = fit_sectors(level.grey, level.of_full(pixel_px), starts_rad, radius_px, **blur_px)
    if fit is None:
        return None
    full_px = level.to_full(fit.apex_px)
    return _Found(fit, full_px, factor, 0.0 if before is None else float(np.hypot(*(full_px - before.pixel_px))))


def _rival_corners(best: _Found, others: list[_Found]) -> list[_Found]:
    """Return other corners that fit about as well, and are not the same one."""
    return [
        one
        for one in others
        if one.fit.contrast >= _RIVAL * best.fit.contrast and float(np.hypot(*(one.pixel_px - best.pixel_px))) > 1.5
    ]


def _sigma_px(found: _Found) -> float:
    return found.factor * float(np.sqrt(0.5 * np.trace(found.fit.covariance_px2)))


def _covariance(found: _Found) -> Matrix22:
    """Widen the fit's covariance by what sheets, lens and compression add."""
    fit, factor = found.fit, found.factor
    added_px2 = _FLOOR_PX2 + _BLUR * (factor * fit.blur_px) ** 2 + _MOVED * found.moved_px**2
    if fit.radius_px < _FEW_PIXELS_PX:
        added_px2 += _FEW_PIXELS_PX2
    return np.asarray(_FITTED * factor**2 * fit.covariance_px2 + added_px2 * np.eye(2))


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
        grey: (h, w) the image.
        apex_px: (2,) where to begin; the disc is centred on the nearest pixel.
        starts_rad: (3,) where the sectors begin, ascending.
        radius_px: of the disc.
        blur_px: where to begin.

    Returns:
        None if the disc leaves the image or the apex leaves the disc.
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
    return _sector_fit(disc, state, at)


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
    from scipy.special import ndtr

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


def _sector_fit(disc: _Disc, state: Values, at: _Linearized) -> SectorFit | None:
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


@dataclass(frozen=True, slots=True)
class _Limits:
    """What a fit must show, for discs from a radius on: the smaller the disc, the more often chance looks like a corner.

    Attributes:
        from_px: the radius [px].
        contrast: least step between two sheets, in standard deviations of what the fit leaves.
        least_contrast: the same, at the worst place along a boundary.
        step_grey: least step [linear grey levels of 255].
        explained: least share of the variance.
        narrowest_deg: least angle of a sheet.
        widest_deg: greatest angle of a sheet: an edge or the tip of a sheet has 180 deg or more.
        blur: greatest blur, relative to the radius: smooth shading has no edges.
        score: least score of the proposal.
    """

    from_px: float
    contrast: float
    least_contrast: float
    step_grey: float
    explained: float
    narrowest_deg: float
    widest_deg: float
    blur: float
    score: float


_STRICT = (
    _Limits(12.0, 4.0, 2.5, 8.0, 0.98, 85.0, 157.0, 0.25, 0.50),
    _Limits(6.0, 4.0, 2.5, 8.0, 0.965, 85.0, 157.0, 0.30, 0.55),
    _Limits(4.0, 4.0, 2.5, 12.0, 0.94, 85.0, 155.0, 0.25, 0.55),
    _Limits(0.0, 6.0, 6.0, 16.0, 0.95, 86.0, 152.0, 0.30, 0.60),
)

_LOOSE = _Limits(0.0, 1.5, 0.0, 2.0, 0.70, 40.0, 170.0, 1.0, 0.0)

_STEEPEST = 2.2
"""Greatest change within a sheet, relative to the smallest step between two."""

_HALF_TURN = (-0.90, -0.15)
"""Correlation of a disc with itself turned by 180 deg: -1 for a straight edge, 1 for a line or the X of a checkerboard."""


def _strict_at(radius_px: float) -> _Limits:
    return next(one for one in _STRICT if radius_px >= one.from_px)


def is_corner(fit: SectorFit, score: float, half_turn: float) -> bool:
    """Return whether a fit shows three sheets that meet in one point.

    Args:
        fit: the fit.
        score: of the proposal that it began with.
        half_turn: the correlation of its disc with itself turned by 180 deg.
    """
    limits = _strict_at(fit.radius_px)
    steady = fit.slope_grey <= _STEEPEST * fit.step_grey
    return steady and score >= limits.score and _HALF_TURN[0] <= half_turn <= _HALF_TURN[1] and _is_within(fit, limits)


def _is_within(fit: SectorFit, limits: _Limits) -> bool:
    return bool(
        fit.contrast >= limits.contrast
        and fit.least_step_grey >= limits.least_contrast * fit.residual_grey
        and fit.step_grey >= limits.step_grey
        and fit.explained >= limits.explained
        and fit.blur_px <= limits.blur * fit.radius_px
        and _angles_within(fit, limits)
    )


def _angles_within(fit: SectorFit, limits: _Limits) -> bool:
    widths_deg = np.rad2deg(fit.widths_rad)
    return bool(widths_deg.min() >= limits.narrowest_deg and widths_deg.max() <= limits.widest_deg)


def half_turn_correlation(grey: np.ndarray, fit: SectorFit) -> float:
    """Return the correlation of the disc around the fitted apex with itself turned by 180 deg; 1 if it leaves the image.

    Args:
        grey: (h, w) the image of the fit.
        fit: the fit.
    """
    disc = _disc(grey, fit.apex_px, fit.radius_px)
    if disc is None:
        return 1.0
    levels = disc.grey - disc.grey.mean()
    return float(levels @ levels[::-1]) / max(float(levels @ levels), 1e-9)


_WEDGES = 12

_NARROWEST, _WIDEST = 2, 5
"""Wedges per sector: 60 to 150 deg. Seen from inside, each sheet of a trihedral spans less than 180 deg."""

_FINE = 7

_QUIET_GREY = 2.0
"""Where grey levels vary less than this, there is nothing to find."""


@lru_cache(maxsize=1)
def _divisions() -> Indices:
    """Return all ways to divide the wedges into three sectors: the first wedge of each (k, 3)."""
    widths = range(_NARROWEST, _WIDEST + 1)
    return np.array(
        [
            (start, start + width, start + width + two)
            for start in range(_WEDGES)
            for width in widths
            for two in widths
            if _WEDGES - width - two in widths and start + width + two < _WEDGES
        ]
    )


@lru_cache(maxsize=8)
def _wedge_kernels(radius_px: float) -> np.ndarray:
    """Return the share of each pixel of a disc that lies in each wedge: (wedges, n, n)."""
    half = int(np.ceil(radius_px))
    side = 2 * half + 1
    offsets = (np.arange(side * _FINE) + 0.5) / _FINE - 0.5 - half
    x, y = np.meshgrid(offsets, offsets)
    wedge = np.minimum((np.arctan2(y, x) % (2.0 * np.pi) / (2.0 * np.pi / _WEDGES)).astype(int), _WEDGES - 1)
    distance = np.hypot(x, y)
    inside = (distance <= radius_px) & (distance > 0.6)  # the middle pixel belongs to all
    shares = [(wedge == number) & inside for number in range(_WEDGES)]
    return np.array([share.reshape(side, _FINE, side, _FINE).mean(axis=(1, 3)) for share in shares], dtype=np.float32)


def score_sectors(grey: np.ndarray, radius_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the score of each pixel (h, w) whose disc lies inside the image, and where its sectors begin (h, w, 3) [rad].

    A score is what the weakest of the three boundaries explains, relative to what remains unexplained.

    Args:
        grey: (h + 2 n, w + 2 n) float32, with n the radius rounded up.
        radius_px: of the disc.
    """
    import cv2

    kernels = _wedge_kernels(radius_px)
    half = kernels.shape[1] // 2
    grey = grey - grey.mean()

    def summed(image: np.ndarray, kernel: np.ndarray) -> np.ndarray:
        return cv2.filter2D(image, cv2.CV_32F, kernel)[half:-half, half:-half]

    areas = kernels.sum(axis=(1, 2))
    sums = np.stack([summed(grey, kernel) for kernel in kernels])
    squares = summed(grey * grey, kernels.sum(axis=0))
    busy = np.nonzero(squares - sums.sum(axis=0) ** 2 / areas.sum() > areas.sum() * _QUIET_GREY**2)
    divisions = _divisions()
    score = np.zeros(squares.shape, dtype=np.float32)
    starts_rad = np.zeros((*squares.shape, 3))
    if len(busy[0]):
        scores = _weakest_boundary(sums[:, busy[0], busy[1]], squares[busy], areas, divisions)
        best = scores.argmax(axis=0)
        score[busy] = scores[best, np.arange(len(best))]
        starts_rad[busy] = divisions[best] * (2.0 * np.pi / _WEDGES)
    return score, starts_rad


def _weakest_boundary(sums: np.ndarray, squares: np.ndarray, areas: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return for each division (rows) and pixel (columns) the variance that its weakest boundary explains over the rest."""
    wedges = np.column_stack([sums, areas]).astype(np.float32)
    before = np.concatenate([np.zeros_like(wedges[:1]), np.cumsum(wedges, axis=0)])
    one, two = (before[first[:, k + 1]] - before[first[:, k]] for k in (0, 1))
    sectors = np.stack([one, two, before[-1] - one - two])
    area = sectors[..., -1:]
    means = sectors[..., :-1] / area
    rest = squares - (sectors[..., :-1] * means).sum(axis=0)
    other, other_area = means[[1, 2, 0]], area[[1, 2, 0]]
    boundary = ((means - other) ** 2 * (area * other_area / (area + other_area))).min(axis=0)
    return np.asarray(boundary / (np.maximum(rest, 0.0) + before[-1, -1]))
