"""Which views and corners do not belong to the others: blurred, mirrored, of another board, or found wrongly."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Values, freeze
from calib_core.camera import Camera
from calib_core.intrinsics.adjustment import adjust, adjust_robustly, pose_views, typical_sigma
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.linearization import BoardWarp, Freedom, LensState, ViewStack, residuals_of

_ROUNDS = 4
_CORNER_LIMIT = 8.0  # standard deviations of the view; real corners reach 4
_MOST_CORNERS_OUT = 0.2
_LEAST_CORNERS = 6
_VIEW_RATIO = 2.0
_VIEW_SIGMAS = 5.0  # of the logarithms of the views' residuals
_LEAST_SPREAD = 0.1
_FLOOR_PX = 0.05  # below, residuals are rounding
_MIRROR_RATIO = 1.15  # and more, as far as other good views fit better mirrored by chance
_MIRROR_QUANTILE, _MIRROR_SPREADS = 0.8, 3.0
_BLUR_RATIO, _BLUR_RESIDUAL_RATIO = 1.8, 1.3
_LEAST_OTHERS = 3  # views that tell which of two mirror images is mirrored
_STRETCH = 0.01
_NO_POSE_SHARE = 0.2  # of the image's longer side


@dataclass(frozen=True, slots=True, eq=False)
class JudgedViews:
    """Which views to use, and which of their corners.

    Attributes:
        stack: all views; what is not used has no weight.
        state: a robust fit to what is used.
        kept: (v,) which views are used.
        reasons: (v,) why not; empty for a view that is used.
    """

    stack: ViewStack
    state: LensState
    kept: Flags
    reasons: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, bool, kept=(len(self.reasons),))


@dataclass(frozen=True, slots=True, eq=False)
class _Fits:
    """How each view fits a lens by itself: poses, distances (v, m) and the root mean square of the corners that fit (v,)."""

    state: LensState
    distances_px: np.ndarray
    corners: np.ndarray
    rms_px: np.ndarray
    limit_px: np.ndarray

    @property
    def good(self) -> Flags:
        return np.asarray(np.isfinite(self.rms_px) & (self.rms_px <= self.limit_px))

    @property
    def typical_px(self) -> float:
        return float(np.median(self.rms_px[self.good])) if self.good.any() else float(np.median(self.rms_px))


def judge_views(
    views: Sequence[BoardCorners], stack: ViewStack, state: LensState, *, may_be_mirrored: bool = True
) -> JudgedViews:
    """Find the views and corners that do not belong to the others, given a robust first fit.

    Args:
        views: of the board.
        stack: the same.
        state: a lens that most of them fit.
        may_be_mirrored: whether the board is found in mirrored images too; one with markers is not.
    """
    whole = stack
    for _ in range(_ROUNDS):
        fits = _fits(state.camera, whole)
        reasons = _reasons(views, whole, fits, may_be_mirrored=may_be_mirrored)
        kept = np.array([not reason for reason in reasons])
        weights = np.where(kept[:, None] & fits.corners, whole.weights, 0.0)
        settled = np.array_equal(weights > 0, stack.weights > 0)
        stack = whole.weighted(weights)
        if not kept.any():
            break
        state = adjust(
            LensState(state.camera, fits.state.rotations, fits.state.translations_m), stack, Freedom.of(state.camera)
        )
        if settled:
            break
    return JudgedViews(stack, state, kept, reasons)


def _fits(camera: Camera, stack: ViewStack) -> _Fits:
    """Pose each view by itself, forgiving corners that do not fit."""
    state, posed = pose_views(camera, stack)
    state = adjust_robustly(state, posed, Freedom.none(camera))
    residuals = residuals_of(state, stack)
    distances = np.sqrt(np.square(residuals).sum(axis=1))
    distances[posed.corner_counts == 0] = np.inf
    distances = np.where(np.isfinite(distances), distances, np.inf)
    typical = max(typical_sigma(residuals, posed), _FLOOR_PX)
    own = np.array([np.median(row[used > 0]) for row, used in zip(distances, stack.weights, strict=True)]) / 1.1774
    corners = (distances <= _CORNER_LIMIT * np.maximum(own, typical)[:, None]) & (stack.weights > 0)
    count = np.maximum(corners.sum(axis=1), 1)
    freedom = np.maximum(2.0 * count - 6.0, 1.0)
    with np.errstate(invalid="ignore"):
        squares = np.where(corners, np.square(distances), 0.0).sum(axis=1) / count * (2.0 * count / freedom)
    rms = np.where(corners.any(axis=1), np.sqrt(squares), np.inf)
    return _Fits(state, distances, corners, rms, _limits(rms, freedom))


def _limits(rms_px: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    """Return up to which residual a view belongs to the others: (v,) [px].

    The logarithms of the views' residuals scatter; a view whose own is many of their standard deviations above the median,
    and at least twice as large, does not belong.
    """
    finite = np.isfinite(rms_px)
    if not finite.any():
        return np.zeros(len(rms_px))
    logarithms = np.log(np.maximum(rms_px[finite], _FLOOR_PX))
    middle = np.median(logarithms)
    spread = max(1.4826 * float(np.median(np.abs(logarithms - middle))), _LEAST_SPREAD)
    spreads = np.maximum(spread, 1.0 / np.sqrt(2.0 * freedom))
    return np.asarray(np.exp(middle) * np.maximum(_VIEW_RATIO, np.exp(_VIEW_SIGMAS * spreads)))


def _reasons(views: Sequence[BoardCorners], stack: ViewStack, fits: _Fits, *, may_be_mirrored: bool) -> tuple[str, ...]:
    """Say of each view why it is not used; nothing of one that is."""
    typical = fits.typical_px
    mirrored = _fits(fits.state.camera, stack.mirrored())
    exchanged = _exchanged(fits, mirrored) & may_be_mirrored
    twins = _mirrored_twins(stack, fits, exchanged) if may_be_mirrored else {}
    blurs = np.array([view.blur_px for view in views])
    known = blurs[np.isfinite(blurs)]
    usual_blur = float(np.median(known)) if len(known) else float("nan")
    reasons = []
    for row in range(len(views)):
        rms, other = float(fits.rms_px[row]), float(mirrored.rms_px[row])
        share_out = 1.0 - fits.corners[row].sum() / max(int((stack.weights[row] > 0).sum()), 1)
        wrong = not fits.good[row] or share_out > _MOST_CORNERS_OUT
        if exchanged[row]:
            reasons.append(
                f"mirrored: with left and right exchanged its corners fit to {other:.2f} px, as they are to {rms:.2f} px"
            )
        elif row in twins:
            own_px, twin_px = twins[row][1:]
            reasons.append(
                f"mirrored: its corners are those of {views[twins[row][0]].name} with left and right exchanged, and fit the lens "
                f"of all others to {own_px:.2f} px, those of {views[twins[row][0]].name} to {twin_px:.2f} px"
            )
        elif blurs[row] > _BLUR_RATIO * usual_blur and rms > _BLUR_RESIDUAL_RATIO * typical:
            reasons.append(
                f"blurred: edges are {blurs[row]:.1f} px wide, those of the others {usual_blur:.1f} px, and its corners "
                f"fit to {rms:.2f} px, those of the others to {typical:.2f} px"
            )
        elif wrong:
            reasons.append(_misfit(stack.of(np.array([row])), fits, row))
        elif fits.corners[row].sum() < _LEAST_CORNERS:
            reasons.append(
                f"only {fits.corners[row].sum()} corners of the board that fit; a view needs {_LEAST_CORNERS}"
            )
        else:
            reasons.append("")
    return tuple(reasons)


def _exchanged(fits: _Fits, mirrored: _Fits) -> Flags:
    """Return which views (v,) are mirrored: their corners fit better with left and right exchanged, and then like the others.

    A lens whose middle is that of the image fits both alike, and where something else is not described, good views may fit
    better mirrored; so that as many of them as do raise the limit.
    """
    own, other = np.maximum(fits.rms_px, _FLOOR_PX), np.maximum(mirrored.rms_px, _FLOOR_PX)
    both = np.isfinite(own) & np.isfinite(other)
    gains = np.log(np.where(both, own, 1.0) / np.where(both, other, 1.0))
    by_chance = max(float(np.quantile(gains[both], _MIRROR_QUANTILE)), 0.0) if both.any() else 0.0
    better = gains > np.log(_MIRROR_RATIO) + _MIRROR_SPREADS * by_chance
    return np.asarray(better & (own > _MIRROR_RATIO * fits.typical_px) & (other <= fits.limit_px / _MIRROR_RATIO))


def _mirrored_twins(stack: ViewStack, fits: _Fits, exchanged: Flags) -> dict[int, tuple[int, float, float]]:
    """Return the mirrored one of each pair of mirror images: its twin, and how both fit the lens of all other views [px].

    That two images are mirror images says that one is mirrored, also where the lens is so symmetric that it fits both.
    """
    found: dict[int, tuple[int, float, float]] = {}
    for pair in mirror_twins(stack, fits.typical_px):
        others = fits.good & ~exchanged
        others[list(pair)] = False
        if exchanged[list(pair)].any() or others.sum() < _LEAST_OTHERS:
            continue
        weights = np.where(others[:, None] & fits.corners, stack.weights, 0.0)
        lens = adjust(fits.state, stack.weighted(weights), Freedom.of(fits.state.camera)).camera
        first, second = _fits(lens, stack.of(np.array(pair))).rms_px
        worse, better = pair if first > second else pair[::-1]
        found[worse] = (better, float(max(first, second)), float(min(first, second)))
    return found


def _misfit(view: ViewStack, fits: _Fits, row: int) -> str:
    """Say of a view whose corners do not fit the board whether another shape of the squares would fit."""
    typical = fits.typical_px
    state, posed = pose_views(fits.state.camera, view)
    squares = view.mean_square(residuals_of(state, view))
    apart = float(np.sqrt(squares[0])) if np.isfinite(squares[0]) and posed.corner_counts[0] else float("inf")
    if not apart < _NO_POSE_SHARE * max(view.size_px):
        return "no pose of the board puts its corners where they were found: another board, or a wrong detection"
    directions = np.zeros((1, int(view.corner_ids.max()) + 1, 3))
    directions[0, view.corner_ids[0], 0] = view.board_m[0, 0]
    stretched = BoardWarp(("stretch",), directions)  # makes the rows of the board longer
    other = adjust(state, posed, Freedom(np.zeros((len(state.camera.parameters), 0)), stretched))
    left = float(np.sqrt(view.mean_square(residuals_of(other, view, stretched))[0]))
    ratio = 1.0 + float(other.amounts[0])
    if left <= fits.limit_px[row] and abs(ratio - 1.0) > _STRETCH:
        return (
            f"another board: its corners fit to {apart:.2f} px, but to {left:.2f} px if its squares are "
            f"{ratio:.2f} times as wide as high"
        )
    return (
        f"its corners fit to {apart:.2f} px in any pose of the board, those of the others to {typical:.2f} px: another board, a "
        "wrong detection, or blurred by motion"
    )


_COPY_SHARE = (
    0.7  # of the residuals; corners of two images taken apart differ by 1.4 times these, those of copies by less
)
_LEAST_COPY_PX = 0.05
_FARTHEST_PX = 2.0
_LEAST_APART_PX = 2.0


def mirror_twins(stack: ViewStack, typical_px: float) -> tuple[tuple[int, int], ...]:
    """Return the pairs of views whose corners coincide once left and right are exchanged.

    Views that hardly differ from their own mirror image are no pair: which of them is mirrored does not matter.

    Args:
        stack: the views, with whatever ids their corners have: a mirrored board is often read in another order.
        typical_px: root mean square of the residuals of good views.
    """
    corners = [stack.pixels_px[row][:, stack.weights[row] > 0].T for row in range(len(stack))]
    mirrored = [np.array([stack.size_px[0] - 1.0, 0.0]) + points * [-1.0, 1.0] for points in corners]
    largest = max(_COPY_SHARE * typical_px, _LEAST_COPY_PX)
    pairs = []
    for first, points in enumerate(corners):
        for second in range(first + 1, len(corners)):
            if not len(points) or len(points) != len(corners[second]):
                continue
            if np.abs(points.mean(axis=0) - mirrored[second].mean(axis=0)).max() > _FARTHEST_PX:
                continue
            apart = _distances_px(points, mirrored[second])
            alike = apart.max() <= _FARTHEST_PX and float(np.sqrt(np.mean(apart**2))) <= largest
            if alike and _distances_px(points, corners[second]).max() > _LEAST_APART_PX:
                pairs.append((first, second))
    return tuple(pairs)


def _distances_px(points: Values, others: Values) -> Values:
    """Return the distance (n,) of each point (n, 2) to the nearest of the others (m, 2)."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(points)[0])
