"""The apex of a trihedral corner reflector near a given pixel, with its own covariance, or the reason why there is none.

Three sheets meet in the apex, so the image shows three sectors of different brightness, each below 180 deg. Discs of several
sizes propose pixels that look so (`score_sectors`), and a fit with blurred boundaries gives the apex below a pixel. The given
pixel limits the search and enters no estimate. An edge, a line, the tip of a sheet, a T or an X leaves too much, or has other
angles.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib_core.arrays import Indices, Matrix22, Values, Vector2, Vector3, freeze

_SIZES = ((1, 3.5), (1, 5.0), (1, 7.0), (2, 5.0), (2, 7.0), (4, 5.0), (4, 7.0))
"""How much the image is reduced, and the radius of the disc there [px]."""
_MARGIN_PX = 48
_TRIED = 3
"""How many places are fitted."""
_SAME, _SAME_PX = 0.4, 2.5
"""How far apart two peaks of one place lie at most: in radii of the larger disc, and what is always one."""
_RIVAL = 0.6
"""A second corner with this share of the first one's contrast makes the choice open."""


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
class _Place:
    """A pixel of the full image around which a disc of a reduced one shows three sectors."""

    score: float
    pixel_px: Vector2
    starts_rad: Vector3
    level: _Reduced
    radius_px: float

    @property
    def size_px(self) -> float:
        """Radius of the disc in the full image."""
        return self.level.factor * self.radius_px


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
    seen = [place for size in _SIZES for place in _peaks(levels[size[0]], near_px, reach_px, size[1])]
    places = _places(seen)
    found = [apex for place in places if (apex := _fitted(place)) is not None]
    inside = [apex for apex in found if float(np.hypot(*(apex.pixel_px - near_px))) <= reach_px]
    if not inside:
        what = "no three sheets that meet in one point" if places else "nothing with three sheets"
        return NoApex(f"{what} within {reach_px:.0f} px")
    best = max(inside, key=lambda apex: apex.contrast)
    rivals_px = [apex.pixel_px - best.pixel_px for apex in inside if apex.contrast >= _RIVAL * best.contrast]
    apart_px = float(np.hypot(*np.transpose(rivals_px)).max())
    if apart_px > 1.5:
        return NoApex(f"two corners of three sheets, {apart_px:.0f} px apart, fit equally well", several=True)
    radius_px = max([best.radius_px, *(place.size_px for place in seen if _lies_at(place, best.pixel_px))])
    if size_px is not None and radius_px > size_px:
        return NoApex(f"the corner reaches {radius_px:.0f} px far, beyond a reflector of {size_px:.0f} px")
    return replace(best, radius_px=radius_px)


def _reduced(image: np.ndarray, near_px: Vector2, reach_px: float) -> dict[int, _Reduced]:
    """Cut out what the search can need, on a grid that does not depend on where it begins, and reduce it.

    Grey levels are squared, which undoes most of a camera's gamma: blur is symmetric in linear light only.
    """
    import cv2

    height, width = image.shape[:2]
    side = 4 * int(np.ceil((2.0 * (reach_px + _MARGIN_PX)) / 4.0)) + 4
    left, top = (4 * int((float(v) - reach_px - _MARGIN_PX) // 4) for v in near_px)
    rows = np.clip(np.arange(top, top + side), 0, height - 1)
    columns = np.clip(np.arange(left, left + side), 0, width - 1)
    part = image[rows[:, None], columns]
    grey = (part if part.ndim == 2 else cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)).astype(np.float32)
    grey = grey * grey / np.float32(255.0)
    corner_px = np.array([left, top], dtype=np.float64)
    return {
        factor: _Reduced(
            cv2.resize(grey, (side // factor,) * 2, interpolation=cv2.INTER_AREA),
            factor,
            corner_px + 0.5 * (factor - 1),
        )
        for factor in (1, 2, 4)
    }


def _places(seen: Sequence[_Place]) -> list[_Place]:
    """Return the best places, best first, each at the size at which it scores most."""
    chosen: list[_Place] = []
    for place in sorted(seen, key=lambda one: -one.score):
        if len(chosen) < _TRIED and not any(_lies_at(place, one.pixel_px, one.size_px) for one in chosen):
            chosen.append(place)
    return chosen


def _lies_at(place: _Place, pixel_px: Vector2, size_px: float = 0.0) -> bool:
    """Return whether a place and another, seen in a disc of some size, are one: peaks of large discs are blunt."""
    off_px = float(np.hypot(*(place.pixel_px - pixel_px)))
    return off_px <= max(_SAME_PX, _SAME * max(place.size_px, size_px))


def _peaks(level: _Reduced, near_px: Vector2, reach_px: float, radius_px: float) -> Iterator[_Place]:
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
            yield _Place(float(scores[row, column]), pixel_px, starts_rad[row, column], level, radius_px)


_LEAST_SCORE = 0.6
_CONTRAST, _STEP_GREY, _EXPLAINED = 6.0, 20.0, 0.965
"""What a corner shows at least: steps between two sheets, in standard deviations of what the fit leaves and in linear grey levels
of 255; and the share of the variance in the disc that three sheets explain."""
_WIDTHS_DEG = (85.0, 152.0)
"""Angles of a sheet: an edge or the tip of a sheet has 180 deg or more."""
_HALF_TURN = (-0.90, -0.15)
"""Correlation of the disc with itself turned by 180 deg: -1 for a straight edge, 1 for a line or the X of a checkerboard."""
_MOST_BLUR, _ANY_BLUR = 0.3, 0.35
"""Largest blur of a corner, and of a fit, relative to the radius of the disc: smooth shading has no edges."""
_FITTED, _BLUR, _FLOOR_PX2 = 3.4, 0.009, 0.03
"""How the covariance follows from the fit's, the square of the blur, and what is always added: fitted once to simulated images
(`python -m benchmarks.apex` measures the coverage on others)."""
_FIRST_BLUR_PX, _LEAST_BLUR_PX = 0.7, 0.35
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


@dataclass(frozen=True, slots=True, eq=False)
class _Linearized:
    """The fit at one state (x, y, three directions, blur): what it leaves, and derivatives with the levels (3,) solved for."""

    levels: Values
    left: Values
    jacobian: np.ndarray

    @property
    def cost(self) -> float:
        return float(self.left @ self.left)


def _fitted(place: _Place) -> Apex | None:
    """Fit apex, directions, blur and grey levels to the disc around a place; None if they show no corner."""
    level, radius_px = place.level, place.radius_px
    at_px = level.of_full(place.pixel_px)
    disc = _disc(level.grey, at_px, radius_px)
    if disc is None:
        return None
    state = np.array([*(at_px - disc.middle_px), *place.starts_rad, _FIRST_BLUR_PX])
    at, damping = _linearize(disc, state), 1e-3
    for _ in range(_ITERATIONS):
        normal = at.jacobian @ at.jacobian.T
        damped = normal + damping * np.diag(np.diag(normal) + 1e-9)
        step = np.clip(np.linalg.solve(damped, at.jacobian @ at.left), -_STEP_LIMIT, _STEP_LIMIT)
        moved = state + step
        moved[5] = np.clip(moved[5], _LEAST_BLUR_PX, _ANY_BLUR * radius_px)
        new = _linearize(disc, moved)
        if new.cost >= at.cost:
            damping *= 6.0
            continue
        state, at, damping = moved, new, damping / 4.0
        if float(np.abs(step[:2]).max()) < _ENOUGH_PX:
            break
    return _corner(place, disc, state, at)


def _corner(place: _Place, disc: _Disc, state: Values, at: _Linearized) -> Apex | None:
    """Return the apex of a fit that shows three sheets which meet in one point."""
    factor = place.level.factor
    variance = at.cost / max(len(disc.grey) - len(at.levels) - len(state), 1) + _ROUNDING_GREY2
    step_grey = float(np.abs(at.levels - at.levels[_LAST]).min())
    contrast = step_grey / float(np.sqrt(variance))
    grey = disc.grey - disc.grey.mean()
    total = max(float(grey @ grey), 1e-9)
    explained, half_turn = 1.0 - at.cost / total, float(grey @ grey[::-1]) / total
    widths_deg = np.rad2deg(np.diff(state[2:5], append=state[2] + 2.0 * np.pi))
    within = _WIDTHS_DEG[0] <= widths_deg.min() and widths_deg.max() <= _WIDTHS_DEG[1]
    within = (
        within and float(np.hypot(state[0], state[1])) <= place.radius_px and state[5] <= _MOST_BLUR * place.radius_px
    )
    within = within and _HALF_TURN[0] <= half_turn <= _HALF_TURN[1]
    if not (within and contrast >= _CONTRAST and step_grey >= _STEP_GREY and explained >= _EXPLAINED):
        return None
    added_px2 = _FLOOR_PX2 + _BLUR * (factor * state[5]) ** 2
    fitted = variance * np.linalg.inv(at.jacobian @ at.jacobian.T + 1e-9 * np.eye(6))[:2, :2]
    covariance_px2 = _FITTED * factor**2 * fitted + added_px2 * np.eye(2)
    return Apex(place.level.to_full(disc.middle_px + state[:2]), covariance_px2, contrast, place.size_px)


def _disc(grey: np.ndarray, apex_px: Vector2, radius_px: float) -> _Disc | None:
    half = int(np.ceil(radius_px))
    column, row = (round(float(v)) for v in apex_px)
    height, width = grey.shape
    if not (half <= column < width - half and half <= row < height - half):
        return None
    x, y = np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1))
    inside = x * x + y * y <= radius_px * radius_px
    levels = grey[row - half : row + half + 1, column - half : column + half + 1][inside]
    return _Disc(
        np.array([column, row], dtype=np.float64),
        x[inside].astype(float),
        y[inside].astype(float),
        levels.astype(float),
    )


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
    shares = products / total
    normal = shares @ shares.T + 1e-6 * len(disc.grey) * np.eye(3)
    levels = np.linalg.solve(normal, shares @ disc.grey)
    fitted = levels @ shares
    by_product = (levels[:, None] - fitted) / total
    by_past = by_product * before - (by_product * past)[_LAST]
    by_across = by_past * np.exp(-0.5 * across * across) / (blur * np.sqrt(2.0 * np.pi))
    jacobian = np.stack(
        [sin[:, 0] @ by_across, -cos[:, 0] @ by_across, *(-by_across * along), -(by_across * across).sum(axis=0)]
    )
    jacobian -= np.linalg.solve(normal, shares @ jacobian.T).T @ shares
    return _Linearized(levels, disc.grey - fitted, jacobian)


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
